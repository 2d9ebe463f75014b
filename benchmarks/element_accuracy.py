"""Work-precision of the elements: error against cost by kind, size and solver, for a cantilever and a plate.

Run: PYTHONPATH=. .venv/bin/python benchmarks/element_accuracy.py --quick     (some seconds; coarse meshes)
     PYTHONPATH=. .venv/bin/python benchmarks/element_accuracy.py             (some minutes)
Costs are seconds of one core for one period of the first mode: explicit steps of 0.9 of the smallest critical element
step at the measured speed of a whole step; implicit steps (trapezoidal rule) of a fortieth of the period, whose error
in the period is 0.2 %, with the measured factorisation. Errors are relative to the finest hexahedra, whose plate is
compared with Mindlin's solution. The linear one-point hexahedron has the stiffness of the incompatible-modes one
(``fem/elements/one_point.py``), so that one row represents both; its saving at finite strain is in the second table.
"""

import argparse
import os
from collections.abc import Iterator
from dataclasses import dataclass
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from mpi4py import MPI

from benchmarks.support import results
from reflowshock.cases.hard.trials.boxes import KINDS, box
from reflowshock.cases.hard.trials.grids import CYCLIC
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.modal import natural_modes
from reflowshock.fem.elements.element import critical_steps
from reflowshock.fem.forces.force import Kinematics
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.mesh import MeshData, boundary_facets
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.parameters import Isotropic

NAME = "element_accuracy"
NAMES = {
    "incompatible_modes": "hexahedra",
    "tetrahedron": "tetrahedra",
    "tetrahedron_quadratic": "quadratic tetrahedra",
}
STEP_FRACTION, STEPS_PER_PERIOD = 0.9, 40
KINEMATICS: tuple[Kinematics, ...] = ("small", "finite")
SECONDS = 0.2  # duration of a speed measurement [s]
YOUNG, DENSITY = 24e9, 1900.0
STRIP = np.array([0.1, 0.004])  # [m] length and thickness of the cantilever
SIDE, THICKNESS = 0.1, 0.002  # [m] of the square plate


@dataclass(frozen=True, slots=True)
class Refinement:
    """Mesh sizes of one problem in cells along and across, with the finest hexahedra as reference."""

    problem: str
    poisson: float
    cells: tuple[tuple[int, int], ...]
    finest: tuple[int, int]


QUICK = (
    Refinement("cantilever", 0.3, ((10, 1), (20, 2)), (80, 8)),
    Refinement("plate", 0.3, ((4, 1), (8, 1)), (16, 2)),
)
FULL = (
    *(Refinement("cantilever", nu, ((10, 1), (20, 2), (40, 4), (80, 8)), (240, 24)) for nu in (0.3, 0.499)),
    Refinement("plate", 0.3, ((4, 1), (8, 1), (16, 2), (24, 2)), (48, 4)),
)


@dataclass(frozen=True, slots=True)
class Problem:
    """Problem on one mesh: name, Poisson ratio, cells along and across, kind of element."""

    name: str
    poisson: float
    cells: tuple[int, int]
    kind: str

    def body(self, kinematics: Kinematics = "small") -> Body:
        """Return the body with its supports: a quarter of the plate, or a plane-strain strip of the cantilever."""
        along, across = self.cells
        if self.name == "plate":
            side = np.linspace(0, SIDE / 2, along + 1)
            lines = [side, side, np.linspace(0, THICKNESS, across + 1)]
        else:
            length = np.linspace(0, STRIP[0], along + 1)
            lines = [length, length[:2], np.linspace(0, STRIP[1], across + 1)]
        points, cells = box(KINDS[self.kind], *lines)
        material = Isotropic(density=DENSITY, young_modulus=YOUNG, poisson_ratio=self.poisson)
        mesh = MeshData(points, cells, np.zeros(len(cells), np.int32), ("board",), {})
        item = prepare(mesh, "dns")["dns"]
        formulation = self.kind if KINDS[self.kind].nodes == 8 else "incompatible_modes"
        rank_elements = make_rank_elements(
            distribute(MPI.COMM_SELF, mesh), item.tables, {"board": material}, formulation
        )
        body = make_body(
            MPI.COMM_SELF, rank_elements, item.tables, np.ones(len(rank_elements.steps)), ForceOptions(kinematics)
        )
        body.free[self.held(body.local.points)] = False
        return body

    def held(self, points: np.ndarray) -> np.ndarray:
        if self.name == "plate":
            held = np.abs(points) < 1e-12
            held[:, 2] = False
            for axis in (0, 1):
                held[np.ix_(points[:, axis] > SIDE / 2 - 1e-9, [1 - axis, 2])] = True
            return held
        held = np.zeros(points.shape, dtype=bool)
        held[:, 1] = True
        held[points[:, 0] < 1e-12] = True
        return held


def solve_deflection(body: Body, equations: Equations) -> float:
    """Return the largest deflection of a body under a uniform pressure of 1 Pa on its top [m].

    Args:
        body: Elements, mass and supports.
        equations: Equations of the body, which give its stiffness.
    """
    local = body.local
    facets = boundary_facets(local.cells)[:, CYCLIC if local.cells.shape[1] == 8 else slice(None)]
    top = facets[np.all(local.points[facets][:, :, 2] > local.points[:, 2].max() - 1e-9, axis=1)]
    load = np.zeros_like(local.points)
    np.add.at(load, top, -np.abs(area_vectors(local.points[top])))
    right, displacement = equations.vector(load), np.zeros_like(load)
    solution = right.duplicate()
    Factorisation(equations.stiffness()).solve(right, solution)
    equations.spread(solution, displacement)
    return float(np.abs(displacement[:, 2]).max())


def solve_problem(body: Body) -> dict:
    """Return ``deflection`` [m] under 1 Pa on the top and first natural ``frequency`` [Hz] of a body."""
    equations = Equations.of(MPI.COMM_SELF, body)
    frequency = float(natural_modes(equations, 1).frequency[0])
    return {"deflection": solve_deflection(body, equations), "frequency": frequency}


def time_step_of(motion: ExplicitMotion | ImplicitMotion) -> float:
    """Return the processor seconds of a whole time step of a motion, force included; best of three batches."""

    def batch(steps: int) -> float:
        begin = process_time()
        for _ in range(steps):
            motion.advance()
            motion.update_force()
        return (process_time() - begin) / steps

    steps = max(2, int(SECONDS / 3 / batch(2)))
    return min(batch(steps) for _ in range(3))


def explicit_motion(body: Body, step: float) -> ExplicitMotion:
    """Return a body at rest that moves without loads in explicit steps of ``step`` [s]."""
    return ExplicitMotion(body, [], step, np.empty(0, np.int32), np.zeros(len(body.mass)))


def measure_speeds(cells: tuple[int, int]) -> dict:
    """Measure whole steps of a plate for every kind of element.

    Args:
        cells: Numbers of cells along and across the plate.

    Returns:
        Kind -> kinematics (small or finite strain) -> element updates per second of processor time.
    """
    updates = {}
    for kind in KINDS:
        bodies = {name: Problem("plate", 0.3, cells, kind).body(name) for name in KINEMATICS}
        updates[kind] = {
            name: len(body.local.cells) / time_step_of(explicit_motion(body, 1e-9)) for name, body in bodies.items()
        }
    return updates


def measure_costs(body: Body, period: float) -> dict:
    """Measure the cost of one period with explicit and with implicit steps.

    Args:
        body: Elements, mass and supports.
        period: Simulated time [s].

    Returns:
        ``elements``, ``unknowns``, ``critical_step`` [s], ``explicit_steps``, ``updates_per_second``, and processor
        seconds ``explicit_seconds``, ``factor_seconds`` and ``implicit_seconds``.
    """
    count = len(body.local.cells)
    critical = float(critical_steps(body.elements, body.geometry.nodal_volume).min())
    steps = int(np.ceil(period / (STEP_FRACTION * critical)))
    explicit = time_step_of(explicit_motion(body, period / steps))
    begin = process_time()
    implicit = ImplicitMotion(MPI.COMM_SELF, body, [], period / STEPS_PER_PERIOD)
    factor = process_time() - begin
    return {
        "elements": count,
        "unknowns": int(body.free.sum()),
        "critical_step": critical,
        "explicit_steps": steps,
        "updates_per_second": count / explicit,
        "explicit_seconds": steps * explicit,
        "factor_seconds": factor,
        "implicit_seconds": factor + STEPS_PER_PERIOD * time_step_of(implicit),
    }


def mindlin_frequency(poisson: float) -> float:
    """Return the first frequency of the simply supported square plate [Hz], shear factor 5/6 (Mindlin 1951).

    Args:
        poisson: Poisson's ratio; the other properties are constants of the benchmark.
    """
    wave = 2 * (np.pi / SIDE) ** 2
    shear = 5 / 6 * YOUNG / (2 * (1 + poisson)) * THICKNESS
    rigidity = YOUNG * THICKNESS**3 / (12 * (1 - poisson**2))
    mass, inertia = DENSITY * THICKNESS, DENSITY * THICKNESS**3 / 12
    linear = -(inertia * shear * wave + mass * (rigidity * wave + shear))
    squared = np.roots([mass * inertia, linear, shear * rigidity * wave**2]).min()
    return float(np.sqrt(squared) / (2 * np.pi))


def measure(refinement: Refinement) -> Iterator[dict]:
    """Yield the rows of one refinement: every kind of element at every size against the finest hexahedra.

    Args:
        refinement: Problem, Poisson's ratio and mesh sizes.

    Yields:
        ``problem``, ``poisson_ratio``, ``kind``, ``cells``, relative ``deflection_error`` and ``frequency_error``, and
        the figures of ``measure_costs``.
    """
    exact = solve_problem(
        Problem(refinement.problem, refinement.poisson, refinement.finest, "incompatible_modes").body()
    )
    for kind in NAMES:
        for cells in refinement.cells:
            body = Problem(refinement.problem, refinement.poisson, cells, kind).body()
            errors = {f"{name}_error": value / exact[name] - 1.0 for name, value in solve_problem(body).items()}
            row = {
                "problem": refinement.problem,
                "poisson_ratio": refinement.poisson,
                "kind": kind,
                "cells": list(cells),
            }
            yield row | errors | measure_costs(body, 1.0 / exact["frequency"])


def check_reference(refinements: tuple[Refinement, ...]) -> dict:
    """Return ``finest_plate_over_mindlin``: relative difference of the finest plate's first frequency to Mindlin's."""
    plate = next(refinement for refinement in refinements if refinement.problem == "plate")
    frequency = solve_problem(Problem("plate", plate.poisson, plate.finest, "incompatible_modes").body())["frequency"]
    return {"finest_plate_over_mindlin": frequency / mindlin_frequency(plate.poisson) - 1.0}


def run_all(refinements: tuple[Refinement, ...]) -> dict:
    """Run the refinements, print their rows and store the results after each row.

    Args:
        refinements: Problems with their mesh sizes; one of them is the plate.

    Returns:
        ``rows`` of ``measure``, ``speeds`` of ``measure_speeds`` and ``finest_plate_over_mindlin``.
    """
    next(measure(Refinement("plate", 0.3, ((2, 1),), (3, 1))))  # compiles the kernels of all rows
    speed = measure_speeds(refinements[-1].cells[-1])
    result = {"rows": [], "speeds": speed, **check_reference(refinements)}
    for refinement in refinements:
        for row in measure(refinement):
            result["rows"].append(row)
            results.write_figures(NAME, result)
            print(" | ".join(format_cells(row)), flush=True)
    return result


def format_cells(row: dict) -> list[str]:
    """Format a row of ``measure`` as the texts of nine table cells."""
    return [
        f"{row['problem']}, nu {row['poisson_ratio']:g}",
        f"{row['elements']} {NAMES[row['kind']]}, {row['cells'][0]} x {row['cells'][1]}",
        f"{100 * row['deflection_error']:+.2f} %",
        f"{100 * row['frequency_error']:+.2f} %",
        f"{1e9 * row['critical_step']:.0f} ns",
        f"{row['explicit_steps']}",
        f"{1e-6 * row['updates_per_second']:.1f} M/s",
        format_seconds(row["explicit_seconds"]),
        format_seconds(row["implicit_seconds"]),
    ]


def format_seconds(value: float) -> str:
    """Format a ``value`` in seconds with two digits, without exponent and with its unit."""
    return f"{value:.0f} s" if value >= 10 else f"{value:.2g} s"


def main() -> None:
    """Run the coarse or all meshes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="coarse meshes only")
    run_all(QUICK if parser.parse_args().quick else FULL)


if __name__ == "__main__":
    main()
