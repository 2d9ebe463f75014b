"""Small cases of every kind, run on two systems, whose results must agree: `run FOLDER`, then `compare FOLDER FOLDER`.

Numbers agree to a relative difference of 1e-6; those without a unit also if they differ by less than 1e-6 (errors and
residuals are near zero, and what they are relative to is one). Words and counts are the same. Only what the machine
decides is left out: times, speeds, shares of time, and how its library of solvers stores a factor.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOLERANCE = 1e-6
MEASURED_UNITS = {"1/s", "MB", "B"}
MEASURED = ("seconds", "time_ratio", "per_second", "factor_", "busy_share", "coupling_overhead")
HEATED = (
    "warpage.corner=0 mm", "thermal.melting=100 degC", "thermal.peak=200 degC", "thermal.solidification=200 degC",
    "thermal.steps=1", "thermal.effects.solder_force=on", "solder.numerics.time_step_limit=100",
)  # fmt: skip
# A drop in which solder that has cooled hardly flows would amplify rounding: its plastic work starts with the drop.
COOLED = (
    "thermal.effects.residual_stress=on", "thermal.effects.flexible=off", "materials.solder=SAC405",
    "shock.peak_acceleration=15000 G",
)  # fmt: skip
COARSE_DROP = ("drop.particles_per_edge=7",)
COARSE_BOARD = (
    "structure.cells=[12,8]", "dynamics.duration=0.5 ms", "dynamics.modes=3", "dynamics.numerics.field_samples=4",
    "dynamics.numerics.implicit_step=2.5 us",
)  # fmt: skip
CASES = {
    "drop": ("tests/pipeline/small.toml", ()),
    "heated": ("tests/pipeline/small.toml", HEATED),
    "cooled": ("tests/pipeline/small.toml", COOLED),
    "structure": ("tests/pipeline/structure.toml", ()),
    "jedec_board": ("cases/jedec_board/case.toml", COARSE_BOARD),
    "bar_wave": ("cases/bar_wave/case.toml", ("structure.layers.lower.cells=150", "structure.layers.upper.cells=90")),
    "cantilever": ("cases/cantilever/case.toml", ("structure.layers.strip.thickness=1 mm", "dynamics.duration=7 ms")),
    "sessile_drop": ("cases/sessile_drop/case.toml", COARSE_DROP),
    "bga_ball": ("cases/bga_ball/case.toml", COARSE_DROP),
    "laplace_drop": ("cases/laplace_drop/case.toml", COARSE_DROP),
    "solder_joint": ("cases/solder_joint/case.toml", ("joint.spacing=0.06 mm",)),
}


def run_cases(folder: Path, names: list[str]) -> int:
    """Run the cases, each in a folder of its own; return how many have no summary."""
    missing = 0
    for name in names:
        path, settings = CASES[name]
        line = [sys.executable, "-m", "workflow", "run", str(ROOT / path), "--out", str(folder / name)]
        line += [item for setting in settings for item in ("--set", setting)]
        begin = time.perf_counter()
        result = subprocess.run(line, capture_output=True, text=True, cwd=ROOT, check=False)
        complete = (folder / name / "summary.json").exists()
        print(f"{name:16}{time.perf_counter() - begin:6.0f} s  {'ran' if complete else 'FAILED'}", flush=True)
        if not complete:
            missing += 1
            print(result.stdout + result.stderr)
    return missing


def differences(first: dict, second: dict) -> Iterator[tuple[str, object, object, float]]:
    """Yield each metric of two summaries with both values and their difference in units of what is allowed."""
    first, second = first["metrics"], second["metrics"]
    for name in sorted(first.keys() | second.keys()):
        unit = (first.get(name) or second[name])["unit"]
        if unit in MEASURED_UNITS or any(word in name for word in MEASURED):
            continue
        ours, theirs = (metrics.get(name, {}).get("value") for metrics in (first, second))
        if isinstance(ours, float | int) and isinstance(theirs, float | int):
            scale = max(abs(ours), abs(theirs), 0.0 if unit else 1.0)
            excess = abs(ours - theirs) / (TOLERANCE * scale) if scale else 0.0
        else:
            excess = 0.0 if ours == theirs else float("inf")
        yield name, ours, theirs, excess


def compare(first: Path, second: Path, names: list[str]) -> int:
    """Print how far the results of two systems are apart; return how many metrics differ by more than allowed."""
    count = 0
    for name in names:
        ours, theirs = (json.loads((folder / name / "summary.json").read_text()) for folder in (first, second))
        found = list(differences(ours, theirs))
        worst = max(found, key=lambda item: item[3])
        print(f"{name:16}{len(found):4} metrics, most apart {worst[0]}: {worst[3] * TOLERANCE:.1e}")
        for metric, value, other, excess in found:
            if not excess <= 1.0:  # nan is no agreement
                count += 1
                print(f"    {metric}: {value} and {other}, {excess * TOLERANCE:.1e} apart")
    return count


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("run", "compare"))
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    arguments = parser.parse_args()
    action = run_cases if arguments.command == "run" else compare
    return 1 if action(*arguments.folders, arguments.only) else 0


if __name__ == "__main__":
    sys.exit(main())
