"""The file ``accuracy.json``: measurements of a convergence study, their machine, fits and recommendation."""

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, StudyRun
from reflowshock.workflow.convergence.errors import Error
from reflowshock.workflow.convergence.fits import CostFit, ErrorFit, fit_cost, fit_error
from reflowshock.workflow.process.environment import available_cores

CPU_INFO = Path("/proc/cpuinfo")


@dataclass(frozen=True, slots=True)
class Host:
    """A machine: model of the processor and number of usable cores."""

    processor: str
    cores: int

    def __str__(self) -> str:
        return f"{self.processor}, {self.cores} {'core' if self.cores == 1 else 'cores'}"


def this_host() -> Host:
    """Return processor and number of usable cores of the machine on which this process runs."""
    return Host(_model() or platform.processor() or platform.machine(), available_cores())


def _model() -> str:
    if not CPU_INFO.is_file():
        return ""
    lines = (line.partition(":") for line in CPU_INFO.read_text(encoding="utf-8").splitlines())
    return next((value.strip() for key, _, value in lines if key.strip() == "model name"), "")


FILE = "accuracy.json"


@dataclass(frozen=True, slots=True)
class StageCost:
    """Measured and predicted cost of a stage.

    Attributes:
        seconds: Wall time, the smallest of repeated runs [s].
        core_seconds: Processor time of all its processes, the smallest of repeated runs [s].
        forecast: Predicted wall time [s]; None if the stage has no forecast.
    """

    seconds: float
    core_seconds: float
    forecast: float | None


@dataclass(frozen=True, slots=True)
class Measurement:
    """Errors and costs of one run of a study.

    Attributes:
        run: Name of the run.
        parameter: Varied parameter.
        value: Value of the parameter; None for a choice.
        settings: Dotted key -> value.
        key: Key of its point in the store.
        stages: Cost of the timed stages; empty if the run failed.
        errors: Quantity -> error; a reference run has none.
        failed: Message of the failed stage; empty if none failed.
        against: Reference run if the errors are partial, not total errors.
    """

    run: str
    parameter: str
    value: float | None
    settings: Mapping[str, str]
    key: str
    stages: Mapping[str, StageCost]
    errors: Mapping[str, Error]
    failed: str = ""
    against: str = ""

    @property
    def seconds(self) -> float:
        """Wall time of the timed stages [s]."""
        return sum(stage.seconds for stage in self.stages.values())

    @property
    def core_seconds(self) -> float:
        """Processor time of the timed stages [s]."""
        return sum(stage.core_seconds for stage in self.stages.values())


@dataclass(frozen=True, slots=True)
class Fit:
    """Fits over one parameter.

    Attributes:
        errors: Quantity -> fit of its error.
        cost: Fit of the cost; None if there are too few runs.
    """

    errors: Mapping[str, ErrorFit]
    cost: CostFit | None


@dataclass(frozen=True, slots=True)
class Recommended:
    """Recommended settings with their predicted error and cost.

    Attributes:
        run: Recommended run.
        why: Reason, for readers.
        error: Predicted error.
        core_seconds: Predicted cost [s].
        found: Measurement of the recommended run; None if it was not run.
    """

    run: StudyRun
    why: str
    error: float
    core_seconds: float
    found: Measurement | None = None


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Content of ``accuracy.json``: the convergence study of a case.

    Attributes:
        case: Name of the case.
        kind: Kind of the case.
        command: Command that ran the study.
        machine: Machine of the runs.
        errors: Quantity -> name of its error; the first one is the judged quantity.
        measurements: Measurements of all runs.
        fits: Parameter -> fits.
        tolerance: Tolerance of the judged error; None if the user gave none.
        recommended: Recommended settings; None without a recommendation.
        key: Key of the case's product; it differs for another case or changed inputs.
    """

    case: str
    kind: str
    command: str
    machine: Host
    errors: Mapping[str, str]
    measurements: tuple[Measurement, ...]
    fits: Mapping[str, Fit]
    tolerance: float | None = None
    recommended: Recommended | None = None
    key: str = ""

    @property
    def judged(self) -> str:
        """Name of the quantity to which the tolerance applies."""
        return next(iter(self.errors))


def fit_measurements(study: ConvergenceStudy, measurements: Mapping[str, Measurement]) -> dict[str, Fit]:
    """Fit errors and costs over every parameter of a study.

    Args:
        study: Study with the parameters.
        measurements: Name of run -> its measurement.

    Returns:
        Name of parameter -> fits of each error and of the cost over its values.
    """
    return {
        parameter.name: _fit(parameter.runs, parameter.order, study, measurements) for parameter in study.parameters
    }


def _fit(
    runs: tuple[StudyRun, ...], order: float | None, study: ConvergenceStudy, measurements: Mapping[str, Measurement]
) -> Fit:
    measured = [m for run in runs if (m := measurements.get(run.name)) is not None and not m.failed]
    values = [measurement.value or 0.0 for measurement in measured]
    errors = {}
    for quantity in study.errors:
        rows = [k for k, measurement in enumerate(measured) if quantity in measurement.errors]
        theory = order if quantity == study.judged else None
        fit = fit_error([values[k] for k in rows], [measured[k].errors[quantity].value for k in rows], theory)
        if fit is not None:
            errors[quantity] = fit
    return Fit(errors, fit_cost(values, [measurement.core_seconds for measurement in measured]))


def write_accuracy(folder: Path, accuracy: Accuracy) -> None:
    """Write a convergence study to ``accuracy.json`` in a folder; an existing file is replaced."""
    folder.mkdir(parents=True, exist_ok=True)
    partial = folder / f".{FILE}.partial"
    partial.write_text(json.dumps(asdict(accuracy), indent=1) + "\n", encoding="utf-8")
    partial.rename(folder / FILE)


def read_accuracy(path: Path) -> Accuracy | None:
    """Read ``accuracy.json``; return None if it is missing or was written by a version with other fields.

    Args:
        path: Path of the file.
    """
    if not path.is_file():
        return None
    try:
        return _accuracy(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _accuracy(table: dict) -> Accuracy:
    chosen = table["recommended"]
    if chosen is not None:
        measured = chosen["found"]
        chosen |= {"run": StudyRun(**chosen["run"]), "found": None if measured is None else _measurement(measured)}
    return Accuracy(
        **table
        | {
            "machine": Host(**table["machine"]),
            "measurements": tuple(map(_measurement, table["measurements"])),
            "fits": {parameter: _read_fit(fit) for parameter, fit in table["fits"].items()},
            "recommended": None if chosen is None else Recommended(**chosen),
        }
    )


def _measurement(table: dict) -> Measurement:
    stages = {name: StageCost(**cost) for name, cost in table["stages"].items()}
    errors = {name: Error(**error) for name, error in table["errors"].items()}
    return Measurement(**table | {"stages": stages, "errors": errors})


def _read_fit(table: dict) -> Fit:
    errors = {quantity: ErrorFit(**fit) for quantity, fit in table["errors"].items()}
    return Fit(errors, None if table["cost"] is None else CostFit(**table["cost"]))
