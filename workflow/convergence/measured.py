"""`accuracy.json`: what was measured of a ladder, on which machine, and what follows from it."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from reflowshock.workflow.convergence.errors import Error
from reflowshock.workflow.convergence.machine import Machine
from reflowshock.workflow.convergence.orders import CostFit, ErrorFit, fit_cost, fit_error
from reflowshock.workflow.convergence.series import Ladder, Rung

FILE = "accuracy.json"


@dataclass(frozen=True, slots=True)
class StageCost:
    """What a stage of a run cost, and what was foreseen.

    Attributes:
        seconds: wall time [s], the smallest of all times that it was run.
        core_seconds: processor time of all its processes [s], the smallest likewise.
        forecast: wall time [s] that was foreseen; None where there is no forecast of the stage.
    """

    seconds: float
    core_seconds: float
    forecast: float | None


@dataclass(frozen=True, slots=True)
class Measurement:
    """A rung that was run.

    Attributes:
        rung: its name.
        knob: what varies.
        value: of the knob; None for a choice.
        settings: dotted key -> value.
        key: of its point in the store.
        stages: cost of the stages that count; empty where it failed.
        errors: quantity -> error; one that others are compared with has none.
        failed: message of the stage that failed; empty where none did.
        against: rung that its errors are from, where they are not those of the whole answer.
    """

    rung: str
    knob: str
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
    """How errors and costs follow a knob: quantity -> fit of its error, and that of the cost; None where none fits."""

    errors: Mapping[str, ErrorFit]
    cost: CostFit | None


@dataclass(frozen=True, slots=True)
class Recommended:
    """Settings that were chosen, what was foreseen of them and, once they were run, what was found.

    Attributes:
        rung: name, knob, settings.
        why: in words.
        error: that was foreseen.
        core_seconds: that were foreseen [s].
        found: the run; None where it was not run.
    """

    rung: Rung
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
        measurements: of all rungs that were run.
        fits: knob -> fits.
        tolerance: of the judged error; None where none was asked for.
        recommended: None where nothing was.
    """

    case: str
    kind: str
    command: str
    machine: Machine
    errors: Mapping[str, str]
    measurements: tuple[Measurement, ...]
    fits: Mapping[str, Fit]
    tolerance: float | None = None
    recommended: Recommended | None = None

    @property
    def judged(self) -> str:
        """Name of the quantity that the tolerance is meant for."""
        return next(iter(self.errors))


def fits_of(ladder: Ladder, measurements: Mapping[str, Measurement]) -> dict[str, Fit]:
    """Fit errors and costs of every knob.

    Args:
        ladder: its knobs.
        measurements: name of rung -> what was measured of it.
    """
    return {knob.name: _fit(knob.rungs, knob.order, ladder, measurements) for knob in ladder.knobs}


def _fit(rungs: tuple[Rung, ...], order: float | None, ladder: Ladder, measurements: Mapping[str, Measurement]) -> Fit:
    known = [found for rung in rungs if (found := measurements.get(rung.name)) is not None and not found.failed]
    values = [one.value or 0.0 for one in known]
    errors = {}
    for quantity in ladder.errors:
        place = [k for k, one in enumerate(known) if quantity in one.errors]
        theory = order if quantity == ladder.judged else None
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
        chosen |= {"rung": Rung(**chosen["rung"]), "found": None if found is None else _measurement(found)}
    return Accuracy(
        **table
        | {
            "machine": Machine(**table["machine"]),
            "measurements": tuple(_measurement(one) for one in table["measurements"]),
            "fits": {knob: _read_fit(fit) for knob, fit in table["fits"].items()},
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
