"""Stage runner: runs a stage in a partial folder, records inputs and results, and publishes the product."""

import resource
import time
import traceback
from pathlib import Path

from reflowshock.workflow.case.run import Run, StageError, StageFunction
from reflowshock.workflow.case.stage import SHOCK, Stage
from reflowshock.workflow.convergence.accuracy_file import this_host
from reflowshock.workflow.kinds import stage_seconds
from reflowshock.workflow.process.error_exit import describe_error, is_interrupt
from reflowshock.workflow.process.kernel_folder import compilation_time
from reflowshock.workflow.process.machine_speed import measure_after
from reflowshock.workflow.process.terminal import console, health_line
from reflowshock.workflow.store.keys import compare, product_key, stage_inputs
from reflowshock.workflow.store.product import discard, publish, read_record, seal
from reflowshock.workflow.store.store import MESSAGE, TRACEBACK, reads


def run_stage(name: str, function: StageFunction, run: Run, product: Path) -> dict:
    """Run a stage; its complete product is published atomically.

    Args:
        name: Name of the stage.
        function: Stage function, which writes products into a folder and returns findings.
        run: Input of the stage.
        product: Folder of the product; an existing one is replaced.

    Returns:
        Content of ``stage.json``: seconds and core_seconds (measured), forecast [s], machine, metrics, health, effects,
        continued, key, inputs, reads (digests of upstream products), files (digests).

    Raises:
        StageError: An input file has changed since the start of the command, or a product is missing.
    """
    stage, partial = run.case.pipeline[name], run.folder / f".{name}.partial"
    before = {"inputs": stage_inputs(run.case, stage), "reads": _reads(run, stage)}
    key = product.name.rpartition("-")[2]
    _check_key(run, stage, before["inputs"], key)
    discard(partial)
    partial.mkdir(parents=True)
    predicted = stage_seconds(run.case).get(name, 0.0)
    forecast = predicted + compilation_time([name])
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
    if name == SHOCK:
        measure_after(predicted)
    return record


def _reads(run: Run, stage: Stage) -> dict[str, str | None]:
    return reads({name: run.folder / name for name in run.case.pipeline.names}, run.case, stage)


def _check_key(run: Run, stage: Stage, inputs: dict, key: str) -> None:
    """Raise if the inputs of a stage no longer match the key of its product."""
    follows = [(read_record(run.folder / name) or {}).get("key") for name in stage.follows]
    if None not in follows and product_key(run.case, stage, inputs, follows) != key:
        raise StageError("a file of the case or the program itself has changed since the command started; run it again")


def _check(run: Run, stage: Stage, before: dict, partial: Path) -> None:
    """Raise if inputs have changed during the stage, or products are missing."""
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
    """Return the processor time of this process and its ended children on this machine [s].

    This includes pool workers and local MPI ranks, but not ranks on other machines.
    """
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def execute(name: str, function: StageFunction, run: Run, product: Path) -> bool:
    """Run a stage and print its result, or write its error message to the work folder.

    Args:
        name: Name of the stage.
        function: Stage function, which writes products into a folder and returns findings.
        run: Input of the stage.
        product: Folder of the product; an existing one is replaced.

    Returns:
        Whether the stage completed. If not, traceback and message are in ``.<stage>.partial`` of the run folder.
    """
    try:
        record = run_stage(name, function, run, product)
    except Exception as error:  # any error is reported with the name of the stage
        if is_interrupt(error):
            raise KeyboardInterrupt from error
        _write_message(name, run.folder / f".{name}.partial", error)
        return False
    health_line(name, record["seconds"], record["health"], record["continued"])
    return True


def _write_message(name: str, folder: Path, error: Exception) -> None:
    """Write traceback and message for the command, which reports them; print the message if this fails."""
    message = describe_error(error, folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / TRACEBACK).write_text(traceback.format_exc(), encoding="utf-8")
        (folder / MESSAGE).write_text(message, encoding="utf-8")
    except OSError:
        console.print(f"stage {name} failed: {message}", soft_wrap=True)
