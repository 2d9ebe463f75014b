"""Cost of a window of jedec_bga in updates of linear boxes, and what its time is spent on.

    PYTHONPATH=. python benchmarks/window_cost.py  (five minutes, one core; writes results/window_cost.json)

The window is that of the case, with one fine joint, two models on one rank, 0.66 ms into the drop, when solder flows.
Windows and the cube of linear boxes of ``nonlinear.py forces`` take turns in one process, since other programs slow
both down. Shares are processor seconds over those of the same number of linear updates. Force terms are left out of the
meso model one by one, so that the others compete for the cache as they do in a window.
"""

import os
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from time import process_time

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from benchmarks.internal_force import linear_force
from benchmarks.support import results, turns
from benchmarks.support.cube import cube, elements_of
from benchmarks.support.drop_scene import DropScene
from benchmarks.support.program_run import ProgramRun
from reflowshock.fem.dynamics.compiled_steps import NOTHING, CompiledSteps
from reflowshock.fem.kernels.levels import PACES, forces_of, paced_forces_of
from reflowshock.workflow.board_drop.board_deflection import decided

SCALED = 'shock.numerics.mass_scaled=["copper","solder","column"]'
FINE, START, DURATION, ROUNDS = ["A10"], 0.66e-3, 2.05e-3, 100  # joint; [s], [s]
LEFT_OUT = {  # entries of ``ForceArrays``
    "boxes": ("turning_boxes", "turning_rows"),
    "general hexahedra": ("turning",),
    "solder": ("one_point",),
    "all forces": ("turning_boxes", "turning_rows", "turning", "one_point"),
}


def drop() -> ProgramRun:
    """Return the models of the case at the start of the measurement."""
    with tempfile.TemporaryDirectory() as folder:
        scene = DropScene.write(Path(folder), (SCALED,), "jedec_bga")
        scene = replace(scene, case=decided(scene.case))
        coupling = scene.case.shock.coupling.model_dump() | {"fine_joints": FINE}
        run = ProgramRun(scene.request("two_scale", coupling, {"duration": DURATION}))
    run.step(START)
    return run


def without(steps: CompiledSteps, names: tuple[str, ...]) -> CompiledSteps:
    """Return compiled steps without some entries of their force arrays."""
    kept = {name: term.arrays[name] for name, term in steps.terms[0].items() if name not in names}
    arrays = (NOTHING._replace(**kept), *[NOTHING] * (PACES - 1))
    return replace(steps, forces=paced_forces_of(tuple(map(forces_of, arrays)), np.array([1, *[0] * (PACES - 1)])))


def seconds_of_parts(run: ProgramRun) -> dict[str, float]:
    """Return the processor seconds of the parts of one window, which is taken."""
    macro, meso = run.participants["macro"], run.participants["meso"]
    seconds, last = {}, process_time()
    parts = {
        "macro: nodes": macro.begin_window,
        "meso": meso.begin_window,
        "macro: forces": macro.motion.update_force,
        "macro: interface": macro.take_force,
    }
    for name, work in parts.items():
        work()
        last, seconds[name] = (now := process_time()), now - last
    return seconds


def seconds_without(run: ProgramRun, sides: Mapping[str, CompiledSteps]) -> dict[str, float]:
    """Return the processor seconds of a window of the meso model without some forces, each from the same state."""
    motion, seconds = run.participants["meso"].motion, {}
    whole, state, now = motion._compiled, motion._state.copy(), (motion.time, motion.gravity)
    histories = [array for term in motion.body.terms for array in term.history.values()]
    kept = [array.copy() for array in histories]
    for name, side in {"nothing": whole, **sides}.items():
        motion._compiled, begin = side, process_time()
        motion.take_steps(run.plan.substeps)
        seconds[f"meso without {name}"] = process_time() - begin
        motion._state[:], (motion.time, motion.gravity) = state, now
        for array, values in zip(histories, kept, strict=True):
            array[...] = values
    motion._compiled = whole
    return seconds


def main() -> None:
    run, mesh = drop(), cube()
    linear, elements = linear_force(elements_of(mesh)), len(mesh.cells)
    updates = run.elements["macro"] + run.plan.substeps * run.elements["meso"]
    steps = run.participants["meso"].motion._compiled
    sides = {name: without(steps, names) for name, names in LEFT_OUT.items()}
    for compiled in (linear, lambda: seconds_of_parts(run), lambda: seconds_without(run, sides)):
        compiled()
    rows = []
    for _ in range(ROUNDS):
        begin = process_time()
        linear()
        box = (process_time() - begin) / elements
        parts = seconds_of_parts(run)
        rows.append({"window": sum(parts.values()), **parts, **seconds_without(run, sides)} | {"linear boxes": box})
    seconds = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    cost = {name: float(np.median(values / seconds["linear boxes"])) / updates for name, values in seconds.items()}
    del cost["linear boxes"]
    results.write_and_print(
        "window_cost",
        {
            "elements": run.elements,
            "substeps": run.plan.substeps,
            "window_milliseconds": 1e3 * float(np.median(seconds["window"])),
            "linear_boxes_updates_per_second": float(1.0 / np.median(seconds["linear boxes"])),
            "linear_updates_per_update": cost,
            "bars": {"an update of the window, in linear boxes": turns.bar(cost["window"], 4.0, False)},
        },
    )


if __name__ == "__main__":
    main()
