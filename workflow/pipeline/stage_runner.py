"""Running one stage: a fresh partial folder, a record of what was used and found, a rename when all is there."""

import resource
import time
import traceback
from pathlib import Path

from reflowshock.workflow.case.run import Run, StageError, StageFunction
from reflowshock.workflow.case.stage import Stage
from reflowshock.workflow.convergence.accuracy_file import this_host
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.process.error_exit import describe_error, is_interrupt
from reflowshock.workflow.process.kernel_folder import compilation_time
from reflowshock.workflow.process.terminal import console, health_line
from reflowshock.workflow.store.keys import compare, product_key, stage_inputs
from reflowshock.workflow.store.product import discard, publish, read_record, seal
from reflowshock.workflow.store.store import MESSAGE, TRACEBACK, reads


def run_stage(name: str, function: StageFunction, run: Run, product: Path) -> dict:
    """Run a stage; its product appears at once and complete, or not at all.

    Args:
        name: name of the stage.
        function: writes products into the given folder and returns what it found.
        run: what the stage works with.
        product: the folder that its product becomes; one that is there is replaced.

    Returns:
        The record: seconds, core_seconds, forecast, machine, metrics, health, effects, continued, key, inputs, reads,
        files.

    Raises:
        StageError: a file that the case names has changed since the command began, or a product was not written.
    """
    stage, partial = run.case.pipeline[name], run.folder / f".{name}.partial"
    before = {"inputs": stage_inputs(run.case, stage), "reads": _reads(run, stage)}
    key = product.name.rpartition("-")[2]
    _check_key(run, stage, before["inputs"], key)
    discard(partial)
    partial.mkdir(parents=True)
    forecast = stage_seconds(run.case).get(name, 0.0) + compilation_time([name])
    start, used = time.perf_counter(), core_seconds()
    findings = function(run, partial)
    record = {
        "seconds": round(time.perf_counter() - start, 3),
        "core_seconds": round(core_seconds() - used, 3),
        "forecast": forecast,
        "machine": str(this_host()),
        "metrics": findings.metrics,
        "health": findings.health,
        "effects": findings.effects,
        "continued": findings.continued,
        "key": key,
    }
    _check(run, stage, before, partial)
    record = seal(partial, record | before)
    publish(partial, product)
    discard(run.checkpoints(name))
    return record


def _reads(run: Run, stage: Stage) -> dict[str, str | None]:
    return reads({one.name: run.folder / one.name for one in run.case.pipeline.stages}, run.case, stage)


def _check_key(run: Run, stage: Stage, inputs: dict, key: str) -> None:
    """See to it that what a stage finds is what its product is named after, when the command began."""
    follows = [(read_record(run.folder / name) or {}).get("key") for name in stage.follows]
    if None not in follows and product_key(run.case, stage, inputs, follows) != key:
        raise StageError("a file of the case or the program itself has changed since the command started; run it again")


def _check(run: Run, stage: Stage, before: dict, partial: Path) -> None:
    """See to it that what a stage has used is still so, and that it has written what it is to write."""
    changed = compare(before["inputs"], stage_inputs(run.case, stage))
    if changed:
        names = ", ".join(change.key.removesuffix(".sha256") for change in changed)
        raise StageError(f"{names}: the file changed while the stage was running; run it again")
    if None in before["reads"].values() or before["reads"] != _reads(run, stage):
        raise StageError("a product that the stage reads has changed or is damaged; run it again")
    missing = [name for name in stage.products if not (partial / name.removeprefix(f"{stage.name}/")).exists()]
    if missing:
        raise StageError(f"the stage has not written {', '.join(missing)}")


def core_seconds() -> float:
    """Processor time [s] of this process and of all that it started on this machine and that have ended.

    Those are workers of a pool and, through the launcher that waits for them, MPI ranks; not ranks elsewhere.
    """
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def execute(name: str, function: StageFunction, run: Run, product: Path) -> bool:
    """Run a stage and tell the user how it ended, if it did well.

    Returns:
        Whether it completed. If not, ``.<stage>.partial`` of the run folder has the traceback and the message.
    """
    try:
        record = run_stage(name, function, run, product)
    except Exception as error:  # the boundary of a stage: whatever went wrong is reported with the stage's name
        if is_interrupt(error):
            raise KeyboardInterrupt from error
        _write_message(name, run.folder / f".{name}.partial", error)
        return False
    health_line(name, record["seconds"], record["health"], record["continued"])
    return True


def _write_message(name: str, folder: Path, error: Exception) -> None:
    """Leave traceback and message for the command, which tells the user; say it at once where they cannot be."""
    message = describe_error(error, folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / TRACEBACK).write_text(traceback.format_exc(), encoding="utf-8")
        (folder / MESSAGE).write_text(message, encoding="utf-8")
    except OSError:
        console.print(f"stage {name} failed: {message}", soft_wrap=True)
