"""Figures of a shock, such as peak strains, whose errors are estimated from companions (the case on coarser meshes)."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reflowshock.fem.output.ranking import joint_figures
from reflowshock.workflow.process.products import read_json

if TYPE_CHECKING:
    from numpy.typing import NDArray

BOARD = ("peak_board_strain", "peak_board_displacement")
AT_POINTS = ("peak_acceleration@", "peak_displacement@", "peak_strain@", "peak_strain_rate@")
DEFLECTIONS = AT_POINTS[1:]  # without accelerations, which hardly depend on the mesh
OF_STRUCTURE = (*AT_POINTS, "displacement_range@", "peak_von_mises@", "peak_reaction@")
ROUNDING = 1e-9
NEAR = 1e-4  # distance of a node from a watch point that counts as none [m]
FREQUENCY = "_frequency"
NOT_CONVERGENT = "peak_element_stress"  # grows with refinement, as do its values of layers after an @


def drop_figures(results: Path, main: Path, end: float | None = None) -> dict[str, float]:
    """Return the figures of a drop, values in SI units by name of the metric.

    Those of a joint belong to the critical joint of the run; they are absent without one.

    Args:
        results: Folder of the results of one model, with ``result.json`` and ``history.npz``.
        main: Folder of the results of the first model of the run, which names the critical joint.
        end: Time until which peaks count [s]; the figures are then those of joint and board, without watch points. None
            for the whole run.
    """
    import numpy as np

    with np.load(results / "history.npz") as arrays:
        history = dict(arrays) if end is None else _until(end, arrays)
    if end is None:
        found = _chosen(results, lambda name: name in BOARD or name.startswith(AT_POINTS))
    else:
        deflection = np.abs(history["board_centre"][:, 2])
        found = dict(zip(BOARD, (float(history["board_strain"].max()), float(deflection.max())), strict=True))
    critical = read_json(main / "result.json")["metrics"].get("critical_joint")
    if critical is None:
        return found
    joint = list(history["joints"]).index(critical["value"])
    return {name: value for name, (value, _) in joint_figures(history, joint).items()} | found


def structure_figures(results: Path, _main: Path, _end: float | None = None) -> dict[str, float]:
    """Return the figures of a structure, values in SI units by name: at watch points, of supports, natural frequencies.

    Args:
        results: Folder of the results of one model, with ``result.json``.
        _main: Folder of the results of the first model of the run, not used.
        _end: Time until which peaks count, not used.
    """
    return _chosen(results, lambda name: name.startswith(OF_STRUCTURE) or name.endswith(FREQUENCY))


def drop_family(name: str) -> str:
    """Return the family of a figure of a drop: "the board", "the joint" or, without a family, an empty text.

    The figures of a family share the errors of one mesh.

    Args:
        name: Name of the figure, such as ``peak_board_strain`` or ``peak_strain@corner``.
    """
    if name in BOARD or name.startswith(DEFLECTIONS):
        return "the board"
    return "" if "@" in name else "the joint"


def reading_distances(case: Any, results: Path) -> dict[str, float]:
    """Return the distance of each watch point from the node at which a run reads it [m], by name of the point.

    Only points that are farther than a tenth of a millimetre from their node are included: there a finer mesh reads
    another place, which the companions may not show.

    Args:
        case: Case with watch points, in its mapping ``watch``.
        results: Folder of the results of one model, with ``history.npz``.
    """
    import numpy as np

    with np.load(results / "history.npz") as arrays:
        nodes = dict(zip(arrays["watch"].tolist(), arrays["watch_points"], strict=True)) if "watch" in arrays else {}
    distances = {
        name: float(np.linalg.norm(node - case.watch[name].at)) for name, node in nodes.items() if name in case.watch
    }
    return {name: distance for name, distance in distances.items() if distance > NEAR}


def divergent_figures(results: Path) -> list[str]:
    """Return the names of the metrics of a model that do not converge under refinement: peak element stresses.

    Args:
        results: Folder of the results of one model, with ``result.json``.
    """
    return [name for name in read_json(results / "result.json")["metrics"] if name.startswith(NOT_CONVERGENT)]


def _chosen(results: Path, is_chosen: Callable[[str], bool]) -> dict[str, float]:
    """Return the metrics of a model with chosen names."""
    metrics = read_json(results / "result.json")["metrics"]
    return {name: float(item["value"]) for name, item in metrics.items() if is_chosen(name)}


def _until(end: float, arrays: "Mapping[str, NDArray]") -> "dict[str, NDArray]":
    """Return histories until a time [s]; arrays that are no histories stay."""
    samples = arrays["time"].size
    count = int((arrays["time"] <= end * (1.0 + ROUNDING)).sum())
    return {
        name: array[:count] if array.shape[:1] == (samples,) and name != "joints" else array
        for name, array in arrays.items()
    }
