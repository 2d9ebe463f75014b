"""Stage that estimates the discretisation errors of a drop from its companions on two coarser meshes.

Each figure has an observed order and the grid convergence index of ``grid_convergence.py``. The figures of a joint are
those of the critical joint of the run on all meshes. A failed companion leaves the errors unknown, with its message.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from reflowshock.fem.output.ranking import joint_figures
from reflowshock.workflow.board_drop.companions import SIZES
from reflowshock.workflow.board_drop.shock_launch import MODES
from reflowshock.workflow.case.run import Findings, Run, metric
from reflowshock.workflow.convergence.grid_convergence import grid_convergence
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.products import write_json
from reflowshock.workflow.store.companions import FAILED, companion_folder
from reflowshock.workflow.store.product import read_record

FILE = "errors.json"
BOARD = ("peak_board_strain", "peak_board_displacement")
AT_POINTS = ("peak_acceleration@", "peak_displacement@", "peak_strain@", "peak_strain_rate@")
NOT_CONVERGENT = {"peak_element_stress": "grows with refinement"}


@dataclass(frozen=True, slots=True)
class FigureError:
    """Error of a figure, as in ``summary.json``.

    Attributes:
        discretisation: Grid convergence index relative to the figure; None if unknown.
        order: Observed order; None without one.
        how: Origin of the error, or why it is unknown.
    """

    discretisation: float | None
    order: float | None
    how: str


def estimate_errors(run: Run[BoardDropCase], folder: Path) -> Findings:
    """Write ``errors.json``: the errors of the figures of a shock, and the cost of its companions."""
    shocks = {size: companion_folder(run.folder, size) / "shock" for size in SIZES}
    records = {size: read_record(shock) for size, shock in shocks.items()}
    main = read_record(run.folder / "shock") or {"metrics": {}, "core_seconds": 0.0}
    failed = [_failure(run.folder, size) for size in SIZES if records[size] is None]
    joint = main["metrics"].get("critical_joint", {"value": ""})["value"]
    values = [figures(shocks[size], joint) for size in sorted(SIZES, reverse=True)] if not failed else []
    errors = {
        name: _error(value, [coarse.get(name) for coarse in values], failed)
        for name, value in figures(run.folder / "shock", joint).items()
    }
    errors |= {name: FigureError(None, None, why) for name, why in NOT_CONVERGENT.items() if name in main["metrics"]}
    write_json(folder / FILE, {name: asdict(error) for name, error in errors.items()})
    spent = sum(record["core_seconds"] for record in records.values() if record is not None)
    share = {"companion_cost_share": metric(spent / main["core_seconds"])} if main["core_seconds"] else {}
    return Findings(metrics=share)


def figures(shock: Path, joint: str) -> dict[str, float]:
    """Return the figures of a shock whose errors are estimated, by name of the metric.

    Args:
        shock: Product of the shock.
        joint: Joint of the section forces and stresses; empty without joints.
    """
    import numpy as np

    record: Mapping[str, Any] = read_record(shock) or {"metrics": {}}
    chosen = {
        name: float(item["value"])
        for name, item in record["metrics"].items()
        if name in BOARD or name.startswith(AT_POINTS)
    }
    if not joint:
        return chosen
    with np.load(next(path for mode in MODES if (path := shock / mode / "history.npz").is_file())) as arrays:
        number = list(arrays["joints"]).index(joint)
        return {name: value for name, (value, _) in joint_figures(arrays, number).items()} | chosen


def _error(value: float, coarser: list[float | None], failed: list[str]) -> FigureError:
    """Return the error of a figure from its values on the coarser meshes, the coarsest first."""
    if failed:
        return FigureError(None, None, "; ".join(failed))
    numbers = [number for number in coarser if number is not None]
    if len(numbers) < len(coarser) or not value:
        return FigureError(None, None, "zero, or not in all runs")
    found = grid_convergence([*sorted(SIZES, reverse=True), 1.0], [*numbers, value])
    return FigureError(found.index / abs(value), found.order, found.how)


def _failure(run_folder: Path, size: float) -> str:
    """Return why a companion has no result."""
    path = companion_folder(run_folder, size) / FAILED
    why = path.read_text(encoding="utf-8").strip() if path.is_file() else "has not run"
    return f"the run with elements x {size:g}: {why}"
