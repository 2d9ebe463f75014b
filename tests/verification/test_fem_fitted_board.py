"""Gauges and neighbours of a board: exact fields, and a drop against the same board as a structure."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from pydantic import TypeAdapter
from scipy.spatial import cKDTree

from reflowshock.fem.division.fitted import fit_to_mesh, fitted
from reflowshock.fem.division.neighbours import with_neighbours
from reflowshock.fem.elements.element import element_geometry
from reflowshock.fem.errors import LoadError
from reflowshock.fem.mesh.mesh import MeshData, merge_nodes
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.problem.fittings import Fittings, Neighbour
from reflowshock.fem.problem.inputs import INPUT
from reflowshock.fem.run.package import run_package
from reflowshock.fem.run.structure import run_structure
from reflowshock.fem.setup.structure_models import build_structure
from tests.support.fem_models import BOARD_X, BOARD_Y, BOARD_Z, board_mesh, write_msh
from tests.support.fem_structures import LENGTH, STEEL, THICKNESS, WIDTH, strip_mesh, structure_input

CURVATURE = np.array([3.0, -1.0, 2.0])  # w in xx, yy, xy [1/m]


def bent(points: np.ndarray, middle: float) -> np.ndarray:
    """Return the displacement of a plate bent to constant curvatures."""
    x, y, z = points.T
    xx, yy, xy = CURVATURE
    slope = np.array([xx * x + xy * y, yy * y + xy * x])
    return np.column_stack([*(-(z - middle) * slope), 0.5 * (xx * x**2 + yy * y**2) + xy * x * y])


def strains_of(mesh: MeshData, displacement: np.ndarray, symmetry: tuple[str, ...] = (), **gauges) -> dict[str, float]:
    """Return the strain of each gauge on a mesh at a displacement (n, 3) [m], by name."""
    fittings = TypeAdapter(Fittings).validate_python({"gauges": gauges})
    table = fitted(mesh, fittings, symmetry, np.empty(0, np.int32), yields=False).points.gauges
    stretches = np.zeros((len(table.names), 3))
    np.add.at(stretches, table.gauge, table.weight * displacement[table.nodes])
    strains = [table.strains(stretches, turning).tolist() for turning in (False, True)]
    return dict(zip(table.names, zip(*strains, strict=True), strict=True))


@pytest.mark.parametrize("slant", [0.0, 30.0, 90.0])
@pytest.mark.parametrize("face", ["upper", "lower"])
def test_gauge_on_a_bent_plate(face, slant):
    """The strain is half the thickness times the curvature along the gauge; a long gauge reads the mean."""
    along = np.array([np.cos(np.radians(slant)), np.sin(np.radians(slant))])
    middle = 0.5 * THICKNESS
    xx, yy, xy = CURVATURE
    across = along @ np.array([[xx, xy], [xy, yy]]) @ along
    exact = (-middle if face == "upper" else middle) * across
    mesh = strip_mesh((8, 3, 2))
    gauge = {"at": [1.3e-3, 0.4e-3], "face": face, "direction": along.tolist(), "length": 4e-3}
    strain = strains_of(mesh, bent(mesh.points, middle), g=gauge)["g"][0]
    assert strain == pytest.approx(exact, rel=1e-9)


def test_gauges_on_a_cantilever_read_the_moment_at_their_middles(tmp_path):
    """A tip force gives the strain F (L - x) c / (E I) at the distance c from the neutral line at rest."""
    force, mesh = 2.0, strip_mesh((20, 2, 2))
    steel = STEEL | {"poisson_ratio": 0.0}
    places = {"root": (-6e-3, "upper"), "middle": (0.7e-3, "lower")}
    gauges = {name: {"at": [x, 0.0], "face": face} for name, (x, face) in places.items()}
    request = structure_input(tmp_path, mesh, materials={"steel": steel}, gauges=gauges, watch={})
    model, _ = build_structure(MPI.COMM_SELF, request, [1.0])
    equations, load = Equations.of(MPI.COMM_SELF, model.body), np.zeros((len(model.body.mass), 3))
    tip = model.body.local.points[:, 0] > 0.5 * LENGTH - 1e-9
    load[tip, 2] = force / tip.sum()
    solution, displacement = equations.vector(load), np.zeros_like(load)
    Factorisation(equations.stiffness()).solve(equations.vector(load), solution)
    equations.spread(solution, displacement)
    table = model.tables.fitted.points.gauges
    stretches = np.zeros((2, 3))
    np.add.at(stretches, table.gauge, table.weight * displacement[model.body.local.locate(table.nodes)])
    for strain, (x, face) in zip(table.strains(stretches, False), places.values(), strict=True):
        bending = force * (0.5 * LENGTH - x) * 0.5 * THICKNESS / (STEEL["young_modulus"] * WIDTH * THICKNESS**3 / 12)
        assert strain == pytest.approx(-bending if face == "upper" else bending, rel=2e-3)


def test_rotation_is_no_strain():
    mesh = strip_mesh()
    turn, stretch = np.radians(20.0), 1.001
    rotation = np.array([[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0], [-np.sin(turn), 0.0, np.cos(turn)]])
    moved = mesh.points @ rotation.T * stretch - mesh.points
    small, finite = strains_of(mesh, moved, g={"at": [0.0, 0.0]})["g"]
    assert finite == pytest.approx(stretch - 1.0) and small < -0.05


def test_ends_beyond_a_plane_of_symmetry_are_mirrored():
    mesh = board_mesh(size=1e-3)
    displacement = np.column_stack([2e-3 * mesh.points[:, 0], 5e-3 * mesh.points[:, 1], np.zeros(len(mesh.points))])
    gauges = {"x": {"at": [0.0, 0.0]}, "y": {"at": [3e-3, 0.0], "direction": [0.0, 1.0]}}
    strains = strains_of(mesh, displacement, ("x", "y"), **gauges)
    assert [strains["x"][0], strains["y"][0]] == pytest.approx([2e-3, 5e-3])


def test_gauge_beyond_the_edge_is_refused():
    with pytest.raises(LoadError, match=r"gauges.g: the end at = \(0.01\d*, 0, 0\) m lies outside the mesh"):
        strains_of(strip_mesh(), np.zeros_like(strip_mesh().points), g={"at": [9.9e-3, 0.0]})


def test_gauges_and_masses_keep_the_node_numbers_of_the_whole_mesh():
    mesh = board_mesh(size=1e-3)
    upper = mesh.in_parts("board_patch".__eq__)
    fittings = TypeAdapter(Fittings).validate_python(
        {"watch": {"a": {"at": [2e-3, 2e-3, 0.0]}}, "gauges": {"g": {"at": [1e-3, 1e-3], "face": "upper"}}}
    )
    table = fit_to_mesh(mesh, upper, fittings, False)
    assert mesh.points[table.points.nodes[0]] == pytest.approx([2e-3, 2e-3, 0.0])
    assert upper[table.points.cells].all()
    assert mesh.points[table.points.gauges.nodes][:, 2].max() == 0.0


SPRINGS = {"screws": {"on": "mounting_holes", "hold": ["x", "y"], "bedding": {"z": 2e11}}}
FITTED = {
    "watch": {"edge": {"at": [BOARD_X - 3e-3, 1e-3, 0.0]}},
    "gauges": {"middle": {"at": [0.0, 1e-3]}, "slant": {"at": [5e-3, 3e-3], "face": "upper", "direction": [1.0, 2.0]}},
    "masses": {"coil": {"mass": 2e-4, "at": [6e-3, 0.0, -0.5 * BOARD_Z], "footprint": [2e-3, 3e-3]}},
}
PEAK, PULSE, END = 14709.975, 5e-5, 1e-4


def outputs_of(folder: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """Return result and history in a folder."""
    with np.load(folder / "history.npz") as arrays:
        return json.loads((folder / "result.json").read_text()), dict(arrays)


def dropped(folder: Path, kinematics: str, supports: dict, **more) -> tuple[dict, dict[str, np.ndarray]]:
    """Run the drop of a board without a package."""
    shock = {"peak_acceleration": PEAK, "pulse_duration": PULSE, "duration": END, "modes": 3, "gravity": "off"}
    shock |= {"numerics": {"kinematics": kinematics, "history_samples": 50, "field_samples": 2}}
    shock |= {"numerics": shock["numerics"] | {"step_fraction": 0.5}}
    tables = {"mode": "dns", "meshes": [str(folder / "board.msh")], "shock": shock, "output": str(folder / "drop")}
    tables |= {"materials": {"board": STEEL}, "supports": supports} | FITTED | more
    request = INPUT.validate_python(tables)
    request.output.mkdir()
    run_package(MPI.COMM_SELF, request)
    return outputs_of(request.output)


def as_structure(
    folder: Path, kinematics: str, supports: dict, parts=("board", "board_patch"), **more
) -> tuple[dict, dict[str, np.ndarray]]:
    """Run the same mesh as a structure of two layers, with supports on its planes of symmetry."""
    layer = {"material": "steel", "thickness": 0.5 * BOARD_Z}
    body = {"length": 2 * BOARD_X, "width": 2 * BOARD_Y, "cells": [1, 1], "symmetry": ["x", "y"]}
    body |= {"layers": dict.fromkeys(parts, layer)}
    dynamics = {"duration": END, "modes": 3, "kinematics": kinematics}
    dynamics |= {"numerics": {"history_samples": 50, "field_samples": 2, "step_fraction": 0.5}}
    load = {"kind": "input_g", "peak": PEAK, "duration": PULSE, "direction": [0.0, 0.0, -1.0]}
    tables = {"mode": "structure", "solver": "explicit", "mesh": str(folder / "box.msh"), "structure": body}
    tables |= {"materials": {"steel": STEEL}, "supports": supports, "loads": {"drop": load}, "dynamics": dynamics}
    request = INPUT.validate_python(tables | FITTED | more | {"output": str(folder / "structure")})
    request.output.mkdir()
    run_structure(MPI.COMM_SELF, request)
    return outputs_of(request.output)


@pytest.mark.parametrize(("kinematics", "sprung"), [("small", False), ("small", True), ("corotational", True)])
def test_drop_of_a_board_equals_the_same_structure(tmp_path, kinematics, sprung):
    mesh = board_mesh(size=1e-3, layers=2, patch_layers=1)
    write_msh(mesh, tmp_path / "board.msh")
    mesh.facets["x_min"], mesh.facets["y_min"] = mesh.facets["symmetry_x"], mesh.facets["symmetry_y"]
    write_msh(mesh, tmp_path / "box.msh")
    supports = SPRINGS if sprung else {"screws": {"on": "mounting_holes", "hold": ["x", "y", "z"]}}
    (drop, first), (structure, second) = (work(tmp_path, kinematics, supports) for work in (dropped, as_structure))
    for name in ("displacement@edge", "gauge@middle", "gauge@slant", "reaction@screws"):
        assert np.abs(first[name] - second[name]).max() < 1e-6 * np.abs(second[name]).max(), name
    metrics, expected = drop["metrics"], structure["metrics"]
    compared = [
        name for name in expected if name.startswith(("peak_strain@", "peak_strain_rate@", "peak_acceleration@"))
    ]
    compared += ["second_peak_acceleration@edge", "first_frequency", "third_frequency"]
    assert len(compared) == 9
    for name in compared:
        assert metrics[name]["value"] == pytest.approx(expected[name]["value"], rel=1e-6), name
    assert drop["model"]["model_mass"] == pytest.approx(structure["model"]["model_mass"])
    assert 1500.0 * 0.5 < metrics["response_at_first_frequency"]["value"] < 1500.0 * 2.0
    assert drop["health"]["energy_balance_error"]["ok"]


GLUED = {  # on two posts whose edges are mesh lines of the board
    "at": [7.5e-3, 4.5e-3], "rows": 1, "columns": 2, "pitch": 2e-3, "post": 1e-3, "standoff": 0.4e-3,
    "substrate": [5e-3, 3e-3, 0.5e-3], "die": [3e-3, 1e-3, 0.3e-3],
}  # fmt: skip


def test_tied_neighbour_equals_one_body_with_the_board(tmp_path):
    """On matching mesh lines, modes, mass and motion equal a single mesh of board and neighbour."""
    neighbour = Neighbour(**GLUED)
    mesh = board_mesh(size=1e-3, layers=2, patch_layers=1)
    write_msh(mesh, tmp_path / "board.msh")
    both = with_neighbours(mesh, {"pmic": neighbour})
    volume = 2 * 1e-6 * 0.4e-3 + 15e-6 * 0.5e-3 + 3e-6 * 0.3e-3
    is_neighbour = both.in_parts(lambda name: name.endswith("_pmic"))
    assert element_geometry(both.points, both.cells[is_neighbour]).volume.sum() == pytest.approx(volume)
    feet = both.facet_nodes("slave@neighbour_pmic")
    distance, below = cKDTree(mesh.points).query(both.points[feet])
    assert distance.max() < 1e-12
    glued, _ = merge_nodes(both, feet, below.astype(np.int32))
    sides = {"x_min": glued.facets["symmetry_x"], "y_min": glued.facets["symmetry_y"]}
    named_facets = {name: some for name, some in glued.facets.items() if "@" not in name}
    write_msh(replace(glued, facets=named_facets | sides), tmp_path / "box.msh")
    supports = {"screws": {"on": "mounting_holes", "hold": ["x", "y", "z"]}}
    roles = dict.fromkeys(("board", "solder", "substrate", "die"), STEEL)
    fittings, parts = {"gauges": {"below": {"at": [6e-3, 4e-3]}}}, ("board", "board_patch", *glued.part_names[2:])
    drop, first = dropped(tmp_path, "small", supports, packages={"pmic": GLUED}, materials=roles, **fittings)
    structure, second = as_structure(tmp_path, "small", supports, parts, **fittings)
    assert drop["model"]["model_mass"] == pytest.approx(structure["model"]["model_mass"])
    assert drop["metrics"]["first_frequency"]["value"] == pytest.approx(
        structure["metrics"]["first_frequency"]["value"], rel=1e-6
    )
    for name in ("displacement@edge", "gauge@below"):
        assert np.abs(first[name] - second[name]).max() < 1e-6 * np.abs(second[name]).max(), name
