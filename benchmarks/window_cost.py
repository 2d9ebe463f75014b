"""Cost of a window of jedec_bga in updates of linear boxes, and its parts.

    PYTHONPATH=. python benchmarks/window_cost.py  (five minutes, one core; writes results/window_cost.json)

A window is the time interval between two exchanges of the macro and the meso model. Here it is that of the case, with
one fine joint, two models on one rank, 0.66 ms into the drop, when solder flows. Windows and the cube of linear boxes
of ``nonlinear.py forces`` take turns in one process, since other programs slow both down. Shares are processor seconds
over those of the same number of linear updates. Force terms are left out of the meso model one by one, so that the
others compete for the cache as they do in a window.
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
    """Build the coupled models of the case, run them until the measurement starts (0.66 ms), and return the run."""
    with tempfile.TemporaryDirectory() as folder:
        scene = DropScene.write(Path(folder), (SCALED,), "jedec_bga")
        scene = replace(scene, case=decided(scene.case))
        coupling = scene.case.shock.coupling.model_dump() | {"fine_joints": FINE}
        run = ProgramRun(scene.request("two_scale", coupling, {"duration": DURATION}))
    run.step(START)
    return run


def without(steps: CompiledSteps, names: tuple[str, ...]) -> CompiledSteps:
    """Return compiled steps without some force terms; all other terms act in each step.

    Args:
        steps: Compiled steps of a model whose terms all act in each step; not changed.
        names: Terms to leave out, entries of ``ForceArrays`` such as ``turning_boxes``; absent ones are ignored.
    """
    kept = {name: term.arrays[name] for name, term in steps.terms[0].items() if name not in names}
    arrays = (NOTHING._replace(**kept), *[NOTHING] * (PACES - 1))
    return replace(steps, forces=paced_forces_of(tuple(map(forces_of, arrays)), np.array([1, *[0] * (PACES - 1)])))


def seconds_of_parts(run: ProgramRun) -> dict[str, float]:
    """Take one window (interval between two exchanges of the models), and return the processor time of each part [s].

    Args:
        run: Coupled run, advanced by a window.

    Returns:
        Seconds by part: ``macro: nodes``, ``meso``, ``macro: forces`` and ``macro: interface``.
    """
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
    """Return the processor time of the steps of the meso model in one window, without some forces [s].

    Args:
        run: Coupled run; the state of its meso model is restored after each measurement.
        sides: Compiled steps by the name of the forces that they lack, each timed from the same state.

    Returns:
        Seconds by text, ``meso without NAME``; also ``meso without nothing``, the complete steps.
    """
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
    """Measure 100 windows in turns with linear boxes, and write the medians to ``results/window_cost.json``."""
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
