"""Limits on two-scale coupling: results on several ranks, with the limits of three longer benchmarks in one table.

    PYTHONPATH=. python benchmarks/coupling.py  (a minute on two free cores; writes coupling.json)

A small package runs on 1 to 4 ranks in both placements; the histories must be equal. A larger one runs on two ranks
that share both models and reports the busy share and the coupling overhead. All other rows are read from the results of
``coupling_stability.py``, ``two_scale.py`` and ``two_scale_peers.py``.
"""

import os
import tempfile
from pathlib import Path
from typing import Any

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

from benchmarks.support import results, turns
from benchmarks.support.drop_scene import DropScene
from benchmarks.support.launched_run import largest_difference, launch
from benchmarks.two_scale import REDUCED

SMALL = (
    *REDUCED,
    "package.rows=4",
    "package.columns=4",
    "package.substrate.length='5 mm'",
    "package.substrate.width='5 mm'",
    "package.die.length='4 mm'",
    "package.die.width='4 mm'",
    "board.length='60 mm'",
    "board.width='40 mm'",
    "warpage.corner='0.02 mm'",
)
SHOCK = {"pulse_duration": 2e-5, "duration": 2e-5, "history_samples": 50, "field_samples": 2}
EQUAL, OVERHEAD, BUSY = 1e-8, 0.03, 0.9
SOURCES = ("coupling_stability", "two_scale", "two_scale_peers")


def compare_placements(scene: DropScene, scheme: str, folder: Path) -> dict[str, float]:
    """Compare the histories of a drop on several ranks with its history on one rank.

    Args:
        scene: Meshes of the drop.
        scheme: Coupling scheme, e.g. "held_velocity".
        folder: Folder for the runs.

    Returns:
        Words for scheme, ranks and placement -> largest relative difference of an array.
    """
    request = scene.request("two_scale", {"scheme": scheme}, SHOCK)
    reference, _ = launch(request, {"total": 1, "placement": "shared"}, folder / f"{scheme}_1")
    differences = {}
    for total in (2, 3, 4):
        for placement in ("shared", "disjoint"):
            name = f"{scheme}, {total} ranks {placement}"
            ranks = {"total": total, "placement": placement}
            history, _ = launch(request, ranks, folder / f"{scheme}_{total}_{placement}")
            differences[name] = largest_difference(history, reference)
            print(f"{name}: {differences[name]:.2e}", flush=True)
    return differences


def measure_load_balance(scene: DropScene, scheme: str, folder: Path) -> dict[str, Any]:
    """Return the load figures that the program reports for two ranks that share both models.

    Args:
        scene: Meshes of the drop.
        scheme: Coupling scheme, e.g. "held_velocity".
        folder: Folder for the run.

    Returns:
        ``busy_share`` and ``coupling_overhead`` (shares of the time), and ``window_seconds``, wall time of one exchange
        interval.
    """
    request = scene.request("two_scale", {"scheme": scheme}, SHOCK)
    _, result = launch(request, {"total": 2, "placement": "shared"}, folder / f"{scheme}_balance")
    return {
        name: result["coupling"]["placement"][name] for name in ("busy_share", "coupling_overhead", "window_seconds")
    }


def judge_ranks(figures: dict[str, dict]) -> dict[str, dict]:
    """Compare the figures of runs on ranks with their limits.

    Args:
        figures: ``equality``, name -> difference, and ``balance``, scheme -> load figures, as ``main`` measures them.

    Returns:
        Name of a limit -> value, limit, sense of the comparison and whether it is satisfied, as ``turns.bar`` returns
        it.
    """
    bars = {f"equal histories: {name}": turns.bar(value, EQUAL, False) for name, value in figures["equality"].items()}
    for scheme, values in figures["balance"].items():
        bars[f"coupling overhead, {scheme}, 2 ranks shared"] = turns.bar(values["coupling_overhead"], OVERHEAD, False)
        bars[f"busy share, {scheme}, 2 ranks shared"] = turns.bar(values["busy_share"], BUSY)
    return bars


def format_table(bars: dict[str, dict[str, dict]]) -> str:
    """Format limits as a Markdown table with one row each.

    Args:
        bars: Name of a benchmark -> name of a limit -> value, limit and result of ``turns.bar``.
    """
    rows = [
        f"| {source} | {name} | {item['holds_if']} {item['limit']:.3g} | {item['value']:.3g} |"
        f" {'passed' if item['ok'] else 'FAILED'} |"
        for source, items in bars.items()
        for name, item in items.items()
    ]
    return "\n".join(["| benchmark | quantity | limit | measured | |", "|---|---|---|---|---|", *rows])


def read_other_bars() -> dict[str, dict[str, dict]]:
    """Return the stored limits of the other benchmarks; those without results are named on the terminal.

    Returns:
        Name of a benchmark -> name of a limit -> value, limit and result of ``turns.bar``.
    """
    bars = {}
    for name in SOURCES:
        if figures := results.read_figures(name):
            bars[name] = figures["bars"]
        else:
            print(f"no results of {name}: run benchmarks/{name}.py")
    return bars


def main() -> None:
    """Run drops with every scheme on several ranks; store and print figures and limits."""
    schemes = ("held_velocity", "local_steps", "gravouil_combescure")
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        for name in ("small", "reduced"):
            (folder / name).mkdir()
        small, reduced = DropScene.write(folder / "small", SMALL), DropScene.write(folder / "reduced", REDUCED)
        figures = {
            "equality": {
                k: value for scheme in schemes for k, value in compare_placements(small, scheme, folder).items()
            },
            "balance": {scheme: measure_load_balance(reduced, scheme, folder) for scheme in schemes[:2]},
        }
    bars = judge_ranks(figures)
    results.write_and_print("coupling", figures | {"cores": len(os.sched_getaffinity(0)), "bars": bars})
    print(format_table({"coupling": bars} | read_other_bars()))


if __name__ == "__main__":
    main()
