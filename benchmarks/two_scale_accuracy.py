"""Accuracy and cost of two scales over scheme, levels, buffer, direction and window.

    PYTHONPATH=. python benchmarks/two_scale_accuracy.py [--quick]  (some minutes, one core)

A quarter of 16 joints on a small board, copper of 0.02 mm at its true mass, under a half sine that is short enough to
bend it. Each setting runs with decreasing windows and the fine steps in proportion. Errors are relative L2 against a
DNS with the same small step and should fall with the square of the window. Times are processor seconds.
"""

import argparse
import os
import tempfile
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from benchmarks.coupling import SMALL
from benchmarks.support import results
from benchmarks.support.drop_scene import DropScene
from benchmarks.support.program_run import ProgramRun
from reflowshock.fem.output.compare import compare_histories

SETTINGS: dict[str, dict] = {
    "held velocity, 2 layers": {"scheme": "held_velocity", "buffer_layers": 2},
    "held velocity, 3 layers": {"scheme": "held_velocity", "buffer_layers": 3},
    "held velocity, one way": {"scheme": "held_velocity", "direction": "one_way"},
    "Gravouil-Combescure": {"scheme": "gravouil_combescure"},
    "local steps, 1 level": {"scheme": "local_steps", "levels": 1},
    "local steps, 2 levels": {"scheme": "local_steps", "levels": 2},
    "local steps, one joint fine": {"scheme": "local_steps", "fine_joints": ["A4"]},
}
FRACTIONS = (0.9, 0.45, 0.225)  # of the critical step of an element
SHOCK = {"pulse_duration": 2e-5, "duration": 6e-5, "history_samples": 100}
ERRORS = ("critical_joint_stress_error", "die_displacement_error", "board_strain_error")


def run_setting(name: str, scene: DropScene, fraction: float, folder: Path) -> dict:
    """Run a setting of two scales, or one model, and compare it with the one model of the same step fraction.

    Args:
        name: Name of a setting, or "dns" for one model, which must run first.
        scene: Meshes of the drop.
        fraction: Time step over the critical step.
        folder: Folder for the histories.

    Returns:
        ``setting``, ``fraction``, ``window_ns``, substeps ``m``, meso share ``f``, ``seconds``, ``balance_error``, and
        the relative errors named in ``ERRORS``.
    """
    mode, coupling = ("dns", {}) if name == "dns" else ("two_scale", SETTINGS[name])
    run = ProgramRun(scene.request(mode, coupling, SHOCK | {"step_fraction": fraction}))
    arrays, seconds = run.to_end()
    path, reference = (folder / f"{key}_{fraction}.npz" for key in (name, "dns"))
    np.savez(path, **arrays)
    errors = compare_histories(path, reference, coupling.get("fine_joints"))
    return {
        "setting": name,
        "fraction": fraction,
        "window_ns": 1e9 * run.plan.window,
        "m": run.plan.substeps,
        "f": run.elements.get("meso", 0) / sum(run.elements.values()),
        "seconds": seconds,
        "balance_error": run.history.balance.balance_error,
        **{metric: errors[metric] for metric in ERRORS},
    }


def format_row(item: dict) -> str:
    """Format a row of ``run_setting`` with its ``time_ratio`` as a line of a Markdown table."""
    errors = " | ".join(f"{100.0 * item[metric]:.3f}" for metric in ERRORS)
    return (
        f"| {item['setting']} | {item['window_ns']:.1f} | {item['m']} | {item['f']:.2f} | {item['time_ratio']:.3f} |"
        f" {errors} |"
    )


def fit_orders(rows: list[dict]) -> dict[str, dict[str, float]]:
    """Return setting -> metric -> order of the error in the window, fitted to the rows of ``run_setting``."""
    fitted_orders: dict[str, dict[str, float]] = {}
    for name in dict.fromkeys(item["setting"] for item in rows):
        mine = [item for item in rows if item["setting"] == name]
        windows = np.log([item["window_ns"] for item in mine])
        fits = {metric: np.polyfit(windows, np.log([item[metric] for item in mine]), 1)[0] for metric in ERRORS}
        fitted_orders[name] = {metric: float(value) for metric, value in fits.items()}
    return fitted_orders


def main() -> None:
    """Run all settings at several step fractions; print and store rows and orders."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two windows only")
    fractions = FRACTIONS[:2] if parser.parse_args().quick else FRACTIONS
    rows = []
    print("| setting | window ns | m | f | time / DNS | " + " | ".join(f"{metric} %" for metric in ERRORS) + " |")
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        scene = DropScene.write(folder, SMALL)
        for fraction in fractions:
            dns = run_setting("dns", scene, fraction, folder)
            for name in SETTINGS:
                item = run_setting(name, scene, fraction, folder)
                item["time_ratio"] = item["seconds"] / dns["seconds"]
                rows.append(item)
                print(format_row(item), flush=True)
    results.write_and_print("two_scale_accuracy", {"rows": rows, "orders": fit_orders(rows)})


if __name__ == "__main__":
    main()
