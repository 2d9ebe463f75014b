"""Elastic supports and lumped masses against exact solutions: a damped body on springs and a beam with a mass."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from scipy.optimize import brentq

from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.mesh.facet import bedding_matrices
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.problem.fittings import PointMass
from reflowshock.fem.run.structure import run_structure
from tests.support.fem_structures import STEEL, structure_input

LENGTH, WIDTH, THICKNESS = 60e-3, 6e-3, 2e-3
BEAM = STEEL | {"poisson_ratio": 0.0}
AREA, INERTIA = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12


def strip(cells: tuple[int, int, int]) -> MeshData:
    """Return the mesh of a strip, from numbers of elements along x, y and z."""
    x, y = (np.linspace(-0.5, 0.5, n + 1) * side for n, side in zip(cells, (LENGTH, WIDTH), strict=False))
    points, hexahedra = grid(x, y, np.linspace(0.0, THICKNESS, cells[2] + 1))
    sides = {"x_min": on(0, x[0]), "x_max": on(0, x[-1]), "z_min": on(2, 0.0), "z_max": on(2, THICKNESS)}
    return mesh_of(points, hexahedra, "board", sides)


def run(directory: Path, cells: tuple[int, int, int], **changes) -> tuple[dict, dict[str, np.ndarray]]:
    """Run a strip with changed tables of its input; return its result and its history."""
    structure = {"length": LENGTH, "width": WIDTH, "cells": cells[:2]} | {
        "layers": {"board": {"material": "steel", "thickness": THICKNESS, "cells": cells[2]}}
    }
    inputs = {"structure": structure, "materials": {"steel": BEAM}, "loads": {}, "watch": {}} | changes
    request = structure_input(directory, strip(cells), **inputs)
    run_structure(MPI.COMM_SELF, request)
    with np.load(request.output / "history.npz") as arrays:
        return json.loads((request.output / "result.json").read_text()), dict(arrays)


def beam_frequency(rotation: float, mass: float, modes: int) -> list[float]:
    """Return the frequencies [Hz] of a pinned beam with end springs [N m/rad] and a central mass [kg].

    Symmetric half: at the end w = 0 and E I w'' = k w'; at the middle w' = 0 and
    E I w''' = m w^2 w / 2. Antisymmetric half: w = w'' = 0 at the middle.
    """
    bending, linear = BEAM["young_modulus"] * INERTIA, BEAM["density"] * AREA
    half = 0.5 * LENGTH

    def rows(beta: float, symmetric: bool) -> float:
        def shape(x: float, order: int) -> np.ndarray:
            """Return the derivative of cos, sin, cosh and sinh."""
            s, c = np.sin(beta * x), np.cos(beta * x)
            trig = [[c, s], [-s, c], [-c, -s], [s, -c]][order % 4]
            hyper = [np.cosh(beta * x), np.sinh(beta * x)][:: 1 if order % 2 == 0 else -1]
            return beta**order * np.array([*trig, *hyper])

        squared = beta**4 * bending / linear
        end = [shape(0.0, 0), bending * shape(0.0, 2) - rotation * shape(0.0, 1)]
        middle = (
            [shape(half, 1), bending * shape(half, 3) + 0.5 * mass * squared * shape(half, 0)]
            if symmetric
            else [shape(half, 0), shape(half, 2)]
        )
        matrix = np.array([*end, *middle])
        return float(np.linalg.det(matrix / np.abs(matrix).max(axis=1)[:, None]))

    frequencies = []
    for symmetric in (True, False):
        grid_of = np.linspace(0.5, 14.0, 2000) / LENGTH
        values = [rows(beta, symmetric) for beta in grid_of]
        for k in np.flatnonzero(np.diff(np.sign(values))):
            beta = brentq(lambda wave_number, even=symmetric: rows(wave_number, even), grid_of[k], grid_of[k + 1])
            frequencies.append(beta**2 * np.sqrt(bending / linear) / (2 * np.pi))
    return sorted(frequencies)[:modes]


@pytest.mark.parametrize(("softness", "share"), [(1e-9, 0.0), (1.0, 0.0), (1.0, 0.5), (5.0, 0.3)])
def test_beam_with_springs_at_its_ends_and_a_mass(tmp_path, softness, share):
    """The beam bends in x-z only; ``softness`` is E I / (k L), ``share`` the mass over the mass of the beam."""
    rotation = BEAM["young_modulus"] * INERTIA / LENGTH / softness
    mass = share * BEAM["density"] * AREA * LENGTH
    per_area = min(rotation / INERTIA, 1e17)
    supports = {side: {"on": side, "hold": ["y", "z"], "bedding": {"x": per_area}} for side in ("x_min", "x_max")}
    masses = {"lid": {"mass": mass, "at": [0.0, 0.0, 0.5 * THICKNESS]}} if mass else {}
    dynamics = {
        "duration": 1e-4,
        "solver": "implicit",
        "modes": 6,
        "numerics": {"implicit_step": 5e-5, "history_samples": 2},
    }
    loads = {"drop": {"kind": "input_g", "peak": 1.0, "duration": 1e-4}}
    tables = {"supports": supports, "masses": masses, "dynamics": dynamics, "loads": loads, "solver": "implicit"}
    result, _ = run(tmp_path, (60, 1, 2), **tables)
    modes = json.loads((tmp_path / "out" / "modes.json").read_text())
    bending = [mode["frequency"] for mode in modes if mode["mass_fraction"]["y"] < 1e-6]
    exact = beam_frequency(rotation, mass, 2)
    nearest = [min(bending, key=lambda frequency, target=target: abs(frequency - target)) for target in exact]
    assert nearest == pytest.approx(exact, rel=0.012)  # shear lowers mode 1 by 0.5 %, mode 2 by 1 %
    assert result["metrics"]["first_frequency"]["value"] == pytest.approx(modes[0]["frequency"])
    total = BEAM["density"] * AREA * LENGTH + mass
    assert result["metrics"]["model_mass"]["value"] == pytest.approx(total)


def test_damped_body_on_springs_and_its_reaction(tmp_path):
    """A block with a mass on a bedding oscillates as one mass: frequency, decay and spring force."""
    stiffness, mass, ratio = 2e8, 3e-3, 0.05  # N/m^3, kg
    supports = {"foot": {"on": "z_min", "hold": ["x", "y"], "bedding": {"z": stiffness}}}
    masses = {"lid": {"mass": mass, "at": [0.0, 0.0, THICKNESS], "footprint": [20e-3, 4e-3]}}
    total = BEAM["density"] * AREA * LENGTH + mass
    rate = np.sqrt(stiffness * LENGTH * WIDTH / total)
    dynamics = {
        "duration": 4 * 2 * np.pi / rate,
        "initial_velocity": [0.0, 0.0, 0.1],
        "damping": {"mass_ratio": ratio, "frequency": rate / (2 * np.pi)},
        "numerics": {"history_samples": 400, "implicit_step": 2 * np.pi / rate / 200},
    }
    tables = {"supports": supports, "masses": masses, "dynamics": dynamics, "solver": "implicit"}
    watch = {"middle": {"at": [0.0, 0.0, 0.0]}}
    result, history = run(tmp_path, (6, 1, 1), watch=watch, **tables)
    damped = rate * np.sqrt(1 - ratio**2)
    time = history["time"]
    exact = 0.1 / damped * np.exp(-ratio * rate * time) * np.sin(damped * time)
    displacement = history["displacement@middle"][:, 2]
    assert np.abs(displacement - exact).max() < 0.01 * np.abs(exact).max()
    pull = -stiffness * LENGTH * WIDTH * exact
    assert np.abs(history["reaction@foot"][:, 2] - pull).max() < 0.01 * np.abs(pull).max()
    assert result["health"]["energy_balance_error"]["value"] < 1e-9
    assert "peak_acceleration@middle" not in result["metrics"] or rate < 2e4


@pytest.mark.parametrize("estimate", ["element", "power_iteration"])
def test_explicit_steps_on_stiff_springs_are_stable(tmp_path, estimate):
    """Springs far stiffer than the elements limit the step; the balance is exact only in a stable run."""
    supports = {"foot": {"on": "z_min", "hold": ["x", "y"], "bedding": {"z": 1e17}}}
    dynamics = {"duration": 2e-5, "initial_velocity": [0.0, 0.0, 0.1]}
    dynamics |= {"numerics": {"critical_step": estimate, "step_fraction": 0.99, "history_samples": 20}}
    result, _ = run(tmp_path, (6, 1, 2), supports=supports, dynamics=dynamics)
    assert result["health"]["energy_balance_error"]["value"] < 1e-9


def test_explicit_and_implicit_agree_on_springs(tmp_path):
    supports = {side: {"on": side, "hold": ["y", "z"], "bedding": {"x": 5e13}} for side in ("x_min", "x_max")}
    tables = {
        "supports": supports,
        "masses": {"lid": {"mass": 2e-3, "at": [0.0, 0.0, THICKNESS], "footprint": [8e-3, 4e-3]}},
        "loads": {"drop": {"kind": "input_g", "peak": 1e4, "duration": 2e-4}},
        "watch": {"middle": {"at": [0.0, 0.0, 0.0]}},
        "dynamics": {"duration": 5e-4, "numerics": {"implicit_step": 1e-6, "history_samples": 100}},
    }
    both = {}
    for solver in ("explicit", "implicit"):
        (tmp_path / solver).mkdir()
        both[solver] = run(tmp_path / solver, (20, 1, 2), solver=solver, **tables)
    moved = [history["displacement@middle"][:, 2] for _, history in both.values()]
    assert np.abs(moved[0] - moved[1]).max() < 2e-3 * np.abs(moved[0]).max()
    peaks = [result["metrics"]["peak_acceleration@middle"]["value"] for result, _ in both.values()]
    assert peaks[0] == pytest.approx(peaks[1], rel=2e-3)


def test_half_a_structure_carries_half_of_a_mass():
    for at, footprint, share in (
        ((0.0, 0.2, 0.0), None, 0.5),
        ((0.2, 0.0, 0.0), None, 1.0),
        ((0.0, 0.0, 0.0), (0.4, 0.2), 0.5),
        ((0.3, 0.0, 0.0), (0.4, 0.2), 1.0),
    ):
        places = PointMass(mass=1.0, at=at, footprint=footprint).meshed_places(("x",), 1e-9)
        assert sum(part for _, part in places) == pytest.approx(share)
        assert all(position[0] >= 0.0 for position, _ in places)


@pytest.mark.parametrize("corners", [3, 4, 6])
def test_bedding_of_facets_integrates_products(corners):
    """A bedding of 1 N/m^3 on a unit triangle or square gives its area and its second moment about an edge."""
    points = {
        3: [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        4: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        6: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0]],
    }[corners]
    facet = np.array([points], dtype=float)
    [matrix] = bedding_matrices(facet)
    x = facet[0, :, 0]
    area, moment = (1.0, 1.0 / 3.0) if corners == 4 else (0.5, 1.0 / 12.0)
    assert matrix.sum() == pytest.approx(area)
    assert x @ matrix @ x == pytest.approx(moment)
