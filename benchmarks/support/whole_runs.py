"""Wall times of whole cases, read from their runs in ``runs``."""

import json
from pathlib import Path

from benchmarks.support import turns

RUNS = Path(__file__).parents[2] / "runs"
FIGURES = {  # figure -> folder of its run, limit [s], least number of board elements
    "default case, answer complete [s]": ("jedec_bga", 180.0, 1),
    "hu_bga_drop, full size, finite + J2, two scales [s]": ("hu_bga_drop-physical", 1800.0, 100_000),
}
COMMANDS = {
    "jedec_bga": "make demo",
    "hu_bga_drop-physical": "reflowshock run cases/hu_bga_drop/case.toml --set scale=physical",
}


def read_run_figures(folder: Path = RUNS) -> tuple[dict[str, dict], dict[str, str]]:
    """Read the wall times of whole cases from their runs.

    Args:
        folder: Folder that contains the run folders.

    Returns:
        Name -> result of ``turns.bar`` for existing runs, and name -> command for missing ones.
    """
    bars, missing = {}, {}
    for name, (case, limit, elements) in FIGURES.items():
        path = folder / case / "summary.json"
        summary = json.loads(path.read_text()) if path.exists() else {"metrics": {}}
        metrics = summary["metrics"]
        yields = "layer_plastic_work" in metrics
        if yields and metrics["elements_board"]["value"] >= elements:
            bars[name] = turns.bar(sum(summary["timings"]["wall"].values()), limit, False)
        else:
            missing[name] = COMMANDS[case]
    return bars, missing
