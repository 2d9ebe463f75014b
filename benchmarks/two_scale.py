"""Two scales against DNS on the composition of Hu et al. 4.4: time ratio, errors of the critical joint and the die.

    PYTHONPATH=. python benchmarks/two_scale.py [--full] [--only NAME ...]  (some minutes, one core)

A quarter of a 10 x 10 array on its board, copper of 0.02 mm at its true mass, a quarter of all elements in the meso
model. Costs are processor seconds per simulated second, both modes in turns in one run, once with the kernels that the
program selects (``shipped``: boxes share a matrix and cost a half to a fifth of a joint element) and once with all
elements on the assembled matrix (``same``: no element is a box). Errors are relative L2 against the DNS of the same
package on a smaller board that a shorter pulse bends. ``--full`` uses meshes as large as those of Hu et al. and the
whole pulse.

``implicit`` is the same DNS in implicit steps (one MUMPS factor), the competitor as long as nothing yields. Its factor
is in ``setup_seconds``; ``whole_case_seconds`` are for the pulse and duration of the case.
"""

import argparse
import os
import tempfile
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from benchmarks.support import results, turns
from benchmarks.support.drop_scene import DropScene
from benchmarks.support.program_run import ProgramRun
from reflowshock.fem.output.compare import compare_histories
from reflowshock.workflow.board_drop.duration import longest_duration

CRITICAL = ("A10", "A9", "B10")
SETTINGS: dict[str, dict] = {
    "held_velocity": {"scheme": "held_velocity"},
    "local_steps_one_level": {"scheme": "local_steps", "levels": 1},
    "local_steps": {"scheme": "local_steps"},
    "three_joints_fine": {"scheme": "local_steps", "fine_joints": CRITICAL},
    "one_joint_fine": {"scheme": "local_steps", "fine_joints": CRITICAL[:1]},
}
# Upper limits of time ratio, critical_joint_stress_error, die_displacement_error.
ALL_FINE, CRITICAL_FINE = (0.25, 0.02, 0.01), (0.077, 0.03, np.inf)
BARS = {"local_steps": ALL_FINE, "one_joint_fine": CRITICAL_FINE}
REDUCED = ("package.joint_numerics.core=2", "package.joint_numerics.rings=1", "package.joint_numerics.layers=6")
FULL = (
    "package.joint_numerics.core=6",
    "package.joint_numerics.rings=3",
    "package.joint_numerics.layers=14",
    "board.numerics.coarse_size='0.5 mm'",
    "board.numerics.layers=6",
)
# The same package on a small board, whose bending reaches the joints early.
SHORT = (*REDUCED, "board.length='60 mm'", "board.width='40 mm'")
PULSE, DURATION = 1e-4, 2e-4  # [s], of errors on that board
STRETCH = 2e-6  # [s] simulated by one side per turn
ROUNDS = 7


def make_runs(scene: DropScene, names: list[str]) -> dict[str, ProgramRun]:
    """Return the runs that are measured, by name: settings of two scales, ``dns`` (one model), and ``implicit``.

    Args:
        scene: Meshes of the drop.
        names: Names of the settings.
    """
    runs = {name: ProgramRun(scene.request("two_scale", SETTINGS[name], {})) for name in names}
    runs["dns"] = ProgramRun(scene.request("dns", {}, {}))
    runs["implicit"] = ProgramRun(scene.request("dns", {}, {"dns_solver": "implicit"}))
    return runs


def cost_table(scene: DropScene, names: list[str]) -> dict:
    """Measure the cost of each setting over one model (DNS) by processor seconds in turns.

    Args:
        scene: Meshes of the drop.
        names: Names of the settings.

    Returns:
        Setting -> ``time_ratio``, ``seconds_per_simulated_us``, ``setup_seconds``, ``whole_case_seconds``, ``elements``
        by model, ``meso_share``, ``window_ns`` and ``substeps``.
    """
    runs = make_runs(scene, names)
    for run in runs.values():
        run.step(STRETCH)
    seconds = turns.measure_in_turns({name: lambda run=run: run.step(STRETCH) for name, run in runs.items()}, ROUNDS)
    print({name: f"{turns.speed_ratio(seconds, 'dns', name):.3f}" for name in runs}, flush=True)
    return {
        name: {
            "time_ratio": turns.speed_ratio(seconds, "dns", name),
            "seconds_per_simulated_us": 1e-6 * float(np.median(seconds[name])),
            "setup_seconds": run.setup,
            "whole_case_seconds": run.setup + longest_duration(scene.case) * float(np.median(seconds[name])),
            "elements": run.elements,
            "meso_share": run.elements.get("meso", 0) / sum(runs["dns"].elements.values()),
            "window_ns": 1e9 * run.plan.window,
            "substeps": run.plan.substeps,
        }
        for name, run in runs.items()
    }


def error_table(scene: DropScene, names: list[str], shock: dict, folder: Path) -> dict:
    """Return errors of each setting against one model (DNS) with the same windows, and processor seconds.

    Args:
        scene: Meshes of the drop.
        names: Names of the settings.
        shock: Changes of the shock's parameters.
        folder: Folder for the histories.

    Returns:
        Setting -> metrics of the comparison and ``seconds``; runs of the DNS have ``seconds`` only.
    """
    rows: dict[str, dict] = {}
    references: dict[float, Path] = {}
    for name in names:
        run = ProgramRun(scene.request("two_scale", SETTINGS[name], shock))
        if run.plan.window not in references:
            whole = SETTINGS[name] | {"fine_joints": "all"}
            path, seconds = write_history(ProgramRun(scene.request("dns", whole, shock)), folder / f"dns_of_{name}.npz")
            references[run.plan.window], rows[path.stem] = path, {"seconds": seconds}
        path, seconds = write_history(run, folder / f"{name}.npz")
        errors = compare_histories(path, references[run.plan.window], SETTINGS[name].get("fine_joints"))
        rows[name] = errors | {"seconds": seconds}
        print(name, rows[name], flush=True)
    return rows


def write_history(run: ProgramRun, path: Path) -> tuple[Path, float]:
    """Run to the end and write the history to an NPZ file; return its path and the processor seconds."""
    arrays, seconds = run.to_end()
    np.savez(path, **arrays)
    return path, seconds


def judge(costs: dict[str, dict], errors: dict) -> dict:
    """Compare time ratios and errors with their limits.

    Args:
        costs: Kind of kernels -> result of ``cost_table``.
        errors: Result of ``error_table``.

    Returns:
        Name of a limit -> value, limit, sense of the comparison and whether it is satisfied, as ``turns.bar`` returns
        it.
    """
    bars = {}
    for name in set(BARS) & set(errors):
        limits = BARS[name]
        for kernels, table in costs.items():
            bars[f"{name}: time ratio, {kernels} kernels"] = turns.bar(table[name]["time_ratio"], limits[0], False)
        for metric, limit in zip(("critical_joint_stress_error", "die_displacement_error"), limits[1:], strict=True):
            if np.isfinite(limit):
                bars[f"{name}: {metric}"] = turns.bar(errors[name][metric], limit, False)
    return bars


def main() -> None:
    """Measure costs and errors of the chosen settings; store and print them with their limits."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--full", action="store_true", help="meshes as large as those of H, the whole pulse; hours")
    parser.add_argument("--only", nargs="+", choices=SETTINGS, default=list(SETTINGS), help="of the settings")
    options = parser.parse_args()
    names = [name for name in SETTINGS if name in options.only]
    shock = {} if options.full else {"pulse_duration": PULSE, "duration": DURATION}
    with tempfile.TemporaryDirectory() as directory:
        folders = {name: Path(directory) / name for name in ("shipped", "same", "short", "histories")}
        for folder in folders.values():
            folder.mkdir()
        scene = DropScene.write(folders["shipped"], FULL if options.full else REDUCED)
        scenes = {"shipped": scene, "same": scene.without_boxes(folders["same"])}
        costs = {kernels: cost_table(item, names) for kernels, item in scenes.items()}
        short = scene if options.full else DropScene.write(folders["short"], SHORT)
        errors = error_table(short, names, shock, folders["histories"])
    result = {"size": "full" if options.full else "reduced", "costs": costs, "errors": errors}
    name = "two_scale_full" if options.full else "two_scale"
    results.write_and_print(name, result | {"bars": judge(costs, errors)})


if __name__ == "__main__":
    main()
