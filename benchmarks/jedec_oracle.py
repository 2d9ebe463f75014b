"""Bare JEDEC board at 1500 G for 0.5 ms: explicit against implicit steps, error against cost, and cost predictions.

    PYTHONPATH=. python benchmarks/jedec_oracle.py [--quick]  (one core, some minutes; writes results/jedec_oracle.json)

Three tables of histories at the centre of the board (relative L2 norms over 2 ms):
``steps``  one mesh; implicit steps of many sizes and explicit ones, against explicit steps a tenth as large.
``meshes`` kind of element x size x solver, against the finest hexahedra; error and seconds.
``factor`` operations, entries, speed and memory of the MUMPS factor for plates and cubes, with their predictions.
Times are processor seconds of set-up (assembly and factorisation) and steps, without meshing and output.
"""

import argparse
import json
import os
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from mpi4py import MPI

from benchmarks.support import results
from reflowshock.cases.hard.trials.bodies import dns_body
from reflowshock.cases.hard.trials.grids import grid, mesh_of
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.estimates.solver_cost import box_factor, forecast_solvers
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.output.compare_structures import solver_differences
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.inputs import INPUT, StructureInput
from reflowshock.fem.run.dynamics import make_history, make_participants
from reflowshock.fem.run.structure import StructureDynamics
from reflowshock.materials.library import FR4
from reflowshock.meshing.board.box import write_box
from reflowshock.meshing.board.box_plan import Box, BoxHoles, BoxLayer

NAME = "jedec_oracle"
LENGTH, WIDTH, THICKNESS, SPACING, HOLE = 132e-3, 77e-3, 1e-3, (105e-3, 71e-3), 3e-3
PULSE, DURATION, SAMPLES = 0.5e-3, 2e-3, 400
KINDS = {
    "incompatible_modes": ("hexahedron", "incompatible_modes"),
    "one_point": ("hexahedron", "one_point"),
    "tetrahedron": ("tetrahedron", "incompatible_modes"),
    "tetrahedron_quadratic": ("tetrahedron_quadratic", "incompatible_modes"),
}
SIZES = {
    "incompatible_modes": [(11, 6, 2), (22, 13, 2), (33, 19, 2), (33, 19, 4)],
    "one_point": [(22, 13, 2), (33, 19, 2)],
    "tetrahedron": [(22, 13, 2), (44, 26, 4)],
    "tetrahedron_quadratic": [(11, 6, 1), (17, 10, 1)],
}
FINEST = (50, 29, 4)
BOXES = [(40, 40, 1), (80, 80, 1), (24, 24, 4), (40, 40, 4), (80, 60, 4), (12, 12, 12), (16, 16, 16), (20, 20, 20)]


@dataclass(frozen=True, slots=True)
class Setting:
    """Settings of one run: kind of element, cells of the quarter board (x, y, z), solver, numerics."""

    kind: str
    cells: tuple[int, int, int]
    solver: str
    numerics: dict


def make_input(setting: Setting, directory: Path) -> StructureInput:
    """Mesh a quarter of the board and return the input of its run.

    Args:
        setting: Kind of element, cells, solver and numerics.
        directory: Folder of the mesh and of the results.
    """
    element, formulation = KINDS[setting.kind]
    layer = BoxLayer("board", THICKNESS, setting.cells[2])
    box = Box((LENGTH, WIDTH), setting.cells[:2], (layer,), ("x", "y"), element, BoxHoles(SPACING, HOLE))
    write_box(box, directory / "structure.msh")
    tables = {
        "mode": "structure",
        "mesh": str(directory / "structure.msh"),
        "output": str(directory),
        "solver": setting.solver,
        "structure": {
            "length": LENGTH,
            "width": WIDTH,
            "cells": setting.cells[:2],
            "symmetry": ["x", "y"],
            "element": element,
            "formulation": formulation,
            "holes": {"spacing": SPACING, "diameter": HOLE},
            "layers": {"board": {"material": "FR4", "thickness": THICKNESS, "cells": setting.cells[2]}},
        },
        "supports": {"holes": {"on": "mounting_holes", "hold": ["x", "y", "z"]}},
        "loads": {"drop": {"kind": "input_g", "service_condition": "B"}},
        "watch": {"centre": {"at": [0.0, 0.0, 0.0]}},
        "dynamics": {"duration": DURATION, "numerics": {"history_samples": SAMPLES} | setting.numerics},
    }
    request = INPUT.validate_json(json.dumps(tables))
    assert isinstance(request, StructureInput)
    return request


def run_setting(setting: Setting) -> tuple[dict, dict[str, np.ndarray]]:
    """Run a setting on one rank.

    Returns:
        Costs: ``kind``, ``cells``, ``solver``, ``elements``, ``equations``, ``step_us``, ``steps``, measured
        ``seconds`` and their parts, ``forecast_seconds``, ``energy_balance_error``, and ``factor`` (implicit) or
        ``updates_per_second`` (explicit); and the history, name -> samples.
    """
    with tempfile.TemporaryDirectory() as directory:
        request = make_input(setting, Path(directory))
        problem = StructureDynamics.read(MPI.COMM_SELF, request)
        comms = Communicators(MPI.COMM_SELF, problem.place(MPI.COMM_SELF).placement)
        models, model_steps = problem.build(comms, {})
    begin = process_time()
    participant = make_participants(comms, problem, models, model_steps).participants["structure"]
    setup = process_time() - begin
    history, plan, seconds = make_history(MPI.COMM_SELF, problem, models, model_steps), participant.plan, 0.0
    history.sample({"structure": participant})
    for _ in range(plan.windows):
        begin = process_time()
        participant.begin_window()
        participant.finish_window()
        seconds += process_time() - begin
        history.sample({"structure": participant})
    steps, elements = plan.windows * plan.substeps, len(models["structure"].body.local.cells)
    forecast = getattr(forecast_solvers(request, elements, steps, steps), setting.solver)
    costs = {
        "kind": setting.kind,
        "cells": setting.cells,
        "solver": setting.solver,
        "elements": elements,
        "equations": int(models["structure"].body.free.sum()),
        "step_us": 1e6 * plan.step,
        "steps": steps,
        "setup_seconds": setup,
        "seconds_per_step": seconds / steps,
        "seconds": setup + seconds,
        "forecast_seconds": forecast.seconds,
        "energy_balance_error": history.balance.balance_error,
    }
    motion = participant.motion
    if isinstance(motion, ImplicitMotion):
        costs["factor"] = asdict(motion.factor.cost)
        motion.factor.free()
    else:
        costs["updates_per_second"] = elements * steps / seconds
    return costs, history.arrays()


def with_errors(costs_and_history: tuple[dict, dict], reference: dict) -> dict:
    """Print the costs of a run and return them with ``displacement_error`` and ``strain_error`` at the centre.

    Args:
        costs_and_history: Result of ``run_setting``.
        reference: History of the reference run; errors are relative to it.
    """
    costs, history = costs_and_history
    errors = solver_differences(history, reference)
    named = {name: errors[f"{name}_difference@centre"] for name in ("displacement", "strain")}
    row = costs | {f"{name}_error": value for name, value in named.items()}
    print(
        f"{row['kind']:22} {row['cells']!s:12} {row['solver']:8} step {row['step_us']:7.3f} us  {row['seconds']:8.2f} s"
        f" (forecast {row['forecast_seconds']:8.2f} s)  displacement {row['displacement_error']:.2e}"
        f"  strain {row['strain_error']:.2e}",
        flush=True,
    )
    return row


def step_table(quick: bool) -> list[dict]:
    """Return rows of ``with_errors`` over solvers and step sizes on one mesh; a coarse mesh if ``quick``."""
    cells = (11, 6, 2) if quick else (33, 19, 2)
    explicit = Setting("incompatible_modes", cells, "explicit", {})
    _, reference = run_setting(Setting("incompatible_modes", cells, "explicit", {"step_fraction": 0.09}))
    settings = [explicit]
    damped = {"hht_alpha": -0.05}
    for count in (25, 50, 100, 200, 400):
        settings.append(Setting("incompatible_modes", cells, "implicit", {"implicit_step": PULSE / count}))
    for count in (50, 100):
        settings.append(Setting("incompatible_modes", cells, "implicit", {"implicit_step": PULSE / count} | damped))
    return [with_errors(run_setting(setting), reference) | {"numerics": setting.numerics} for setting in settings]


def mesh_table(quick: bool) -> list[dict]:
    """Return rows of ``with_errors`` over element kinds, sizes and solvers; the coarsest meshes only if ``quick``."""
    _, reference = run_setting(Setting("incompatible_modes", (22, 13, 2) if quick else FINEST, "implicit", {}))
    return [with_errors(run_setting(setting), reference) for setting in mesh_settings(quick)]


def mesh_settings(quick: bool) -> Iterator[Setting]:
    """Yield the settings of the runs of ``mesh_table``; those of the coarsest meshes only if ``quick``."""
    for kind, sizes in SIZES.items():
        for cells in sizes[:1] if quick else sizes:
            yield Setting(kind, cells, "explicit", {})
            yield Setting(kind, cells, "implicit", {"implicit_step": PULSE / 100})


def factor_table(quick: bool) -> list[dict]:
    """Return rows of ``factor_row`` for boxes of several sizes; the three smallest ones if ``quick``."""
    return [factor_row(cells) for cells in (BOXES[:3] if quick else BOXES)]


def factor_row(cells: tuple[int, int, int]) -> dict:
    """Measure the factorisation by MUMPS of the stiffness of a box held on one side, and its forecast.

    Args:
        cells: Numbers of elements along x, y and z.

    Returns:
        ``cells``, ``equations``, seconds of assembly, factor and one solve, memory, operations and entries of the
        factor, their rates, and ``operations_forecast_ratio`` and ``entries_forecast_ratio``, forecast over measured.
    """
    points, hexahedra = grid(*(np.arange(count + 1) * 1e-3 for count in cells))
    body, _ = dns_body(mesh_of(points, hexahedra, "board", {}), FR4)
    body.free[body.local.points[:, 0] < 1e-9] = False
    equations = Equations.of(MPI.COMM_SELF, body)
    begin = process_time()
    matrix = equations.stiffness()
    assembly, begin = process_time() - begin, process_time()
    factor = Factorisation(matrix)
    seconds = process_time() - begin
    right = equations.mass()
    solution = right.duplicate()
    begin = process_time()
    for _ in range(3):
        factor.solve(right, solution)
    solve, cost = (process_time() - begin) / 3, factor.cost
    factor.free()
    forecast = box_factor((cells[0], cells[1] + 1, cells[2] + 1))
    row = {
        "cells": cells,
        "equations": equations.total,
        "assembly_seconds": assembly,
        "factor_seconds": seconds,
        "solve_seconds": solve,
        **asdict(cost),
        "operations_per_second": cost.operations / seconds,
        "entries_per_second": cost.entries / solve,
        "memory_per_entry": cost.memory / cost.entries,
        "operations_forecast_ratio": forecast.operations / cost.operations,
        "entries_forecast_ratio": forecast.entries / cost.entries,
    }
    print(
        f"{cells!s:14} {row['equations']:7} equations  factor {seconds:6.2f} s at {row['operations_per_second']:.2e}/s"
        f"  solve {solve:.4f} s at {row['entries_per_second']:.2e}/s  forecast x{row['operations_forecast_ratio']:.2f}"
        f" x{row['entries_forecast_ratio']:.2f}",
        flush=True,
    )
    return row


def find_blas() -> list[str]:
    """Return the paths of the BLAS libraries that this process has loaded, which determine the speed of MUMPS."""
    mapped = {line.split()[-1] for line in Path("/proc/self/maps").read_text().splitlines() if "libblas" in line}
    return sorted(str(Path(path).resolve()) for path in mapped)


def main() -> None:
    """Compute all tables; store them unless the meshes are coarse."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="coarse meshes; some seconds; writes nothing")
    quick = parser.parse_args().quick
    tables = {"steps": step_table(quick), "meshes": mesh_table(quick), "factor": factor_table(quick)}
    rows = tables["steps"] + tables["meshes"]
    ratios = [row["forecast_seconds"] / row["seconds"] for row in rows]
    result = {
        "blas": find_blas(),
        **tables,
        "forecast_ratio": [min(ratios), max(ratios)],
    }
    print("forecast over measured seconds:", *(f"{value:.2f}" for value in result["forecast_ratio"]))
    if not quick:
        results.write_figures(NAME, result)


if __name__ == "__main__":
    main()
