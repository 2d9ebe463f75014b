"""`accuracy.json`: what was measured in a convergence study, on which machine, and what follows from it."""

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from reflowshock.workflow.convergence.errors import Error
from reflowshock.workflow.convergence.orders import CostFit, ErrorFit, fit_cost, fit_error
from reflowshock.workflow.convergence.series import ConvergenceStudy, StudyRun
from reflowshock.workflow.process.environment import available_cores

CPU_INFO = Path("/proc/cpuinfo")


@dataclass(frozen=True, slots=True)
class Host:
    """Model of the processor, and the cores that a program may use."""

    processor: str
    cores: int

    def __str__(self) -> str:
        return f"{self.processor}, {self.cores} {'core' if self.cores == 1 else 'cores'}"


def this_host() -> Host:
    """Return the machine that this process is on."""
    return Host(_model() or platform.processor() or platform.machine(), available_cores())


def _model() -> str:
    if not CPU_INFO.is_file():
        return ""
    lines = (line.partition(":") for line in CPU_INFO.read_text(encoding="utf-8").splitlines())
    return next((value.strip() for key, _, value in lines if key.strip() == "model name"), "")


FILE = "accuracy.json"


@dataclass(frozen=True, slots=True)
class StageCost:
    """What a stage of a run cost, and what was predicted.

    Attributes:
        seconds: wall time [s], the smallest of all times that it was run.
        core_seconds: processor time of all its processes [s], the smallest likewise.
        forecast: wall time [s] that was predicted; None where there is no forecast of the stage.
    """

    seconds: float
    core_seconds: float
    forecast: float | None


@dataclass(frozen=True, slots=True)
class Measurement:
    """What was measured of a run.

    Attributes:
        run: its name.
        parameter: what varies.
        value: of the parameter; None for a choice.
        settings: dotted key -> value.
        key: of its point in the store.
        stages: cost of the stages that count; empty where it failed.
        errors: quantity -> error; one that others are compared with has none.
        failed: message of the stage that failed; empty where none did.
        against: run that its errors are from, where they are not those of the whole answer.
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
        """Wall time of the stages that count [s]."""
        return sum(stage.seconds for stage in self.stages.values())

    @property
    def core_seconds(self) -> float:
        """Processor time of the stages that count [s]."""
        return sum(stage.core_seconds for stage in self.stages.values())


@dataclass(frozen=True, slots=True)
class Fit:
    """How errors and cost follow a parameter: quantity -> fit of its error; fit of the cost, None where none fits."""

    errors: Mapping[str, ErrorFit]
    cost: CostFit | None


@dataclass(frozen=True, slots=True)
class Recommended:
    """Settings that were chosen, what was predicted of them and, once they were run, what was found.

    Attributes:
        run: name, parameter, settings.
        why: in words.
        error: that was predicted.
        core_seconds: that were predicted [s].
        found: the run; None where it was not run.
    """

    run: StudyRun
    why: str
    error: float
    core_seconds: float
    found: Measurement | None = None


@dataclass(frozen=True, slots=True)
class Accuracy:
    """All that was measured of a case.

    Attributes:
        case: its name.
        kind: of case.
        command: that measured it.
        machine: where.
        errors: quantity -> what its error is called; the first one is judged.
        measurements: of all runs that were run.
        fits: parameter -> fits.
        tolerance: of the judged error; None where none was asked for.
        recommended: None where nothing was.
        key: of the product with the case's own answer; that of another case, or of one changed since, differs.
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
        """Name of the quantity that the tolerance is meant for."""
        return next(iter(self.errors))


def fits_of(study: ConvergenceStudy, measurements: Mapping[str, Measurement]) -> dict[str, Fit]:
    """Fit errors and costs of every parameter.

    Args:
        study: its parameters.
        measurements: name of run -> what was measured of it.
    """
    return {
        parameter.name: _fit(parameter.runs, parameter.order, study, measurements) for parameter in study.parameters
    }


def _fit(
    runs: tuple[StudyRun, ...], order: float | None, study: ConvergenceStudy, measurements: Mapping[str, Measurement]
) -> Fit:
    known = [found for run in runs if (found := measurements.get(run.name)) is not None and not found.failed]
    values = [one.value or 0.0 for one in known]
    errors = {}
    for quantity in study.errors:
        place = [k for k, one in enumerate(known) if quantity in one.errors]
        theory = order if quantity == study.judged else None
        fit = fit_error([values[k] for k in place], [known[k].errors[quantity].value for k in place], theory)
        if fit is not None:
            errors[quantity] = fit
    return Fit(errors, fit_cost(values, [one.core_seconds for one in known]))


def write_accuracy(folder: Path, accuracy: Accuracy) -> None:
    """Write ``accuracy.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    partial = folder / f".{FILE}.partial"
    partial.write_text(json.dumps(asdict(accuracy), indent=1) + "\n", encoding="utf-8")
    partial.rename(folder / FILE)


def read_accuracy(path: Path) -> Accuracy | None:
    """Read ``accuracy.json``; None where there is none, or that of a version that wrote other fields."""
    if not path.is_file():
        return None
    try:
        return _accuracy(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _accuracy(table: dict) -> Accuracy:
    chosen = table["recommended"]
    if chosen is not None:
        found = chosen["found"]
        chosen |= {"run": StudyRun(**chosen["run"]), "found": None if found is None else _measurement(found)}
    return Accuracy(
        **table
        | {
            "machine": Host(**table["machine"]),
            "measurements": tuple(_measurement(one) for one in table["measurements"]),
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
