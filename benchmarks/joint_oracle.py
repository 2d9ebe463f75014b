"""One joint between patches of board and substrate: the program's elements and ties against an independent oracle.

    PYTHONPATH=. python benchmarks/joint_oracle.py [TABLE ...]  (one core; writes results/joint_oracle.json)

``tests/support/joint_patch.py`` describes the scene and ``tests/support/joint_oracle.py`` the oracle: quadratic
hexahedra in DOLFINx forms, Newton's method, HHT steps. Tables, each with the processor seconds of its rows:
``elastic``  at rest: the oracle on three meshes, the program with imprinted pads and tied to boxes (2 minutes)
``yielding`` at rest: the oracle on two meshes (5 minutes)
``blow``     a pulse of 20 us, elastic: the oracle in 80 and 160 steps, the program in explicit ones (2 minutes)
``slow``     a pulse of 0.2 ms, yielding, up to 0.12 ms, after all peaks: the oracle on two meshes, the program on three
             (40 minutes)
Each row has its differences to the first row of its table: of the measure at rest, of its largest absolute value in
motion. Plastic measures are averages over the solder within 25 um of either pad unless stated otherwise.
"""

import os
from collections.abc import Callable
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

from benchmarks.support.tables import write_tables
from tests.support.joint_oracle import Patch, equilibrium, haversine, steps_in_time
from tests.support.joint_patch import QUADRATIC, TRILINEAR, UM, JointPatch, mesh_patch
from tests.support.joint_program import Course, ProgramPatch, box_mesh, matching_mesh

NAME = "joint_oracle"
PATCH = JointPatch()
BLOW, SLOW = 20e-6, 0.2e-3
SHARE = 0.6  # computed share of the slow motion
BOXES = (500 * UM, 250 * UM, 125 * UM)
SCALED = ("copper", "solder")  # at 0.2 ms their added inertia is 0.4 % of the axial force
PRINTED = ("axial@foot", "shear@foot", "moment@foot", "moment@head", "von_mises@foot:25um", "plastic_work@foot:25um")
Measures = dict[str, float]


def make_oracle(mesh: str, yields: bool) -> Patch:
    """Return the independent model of the joint between two patches.

    Args:
        mesh: Name of one of its meshes.
        yields: Whether the solder is plastic.
    """
    return Patch(PATCH, mesh_patch(PATCH, QUADRATIC[mesh], 2), yields)


def make_program_patch(mesh: str | float, course: Course) -> ProgramPatch:
    """Return the program's model of the joint between two patches.

    Args:
        mesh: Name of a mesh with imprinted pads, or size of the boxes to which the joint is tied [m].
        course: Course of the motion in time, and whether the solder yields.
    """
    imprinted = isinstance(mesh, str)
    data = matching_mesh(PATCH, TRILINEAR[mesh]) if imprinted else box_mesh(PATCH, TRILINEAR["middle"], mesh, (8, 4))
    return ProgramPatch(PATCH, data, course)


def find_peaks(history: list[Measures]) -> Measures:
    """Return each measure of a history, one dict of measures for each sample, at its largest absolute value."""
    return {name: max((row[name] for row in history), key=abs) for name in history[0] if name != "time"}


def elastic_rows() -> dict[str, Callable[[], Measures]]:
    """Return the rows of the elastic patch at rest: name -> function that computes its measures."""
    rows = {
        f"oracle, {mesh}": lambda mesh=mesh: equilibrium(make_oracle(mesh, False))[-1] for mesh in reversed(QUADRATIC)
    }
    meshes = {f"program, imprinted, {mesh}": mesh for mesh in TRILINEAR}
    meshes |= {f"program, boxes of {size / UM:g} um": size for size in BOXES}
    return rows | {
        name: lambda mesh=mesh: make_program_patch(mesh, Course()).at_rest() for name, mesh in meshes.items()
    }


def yielding_rows() -> dict[str, Callable[[], Measures]]:
    """Return the rows of the yielding patch at rest: name -> function that computes its measures."""
    settings = [("middle", 5), ("coarse", 10), ("coarse", 5)]
    return {
        f"oracle, {mesh}, {steps} steps": lambda mesh=mesh, steps=steps: equilibrium(make_oracle(mesh, True), steps)[-1]
        for mesh, steps in settings
    }


def blow_rows() -> dict[str, Callable[[], Measures]]:
    """Return the rows of the elastic patch under a pulse of 20 us: name -> function that computes the peaks."""
    return {
        f"oracle, {mesh}, {steps} steps": lambda mesh=mesh, steps=steps: find_peaks(
            steps_in_time(make_oracle(mesh, False), haversine(BLOW), BLOW / steps, steps)
        )
        for mesh, steps in [("middle", 160), ("middle", 80), ("coarse", 160)]
    } | {
        f"program, imprinted, {mesh}": lambda mesh=mesh: find_peaks(make_program_patch(mesh, Course(BLOW)).run(100))
        for mesh in ("coarse", "middle")
    }


def slow_rows() -> dict[str, Callable[[], Measures]]:
    """Return the rows of the yielding patch under a pulse of 0.2 ms: name -> function that computes the peaks."""
    return {
        f"oracle, {mesh}, {steps} steps": lambda mesh=mesh, steps=steps: find_peaks(
            steps_in_time(make_oracle(mesh, True), haversine(SLOW), SLOW / steps, round(SHARE * steps))
        )
        for mesh, steps in (("middle", 40), ("coarse", 40), ("coarse", 80))
    } | {
        f"program, imprinted, {mesh}": lambda mesh=mesh: find_peaks(
            make_program_patch(mesh, Course(SLOW, True, SCALED)).run(100, SHARE)
        )
        for mesh in TRILINEAR
    }


TABLES = {"elastic": elastic_rows, "yielding": yielding_rows, "blow": blow_rows, "slow": slow_rows}


def measure_rows(rows: dict[str, Callable[[], Measures]]) -> dict[str, dict]:
    """Compute and print the rows of a table.

    Args:
        rows: Name of a row -> function that returns its measures; the first one is the reference.

    Returns:
        Name -> ``seconds`` (processor time), ``values`` (the measures) and relative ``differences`` to the first row.
    """
    table: dict[str, dict] = {}
    for name, compute in rows.items():
        begin = process_time()
        values = compute()
        seconds = process_time() - begin
        first = next(iter(table.values()))["values"] if table else values
        differences = {key: value / first[key] - 1.0 for key, value in values.items() if first.get(key)}
        table[name] = {"seconds": seconds, "values": values, "differences": differences}
        printed = "  ".join(
            f"{key} {values[key]:.4g} ({differences[key]:+.1%})" for key in PRINTED if differences.get(key) is not None
        )
        print(f"{name:32} {seconds:6.1f} s  {printed}", flush=True)
    return table


if __name__ == "__main__":
    computed = {name: lambda rows=rows: measure_rows(rows()) for name, rows in TABLES.items()}
    write_tables(__doc__.splitlines()[0], computed, NAME)
