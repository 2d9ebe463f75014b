"""Small cases of every kind, run on two systems or by two checkouts, whose results must agree.

    python -m tests.same_results run FOLDER [--checkout FOLDER]
    python -m tests.same_results compare FOLDER FOLDER [--exactly]

Two systems: metrics agree to a relative difference of 1e-6. Metrics without a unit may also differ by 1e-6, since
errors and residuals are near zero and relative to one. Two checkouts on one system: every metric and every array of
histories, shapes and meshes is equal to the bit. Runs on two ranks agree to 1e-6, since the shares of the mesh follow
speeds measured at the start; their energy balance, which is rounding, is not compared. Texts and counts are equal.
Times, speeds, shares of time and the storage of factors are not compared.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
TOLERANCE = 1e-6
MEASURED_UNITS = {"1/s", "MB", "B"}
MEASURED = ("seconds", "time_ratio", "core_ratio", "per_second", "factor_", "busy_share", "coupling_overhead")
ONE_RANK = ("shock.ranks.total=1",)  # on two ranks the shares follow measured speeds
HEATED = (
    "warpage.corner=0 mm", "thermal.melting=100 degC", "thermal.peak=200 degC", "thermal.solidification=200 degC",
    "thermal.steps=1", "thermal.effects.solder_force=on", "solder.numerics.time_step_limit=100",
)  # fmt: skip
# With a weak pulse the cooled solder would hardly flow and amplify rounding: its plastic work starts with the drop.
COOLED = (
    "thermal.effects.residual_stress=on", "thermal.effects.flexible=off", "materials.solder=SAC405",
    "shock.numerics.plasticity=on", "shock.peak_acceleration=15000 G",
)  # fmt: skip
QUICK = ("scale=quick",)
COARSE_DROP = ("drop.particles_per_edge=7",)
ISPG = ("solder.numerics.scheme=ispg", "solder.parameters=paper", "solder.effects.inertia=on")
COARSE_BOARD = (
    "scale=linear", "structure.cells=[12,8]", "dynamics.duration=0.5 ms", "dynamics.modes=3",
    "dynamics.numerics.field_samples=4",
    "dynamics.numerics.implicit_step=2.5 us",
)  # fmt: skip
SHORT_SHOCK = (
    "shock.duration=0.05 ms", "shock.numerics.dns_duration=0.05 ms", 'shock.picture_times=["0.04 ms"]',
)  # fmt: skip
CASES = {
    "drop": ("tests/pipeline/small.toml", ONE_RANK),
    "heated": ("tests/pipeline/small.toml", HEATED + ONE_RANK),
    "cooled": ("tests/pipeline/small.toml", COOLED + ONE_RANK),
    "structure": ("tests/pipeline/structure.toml", ()),
    "jedec_board": ("cases/jedec_board/case.toml", COARSE_BOARD),
    "bar_wave": ("cases/bar_wave/case.toml", ("structure.layers.lower.cells=150", "structure.layers.upper.cells=90")),
    "cantilever": ("cases/cantilever/case.toml", ("structure.layers.strip.thickness=1 mm", "dynamics.duration=7 ms")),
    "sessile_drop": ("cases/sessile_drop/case.toml", COARSE_DROP),
    "bga_ball": ("cases/bga_ball/case.toml", COARSE_DROP),
    "laplace_drop": ("cases/laplace_drop/case.toml", COARSE_DROP),
    "solder_joint": ("cases/solder_joint/case.toml", ("joint.spacing=0.06 mm",)),
}
EVERY_CASE = CASES | {
    "drop_2_ranks": ("tests/pipeline/small.toml", ("shock.ranks.total=2",)),
    "structure_2_ranks": ("tests/pipeline/structure.toml", ("dynamics.ranks=2",)),
    "coalescence": ("cases/coalescence/case.toml", ("drops.spacing=0.14 mm",)),
    "oscillating_drop": ("cases/oscillating_drop/case.toml", ()),
    "two_scale_bar": ("cases/two_scale_bar/case.toml", ()),
    "bga_drop": ("cases/bga_drop/case.toml", QUICK),
    "hu_bga_reflow": ("cases/hu_bga_reflow/case.toml", QUICK),
    "hu_bga_drop": ("cases/hu_bga_drop/case.toml", QUICK + SHORT_SHOCK),
    "jedec_bga": ("cases/jedec_bga/case.toml", QUICK),
    "measured_strip": ("cases/measured_strip/case.toml", ()),
    "sessile_drop_ispg": ("cases/sessile_drop/case.toml", COARSE_DROP + ISPG),
    **{flow: (f"cases/{flow}/case.toml", ()) for flow in ("poiseuille", "taylor_green")},
    **{
        flow: (f"cases/{flow}/case.toml", QUICK)
        for flow in ("dam_break", "drop_impact", "frozen_drop", "printing", "static_caps", "young_laplace")
    },
}


def run_cases(folder: Path, checkout: Path, names: list[str]) -> int:
    """Run the cases by the program of a checkout, each in its own folder; return the number without a summary."""
    missing = 0
    for name in names:
        path, settings = EVERY_CASE[name]
        line = [sys.executable, "-m", "workflow", "run", str(checkout / path), "--out", str(folder.resolve() / name)]
        line += [item for setting in settings for item in ("--set", setting)]
        # Numba orders reassociated sums by sets of names: without a fixed seed each compilation rounds in its own way.
        begin, environment = time.perf_counter(), os.environ | {"PYTHONPATH": str(checkout), "PYTHONHASHSEED": "0"}
        result = subprocess.run(line, capture_output=True, text=True, cwd=checkout, env=environment, check=False)
        complete = (folder / name / "summary.json").exists()
        print(f"{name:18}{time.perf_counter() - begin:6.0f} s  {'ran' if complete else 'FAILED'}", flush=True)
        if not complete:
            missing += 1
            print(result.stdout + result.stderr)
    return missing


def differences(first: dict, second: dict) -> Iterator[tuple[str, object, object, float]]:
    """Yield name, both values and difference over tolerance of each metric of two summaries."""
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
    """Print the differences between the results of two systems; return the number of metrics beyond tolerance."""
    count = 0
    for name in names:
        ours, theirs = (json.loads((folder / name / "summary.json").read_text()) for folder in (first, second))
        metrics = list(differences(ours, theirs))
        worst = max(metrics, key=lambda item: item[3])
        print(f"{name:18}{len(metrics):4} metrics, largest difference {worst[0]}: {worst[3] * TOLERANCE:.1e}")
        for metric, value, other, excess in metrics:
            if not excess <= 1.0:  # also true for nan
                count += 1
                print(f"    {metric}: {value} and {other}, {excess * TOLERANCE:.1e} apart")
    return count


def arrays(folder: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of a run folder (histories, shapes, meshes as text) by file and name."""
    for path in sorted(folder.rglob("*")):
        file = str(path.relative_to(folder))
        if ".store" in path.parts or not path.is_file():
            continue
        if path.suffix == ".npz":
            with np.load(path) as data:
                yield from ((f"{file}:{name}", data[name]) for name in data.files)
        elif path.suffix == ".h5":
            with h5py.File(path) as data:
                names: list[str] = []
                data.visit(names.append)
                sets = [name for name in names if isinstance(data[name], h5py.Dataset)]
                yield from ((f"{file}:{name}", np.asarray(data[name])) for name in sets)
        elif path.suffix == ".msh":
            yield file, np.frombuffer(path.read_bytes(), np.uint8)


def compare_exactly(first: Path, second: Path, names: list[str]) -> int:
    """Print the arrays and metrics of two checkouts that differ; return their number."""
    count = 0
    for name in names:
        tolerance = TOLERANCE if name.endswith("_ranks") else 0.0
        ours, theirs = (dict(arrays(folder / name)) for folder in (first, second))
        keys = {key for key in ours.keys() | theirs.keys() if not (tolerance and key.endswith(":balance"))}
        apart = {key: distance(ours.get(key), theirs.get(key)) for key in keys}
        summaries = (json.loads((folder / name / "summary.json").read_text()) for folder in (first, second))
        apart |= {metric: excess * TOLERANCE for metric, _, _, excess in differences(*summaries)}
        different = {key: value for key, value in apart.items() if not value <= tolerance}
        print(
            f"{name:18}{len(apart):4} arrays and metrics, {len(different)} differ, at most by {max(apart.values()):.1e}"
        )
        for key in sorted(different):
            print(f"    {key}: {different[key]:.1e} apart")
        count += len(different)
    return count


def distance(first: np.ndarray | None, second: np.ndarray | None) -> float:
    """Return the largest difference of two arrays over the largest value; infinite if they cannot be compared."""
    if first is None or second is None or first.shape != second.shape or first.dtype != second.dtype:
        return float("inf")
    if np.array_equal(first, second, equal_nan=first.dtype.kind == "f"):
        return 0.0
    if first.dtype.kind != "f":
        return float("inf")
    return float(np.nanmax(np.abs(first - second)) / np.nanmax(np.abs(first)))


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("run", "compare"))
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--only", nargs="+", choices=EVERY_CASE, help="names of cases (default: all short ones)")
    parser.add_argument("--every", action="store_true", help="include long cases and cases on two ranks")
    parser.add_argument("--checkout", type=Path, default=ROOT, help="checkout whose program runs the cases")
    parser.add_argument("--exactly", action="store_true", help="require equality to the bit, arrays included")
    arguments = parser.parse_args()
    names = arguments.only or list(EVERY_CASE if arguments.every else CASES)
    if arguments.command == "run":
        return 1 if run_cases(arguments.folders[0], arguments.checkout.resolve(), names) else 0
    comparison = compare_exactly if arguments.exactly else compare
    return 1 if comparison(*arguments.folders, names) else 0


if __name__ == "__main__":
    sys.exit(main())
