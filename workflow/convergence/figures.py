"""Figures whose errors companions estimate, from the results of one model of a shock."""

from pathlib import Path

from reflowshock.fem.output.ranking import joint_figures
from reflowshock.workflow.process.products import read_json

BOARD = ("peak_board_strain", "peak_board_displacement")
AT_POINTS = ("peak_acceleration@", "peak_displacement@", "peak_strain@", "peak_strain_rate@")
OF_STRUCTURE = (*AT_POINTS, "displacement_range@", "peak_von_mises@", "peak_reaction@")
FREQUENCY = "_frequency"
NOT_CONVERGENT = "peak_element_stress"  # grows with refinement, as do its values of layers after an @


def drop_figures(results: Path, main: Path) -> dict[str, float]:
    """Return the figures of a drop by name of the metric; those of a joint belong to the critical joint of the run.

    Args:
        results: Folder of the results of one model.
        main: Folder of the results of the first model of the run.
    """
    import numpy as np

    metrics = read_json(results / "result.json")["metrics"]
    chosen = {
        name: float(item["value"]) for name, item in metrics.items() if name in BOARD or name.startswith(AT_POINTS)
    }
    critical = read_json(main / "result.json")["metrics"].get("critical_joint")
    if critical is None:
        return chosen
    with np.load(results / "history.npz") as arrays:
        joint = list(arrays["joints"]).index(critical["value"])
        return {name: value for name, (value, _) in joint_figures(arrays, joint).items()} | chosen


def structure_figures(results: Path, _main: Path) -> dict[str, float]:
    """Return the figures of a structure by name of the metric: at watch points, of supports, natural frequencies.

    Args:
        results: Folder of the results of one model.
    """
    metrics = read_json(results / "result.json")["metrics"]
    return {
        name: float(item["value"])
        for name, item in metrics.items()
        if name.startswith(OF_STRUCTURE) or name.endswith(FREQUENCY)
    }


def divergent_figures(results: Path) -> list[str]:
    """Return the names of the metrics of a model that do not converge under refinement."""
    return [name for name in read_json(results / "result.json")["metrics"] if name.startswith(NOT_CONVERGENT)]
