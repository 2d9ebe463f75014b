"""Input and results of a stage: metrics and health checks in the form of ``summary.json``."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from reflowshock.workflow.case.case import Case

AnyCase = TypeVar("AnyCase", bound=Case)


@dataclass(frozen=True, slots=True)
class Run(Generic[AnyCase]):
    """Input of a stage.

    Attributes:
        folder: The run folder, with the products of earlier stages.
        case: The resolved case.
        cores: Number of cores that a stage may use.
        oversubscribe: Whether MPI may have more ranks than cores.
    """

    folder: Path
    case: AnyCase
    cores: int
    oversubscribe: bool = False

    def checkpoints(self, stage: str) -> Path:
        """Return the folder for the checkpoints of a stage, which is removed when the stage is complete."""
        return self.folder / f".{stage}.checkpoints"


@dataclass(frozen=True, slots=True)
class Findings:
    """Results of a stage, in the form of ``summary.json``.

    Attributes:
        metrics: Name -> {"value", "unit"}.
        health: Check -> {"value", "limit", "ok"}.
        effects: Effect -> {"on", "why"}.
        continued: Names of parts that continued from checkpoints, or empty.
    """

    metrics: dict = field(default_factory=dict)
    health: dict = field(default_factory=dict)
    effects: dict = field(default_factory=dict)
    continued: str = ""


class StageError(RuntimeError):
    """Unusable input of a stage, or missing output."""


StageFunction = Callable[[Run[Any], Path], Findings]


def metric(value: float | str, unit: str = "") -> dict:
    """Return a metric as a record with ``value`` and ``unit``, as in ``summary.json``.

    Args:
        value: Number in SI units, or a text.
        unit: SI unit; empty for ratios and texts.
    """
    return {"value": value, "unit": unit}


def at_most(value: float, limit: float) -> dict:
    """Return a health check that passes if the value does not exceed its limit; nan fails.

    Returns:
        Record with ``value``, ``limit`` and ``ok``, as in ``summary.json``.
    """
    return {"value": value, "limit": limit, "ok": bool(value <= limit)}


def at_least(value: float, limit: float) -> dict:
    """Return a health check that passes if the value is not below its limit; nan fails.

    Returns:
        Record with ``value``, ``limit`` and ``ok``, as in ``summary.json``.
    """
    return {"value": value, "limit": limit, "ok": bool(value >= limit)}


def worst(values: Iterable[float]) -> float:
    """Return the largest magnitude of some values: nan if any value is nan, zero without values.

    Args:
        values: Numbers in one unit, such as relative errors.
    """
    magnitudes = [abs(value) for value in values]
    return float("nan") if any(value != value for value in magnitudes) else max(magnitudes, default=0.0)


def in_words_continued(results: Mapping[str, dict]) -> str:
    """Return a text about the runs that continued from a checkpoint; empty if none did.

    Args:
        results: Name of a run -> content of its ``result.json``; ``continued_from`` is the number of a window.
    """
    windows = {name: result.get("continued_from", 0) for name, result in results.items()}
    return ", ".join(f"{name} from window {window}" for name, window in windows.items() if window)
