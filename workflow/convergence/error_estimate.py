"""Stage that estimates the errors of a run from its companions: discretisation, and two scales against one model.

A companion is the same case on a coarser mesh, or also with half the coupling window. Each figure has an observed order
and the grid convergence index of ``grid_convergence.py``, in a drop at least the median of its family: the figures of
the joint, or deflections and strains of the board. The error of two scales is the relative difference from one model on
the same mesh, of the run or of the coarsest companion, or from half the coupling window. A failed companion leaves
these errors unknown, with its message.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

from reflowshock.units import from_si
from reflowshock.workflow.case.run import Findings, Run, metric
from reflowshock.workflow.convergence.drop_companions import LEAST_END
from reflowshock.workflow.convergence.figures import divergent_figures, reading_distances
from reflowshock.workflow.convergence.grid_convergence import grid_convergence
from reflowshock.workflow.process.products import read_json, simulated_time, write_json
from reflowshock.workflow.store.companions import (
    COARSEST,
    FAILED,
    HALF_WINDOW,
    SIZES,
    UNTIL,
    companion_folder,
    companion_title,
    size_name,
)
from reflowshock.workflow.store.product import read_record

FILE = "errors.json"
MODELS = ("two_scale", "explicit", "implicit", "dns")  # folders of results in a shock, the first model first
ONE_MODEL = MODELS[-1]
ROUNDING = 1e-6  # of the ends of two models

Figures = Callable[[Path, Path, float | None], Mapping[str, float]]
Sizes = Callable[[Any, Path], Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class FigureError:
    """Estimated error of a figure, such as a peak strain.

    Attributes:
        discretisation: Grid convergence index over the magnitude of the figure, a ratio; None if unknown.
        order: Observed order of convergence in the element size; None without one.
        two_scale: Relative error of two scales, a ratio; None for one model, or if unknown.
        how: Origin of the discretisation error, or why it is unknown.
        two_scale_how: Origin of the error of two scales, or why it is unknown; empty for one model.
    """

    discretisation: float | None
    order: float | None
    two_scale: float | None
    how: str
    two_scale_how: str


@dataclass(frozen=True, slots=True)
class TwoScales:
    """Errors of a two-scale run against one model without scales.

    Attributes:
        errors: Relative error of each figure by name, a ratio; empty if unknown or for one model.
        how: Origin of the errors, or why they are unknown; empty for one model.
    """

    errors: Mapping[str, float] = field(default_factory=dict)
    how: str = ""


@dataclass(frozen=True, slots=True)
class _Coarser:
    """Companion on a coarser mesh.

    Attributes:
        size: Realised element size relative to the case.
        figures: Figures by name; empty if it has no result.
        failure: Why it has no result; empty if it has one.
    """

    size: float
    figures: Mapping[str, float] = field(default_factory=dict)
    failure: str = ""


@dataclass(frozen=True, slots=True)
class Reading:
    """Functions that read the figures of a kind of case (drop or structure).

    Attributes:
        figures: Function from the folder of a model, the folder of the first model of the run, and an end [s] or None,
            to the figures: values in SI units by name.
        sizes: Function from the case and the folder of its shock to the realised element size of each companion (the
            same case on a coarser mesh) relative to the case, by name.
        family: Function from the name of a figure to its family in words, empty without a family; the discretisation
            error of a figure is at least the median of its family.
    """

    figures: Figures
    sizes: Sizes
    family: Callable[[str], str] = lambda _name: ""


def estimate_errors(reading: Reading, run: Run[Any], folder: Path) -> Findings:
    """Write ``errors.json``, the errors of the figures of a shock by name, and return the cost of its companions.

    Companions are runs of the same case on coarser meshes. A missing or failed one leaves its errors unknown (null).

    Args:
        reading: Functions that read the figures of this kind of case.
        run: Run folder with the shock and its companions, case, cores.
        folder: Existing folder of the product, into which ``errors.json`` is written.

    Returns:
        ``Findings`` with the metric ``companion_cost_share``: processor time of the companions over that of the shock.
    """
    main = first_model(run.folder / UNTIL)
    figures, realised = reading.figures, reading.sizes(run.case, run.folder / UNTIL)
    names = [size_name(size) for size in sorted(SIZES, reverse=True)]
    coarser = [_coarser(figures, run.folder, name, realised[name], main) for name in names]
    two_scales = _two_scales(figures, run.folder, main)
    errors = {name: _error(name, value, coarser, two_scales) for name, value in figures(main, main, None).items()}
    errors = _with_families(errors, reading.family)
    errors = _with_distances(errors, reading_distances(run.case, main)) | {
        name: FigureError(None, None, None, "grows with refinement", "") for name in divergent_figures(main)
    }
    write_json(folder / FILE, {name: asdict(error) for name, error in errors.items()})
    return Findings(metrics=_cost_share(run.folder))


def first_model(shock: Path) -> Path:
    """Return the folder of the results of the first model of a shock, in the order of ``MODELS``.

    Args:
        shock: Folder of the product of the shock, with a folder for each model.

    Raises:
        StopIteration: The shock has no folder of a model.
    """
    return next(folder for model in MODELS if (folder := shock / model).is_dir())


def _coarser(figures: Figures, run_folder: Path, name: str, size: float, main: Path) -> _Coarser:
    """Return a companion of a realised size with its figures, or with the reason why they are missing."""
    if failure := _failure(run_folder, name):
        return _Coarser(size, failure=failure)
    return _Coarser(size, figures(first_model(companion_folder(run_folder, name) / UNTIL), main, None))


def _error(name: str, value: float, coarser: list[_Coarser], two_scales: TwoScales) -> FigureError:
    """Return the errors of a figure from its values on the coarser meshes, the coarsest first."""
    scheme = two_scales.errors.get(name)
    if why := _unknown(name, value, coarser):
        return FigureError(None, None, scheme, why, two_scales.how)
    sizes, values = [mesh.size for mesh in coarser], [mesh.figures[name] for mesh in coarser]
    found = grid_convergence([*sizes, 1.0], [*values, value])
    return FigureError(found.index / abs(value), found.order, scheme, found.how, two_scales.how)


def _with_families(errors: Mapping[str, FigureError], family: Callable[[str], str]) -> dict[str, FigureError]:
    """Return errors of at least the median of their family.

    A figure that happens to change little between three meshes is not more accurate than the others of its mesh.
    """
    members: dict[str, list[float]] = {}
    for name, error in errors.items():
        if family(name) and error.discretisation is not None:
            members.setdefault(family(name), []).append(error.discretisation)
    medians = {name: median(values) for name, values in members.items()}

    def raised(name: str, error: FigureError) -> FigureError:
        least = medians.get(family(name), 0.0)
        if error.discretisation is None or error.discretisation >= least:
            return error
        return replace(error, discretisation=least, how=f"median of the figures of {family(name)}; alone {error.how}")

    return {name: raised(name, error) for name, error in errors.items()}


def _with_distances(errors: Mapping[str, FigureError], distances: Mapping[str, float]) -> dict[str, FigureError]:
    """Return the errors with a remark on each figure that is read away from its watch point, at a distance [m]."""
    remarks = {name: f"; read {from_si(distance, 'mm', 2)} from the point" for name, distance in distances.items()}
    return {
        name: replace(error, how=error.how + remarks.get(name.partition("@")[2], "")) for name, error in errors.items()
    }


def _unknown(name: str, value: float, coarser: list[_Coarser]) -> str:
    """Return why the discretisation error of a figure cannot be estimated; empty if it can."""
    if failures := [mesh.failure for mesh in coarser if mesh.failure]:
        return "; ".join(failures)
    if not value or any(name not in mesh.figures for mesh in coarser):
        return "zero, or not in all runs"
    sizes = [mesh.size for mesh in coarser]
    if not sizes[0] > sizes[1] > 1.0:
        return f"rounded numbers of elements give meshes of {sizes[1]:.3g} and {sizes[0]:.3g} times the size"
    return ""


def _two_scales(figures: Figures, run_folder: Path, main: Path) -> TwoScales:
    """Return the errors of two scales of a run: relative differences from another computation of the same mesh."""
    if not _has_two_scales(main):
        return TwoScales()
    compared = _compared(run_folder, main)
    if isinstance(compared, str):
        return TwoScales(how=compared)
    ours, reference, how = compared
    end = _end(reference) if _end(reference) < (1.0 - ROUNDING) * _end(ours) else None
    expected = figures(reference, main, end)
    values = figures(ours, main, end)
    errors = {name: abs(value / expected[name] - 1.0) for name, value in values.items() if expected.get(name)}
    return TwoScales(errors, how if end is None else f"{how}, until {1e3 * end:.3g} ms")


def _compared(run_folder: Path, main: Path) -> tuple[Path, Path, str] | str:
    """Return two results of the same mesh that differ by their scales, and the difference in words; or why not."""
    if (one := main.parent / ONE_MODEL).is_dir() and _end(one) >= LEAST_END * _end(main):
        return main, one, "one model on the same mesh"
    if failed := _failure(run_folder, COARSEST):
        return failed
    coarsest = first_model(companion_folder(run_folder, COARSEST) / UNTIL)
    if (one := coarsest.parent / ONE_MODEL).is_dir():
        return coarsest, one, f"one model, {companion_title(COARSEST)}"
    if failed := _failure(run_folder, HALF_WINDOW):
        return failed
    halved = first_model(companion_folder(run_folder, HALF_WINDOW) / UNTIL)
    return coarsest, halved, f"change by half the window without that by coarse parts, elements x {SIZES[-1]:g}"


def _has_two_scales(results: Path) -> bool:
    """Return whether results are those of two coupled models."""
    return "scheme" in read_json(results / "result.json").get("coupling", {})


def _end(results: Path) -> float:
    """Return the end of the run of a model [s]."""
    return simulated_time(read_json(results / "result.json"))


def _failure(run_folder: Path, name: str) -> str:
    """Return why a companion has no result; empty if it has one."""
    folder = companion_folder(run_folder, name)
    if read_record(folder / UNTIL) is not None:
        return ""
    path = folder / FAILED
    why = path.read_text(encoding="utf-8").strip() if path.is_file() else "has not run"
    return f"the run with {companion_title(name)}: {why}"


def _cost_share(run_folder: Path) -> dict[str, Any]:
    """Return the processor time of all companions over that of the shock of the run, as a metric."""
    main = read_record(run_folder / UNTIL) or {"core_seconds": 0.0}
    names = (*map(size_name, SIZES), HALF_WINDOW)
    records = (read_record(companion_folder(run_folder, name) / UNTIL) for name in names)
    spent = sum(record["core_seconds"] for record in records if record is not None)
    return {"companion_cost_share": metric(spent / main["core_seconds"])} if main["core_seconds"] else {}
