"""Running one stage: a fresh partial folder, a record of what was used and found, a rename when all is there."""

import json
import resource
import shutil
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from workflow.case_kind import Case
from workflow.inputs import stage_inputs
from workflow.launch import LaunchError
from workflow.terminal import health_line, print_error

MESSAGE = "message.txt"  # in the partial folder of a stage that failed: why
AnyCase = TypeVar("AnyCase", bound=Case)


@dataclass(frozen=True, slots=True)
class Run(Generic[AnyCase]):
    """What a stage works with.

    Attributes:
        folder: the run folder, with the products of earlier stages.
        case: the resolved case.
        cores: number of cores that a stage may use.
        oversubscribe: whether MPI may have more ranks than cores.
    """

    folder: Path
    case: AnyCase
    cores: int
    oversubscribe: bool = False

    def checkpoints(self, stage: str) -> Path:
        """Folder in which a stage keeps what it needs to continue after a kill; removed when it is complete."""
        return self.folder / f".{stage}.checkpoints"


@dataclass(frozen=True, slots=True)
class Findings:
    """What a stage found, in the form of ``summary.json``.

    Attributes:
        metrics: name -> {"value", "unit"}.
        health: check -> {"value", "limit", "ok"}.
        effects: effect -> {"on", "why"}.
        continued: what continued from checkpoints, in words.
    """

    metrics: dict = field(default_factory=dict)
    health: dict = field(default_factory=dict)
    effects: dict = field(default_factory=dict)
    continued: str = ""


StageFunction = Callable[[Run[Any], Path], Findings]


def run_stage(name: str, function: StageFunction, run: Run) -> dict:
    """Run a stage; its folder appears at once and complete, or not at all.

    Args:
        name: name of the stage.
        function: writes products into the given folder and returns what it found.
        run: what the stage works with.

    Returns:
        The record written to ``stage.json``: seconds, core_seconds, metrics, health, effects, continued, inputs.
    """
    folder, partial = run.folder / name, run.folder / f".{name}.partial"
    _remove(partial)
    partial.mkdir(parents=True)
    start, used = time.perf_counter(), core_seconds()
    findings = function(run, partial)
    record = {
        "seconds": round(time.perf_counter() - start, 3),
        "core_seconds": round(core_seconds() - used, 3),
        "metrics": findings.metrics,
        "health": findings.health,
        "effects": findings.effects,
        "continued": findings.continued,
        "inputs": stage_inputs(run.case, run.case.pipeline[name]),
    }
    (partial / "stage.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    _remove(folder)
    partial.rename(folder)
    _remove(run.checkpoints(name))
    return record


def core_seconds() -> float:
    """Processor time [s] of this process and of all that it started on this machine and that have ended.

    Those are workers of a pool and, through the launcher that waits for them, MPI ranks; not ranks elsewhere.
    """
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def execute(name: str, function: StageFunction, run: Run) -> bool:
    """Run a stage and tell the user how it ended.

    Returns:
        Whether it completed. If not, ``.<stage>.partial`` of the run folder has the traceback and the message.
    """
    try:
        record = run_stage(name, function, run)
    except Exception as error:  # the boundary of a stage: whatever went wrong is told with the stage's name
        if _is_interrupt(error):
            raise KeyboardInterrupt from error
        log = run.folder / f".{name}.partial" / "error.txt"
        log.write_text(traceback.format_exc(), encoding="utf-8")
        told = str(error) if isinstance(error, LaunchError) else f"{type(error).__name__}: {error}"
        log.with_name(MESSAGE).write_text(told, encoding="utf-8")
        print_error(f"stage {name} failed: {told}\ntraceback: {log}")
        return False
    health_line(name, record["seconds"], record["health"], record["continued"])
    return True


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether an interrupt is behind an error: compiled functions wrap it."""
    return error is not None and (isinstance(error, KeyboardInterrupt) or _is_interrupt(error.__cause__))


def _remove(folder: Path) -> None:
    if folder.exists():
        shutil.rmtree(folder)
