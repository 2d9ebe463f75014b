"""The command accuracy: run the convergence study of a case, say what it costs, recommend settings and run them."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.table import Table

from reflowshock.problem import Problem
from reflowshock.units import UnitError, to_si
from reflowshock.workflow.accuracy.recommend import Goal, recommend
from reflowshock.workflow.accuracy.runs import Compute, StudyRunner
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import duration, percent
from reflowshock.workflow.convergence import tables
from reflowshock.workflow.convergence.calibration import calibration, default_folder
from reflowshock.workflow.convergence.measured import FILE, Accuracy, Recommended, fits_of, this_host, write_accuracy
from reflowshock.workflow.convergence.page import PAGE, PICTURE, write_pages
from reflowshock.workflow.convergence.series import ConvergenceStudy
from reflowshock.workflow.jobs import batch
from reflowshock.workflow.kinds import kind_of, stage_seconds
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.process.terminal import progress_bar, styled, text_table
from reflowshock.workflow.store.folders import check_folder, locked
from reflowshock.workflow.store.keys import product_keys
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import failed_checks
from reflowshock.workflow.store.store import Store

WHAT = "accuracy"  # its folder holds
TOLERANCE = 0.02  # where neither a tolerance nor a budget is given
LONGEST = 600.0  # wall time of a run that nobody has given a budget for [s]


@dataclass(frozen=True, slots=True)
class AccuracyRequest:
    """What a user asks for.

    Attributes:
        case: the case file.
        settings: dotted key -> value.
        tolerance: of the judged error; None: the most accurate within the budget.
        budget: wall time that all runs together may take [s]; infinite without a limit.
        command: how it was asked for.
        oversubscribe: whether MPI may have more ranks than cores.
        force: whether values that are not plausible are welcome, and a folder that holds another case.
    """

    case: Path
    settings: Mapping[str, str]
    tolerance: float | None
    budget: float
    command: str
    oversubscribe: bool = False
    force: bool = False

    @property
    def longest(self) -> float:
        """Wall time that a run of the study may take [s]."""
        return LONGEST if self.budget == float("inf") else self.budget

    @property
    def overrides(self) -> list[str]:
        """The settings as options have them."""
        return [f"{key}={value}" for key, value in self.settings.items()]


def read_request(case: Path, settings: Sequence[str], tolerance: str | None, budget: str | None) -> AccuracyRequest:
    """Read what the command line asks for.

    Raises:
        CaseError: a tolerance or a budget that is none.
    """
    given = [("--tolerance", tolerance), ("--budget", budget)]
    options = [item for name, text in given if text is not None for item in (name, text)]
    options += [item for setting in settings for item in ("--set", setting)]
    share = None if tolerance is None else _share(tolerance)
    limit = float("inf") if budget is None else _seconds(budget)
    return AccuracyRequest(
        case,
        dict(_pair(setting) for setting in settings),
        TOLERANCE if tolerance is None and budget is None else share,
        limit,
        shlex.join(["reflowshock", "accuracy", str(case), *options]),
    )


def _pair(setting: str) -> tuple[str, str]:
    """Return key and value of a setting; what is none is refused with the case."""
    key, equals, text = setting.partition("=")
    return (key.strip(), text.strip()) if equals else ("", setting)


def _share(text: str) -> float:
    """Read a share, such as "2%" or "0.02"."""
    number, percent, rest = text.strip().partition("%")
    try:
        share = float(number) * (0.01 if percent else 1.0)
    except ValueError:
        share = 0.0
    if rest or not 0.0 < share < 1.0:  # nan is neither
        message = "is not a valid relative error"
        raise CaseError("command line", [Problem("--tolerance", message, text, '"0.0001%" to "99%", e.g. "2%"')])
    return share


def _seconds(text: str) -> float:
    """Read a time, such as "10min"."""
    try:
        seconds = to_si(text, "s")
    except UnitError as error:
        raise CaseError("command line", [Problem("--budget", str(error), text, 'a time, e.g. "10min"')]) from error
    if not seconds > 0.0:
        raise CaseError("command line", [Problem("--budget", "is not a valid time", text, "> 0 s")])
    return seconds


def measure(
    request: AccuracyRequest, folder: Path, compute: Compute, study: ConvergenceStudy | None = None
) -> tuple[Accuracy, StudyRunner]:
    """Compute what is missing of a case's convergence study, choose settings, run them, and write the results.

    Args:
        request: what is asked for.
        folder: of the store and of what is written.
        compute: computes points.
        study: in place of that of the case's kind.

    Returns:
        What was measured, and how.
    """
    case = read_case(request.case, request.overrides, request.oversubscribe, request.force)
    study = study or kind_of(case).study(case)
    runner = StudyRunner(
        study,
        request.case,
        request.settings,
        folder,
        compute,
        request.budget,
        request.longest,
        request.oversubscribe,
        request.force,
    )
    runner.compute_runs(study.runs)
    measured = runner.measured(study.runs)
    fits = fits_of(study, measured)
    goal = Goal(request.tolerance, runner.left)
    chosen = recommend(study, measured, fits, goal)
    accuracy = Accuracy(
        case.case.name, case.kind, request.command, this_host(), study.errors, tuple(measured.values()), fits,
        request.tolerance, None if chosen is None else _run(chosen, runner), product_keys(case)[study.until],
    )  # fmt: skip
    write_accuracy(folder, accuracy)
    return accuracy, runner


def _run(chosen: Recommended, runner: StudyRunner) -> Recommended:
    """Run what was chosen, if it was not measured, and say what was found."""
    runs = [*(run for run in runner.study.runs if run.name != chosen.run.name), chosen.run]
    runner.compute_runs([chosen.run])
    return replace(chosen, found=runner.measured(runs).get(chosen.run.name))


def show(request: AccuracyRequest, out: Path | None, console: Console) -> bool:
    """Run the command and tell what was found.

    Args:
        request: what is asked for.
        out: folder; None: the default one.
        console: where it is shown.

    Returns:
        Whether the recommendation was run and keeps its promise: the tolerance, where there is one.
    """
    case = read_case(request.case, request.overrides, request.oversubscribe, request.force)
    folder = out or default_folder(case)
    check_folder(folder, WHAT, case.case.name, request.force)
    compute = partial(_compute, request=request, until=kind_of(case).study(case).until)
    accuracy, runner = measure(request, folder, compute)
    tried = (*_left_out(runner), *_impossible(runner), *_failed(runner))
    remarks = (*tried, *unproved(accuracy), *_unhealthy(accuracy, runner), *_own_size(request, accuracy))
    write_pages(folder, accuracy, remarks)
    every = tables.runs(accuracy)
    title = f"\nErrors and costs (smallest of repeated runs) on {accuracy.machine}"
    console.print(text_table(title, every["head"][:-1], [row[:-1] for row in every["rows"]]))
    for remark in (tables.legend(accuracy), *tables.remarks(accuracy)):
        console.print(styled("[dim]{}", remark), soft_wrap=True)
    console.print(
        table(
            tables.orders(accuracy),
            "Observed orders in h, the value of the parameter; cost in core-seconds: t0 + D h^-q",
        )
    )
    for remark in remarks:
        console.print(f"\n{remark}", soft_wrap=True)
    _show_choice(accuracy, console)
    console.print(f"\n{folder / PAGE}, {folder / PICTURE}, {folder / FILE}", soft_wrap=True)
    again = f"reflowshock report {shlex.quote(str(request.case))} {tables.as_options(request.settings)}".rstrip()
    console.print(f"`{again}` takes these errors into the report of a run.", soft_wrap=True, markup=False)
    return keeps_promise(accuracy)


def keeps_promise(accuracy: Accuracy) -> bool:
    """Whether what was recommended was found to be within the tolerance."""
    chosen = accuracy.recommended
    if chosen is None or chosen.found is None or accuracy.judged not in chosen.found.errors:
        return False
    return accuracy.tolerance is None or chosen.found.errors[accuracy.judged].value <= accuracy.tolerance


def _compute(
    store: Store,
    points: Sequence[Point],
    *,
    until: str,
    request: AccuracyRequest,
) -> Mapping[str, str]:
    """Compute points one stage at a time, so that measurements do not disturb each other; show how far it is."""
    again = " again, to measure their times" if store.folder.name.startswith("again") else ""
    with progress_bar(f"{len(points)} point{'s' if len(points) > 1 else ''}{again}") as progress:

        def count() -> None:
            progress(sum(store.is_complete(point, until) for point in points) / len(points))

        machine = batch.Machine(available_cores(), True, request.oversubscribe, each_second=count)
        with locked(store.folder, WHAT, points[0].case.case.name, request.force) as lock:
            return batch.run_points(store, points, until, machine, lock)


def _left_out(runner: StudyRunner) -> list[str]:
    if not runner.left_out:
        return []
    texts = [f"{name} (about {duration(seconds)})" for name, seconds in runner.left_out.items()]
    limited = runner.budget < float("inf")
    why = "did not fit into what was left of the budget" if limited else f"take more than {duration(runner.longest)}"
    more = "" if limited else "; to run them, give a budget, e.g. --budget 10h"
    return [f"Not run because they {why}: {', '.join(texts)}{more}."]


def _impossible(runner: StudyRunner) -> list[str]:
    return [f"Not possible for this case: {name}: {why}" for name, why in runner.impossible.items()]


def _failed(runner: StudyRunner) -> list[str]:
    """Say how runs that failed are tried again, which no call does by itself."""
    work = runner.stores[0].home / "work"
    return [f"Failed runs are not repeated unless you remove {work}."] if runner.failed else []


def unproved(accuracy: Accuracy) -> list[str]:
    """Say that the recommended settings were not run to their end, so that nothing was found of them."""
    chosen = accuracy.recommended
    if chosen is None or tables.prediction(accuracy) is not None:
        return []
    why = chosen.found.failed if chosen.found is not None else "it did not fit into what was left of the budget"
    predicted = f"its error of {percent(chosen.error)} and {chosen.core_seconds:.2f} core-seconds"
    return [f"The recommendation was not run ({why}): {predicted} are predicted, not measured."]


def _unhealthy(accuracy: Accuracy, runner: StudyRunner) -> list[str]:
    """Say which checks of runs do not hold, for which `run` would call them failures."""
    store, texts = runner.stores[0], []
    for one in tables.every_run(accuracy):
        missed = [] if one.failed else failed_checks(store, runner.points[one.run], runner.study.until)
        if missed:
            texts.append(f"Failed checks of {one.run}: {'; '.join(missed)}.")
    return texts


def _own_size(request: AccuracyRequest, accuracy: Accuracy) -> list[str]:
    """Say what the case costs at its own size, as it is and with the recommended settings."""
    own = {key: value for key, value in request.settings.items() if key != "scale"}
    known, chosen = calibration(one.stages for one in accuracy.measurements), accuracy.recommended
    times = [f"{duration(total(known, _case(request.case, own)))} as it is"]
    if chosen is not None and own != request.settings:
        times.append(f"{duration(total(known, _case(request.case, own | dict(chosen.run.settings))))} as recommended")
    how = f"corrected by the measured time of the nearest of {known.points} runs" if known.points else "not measured"
    return [f"Wall time of the case at full size: about {', '.join(times)} (forecast, {how})."]


def _case(path: Path, settings: Mapping[str, str]) -> Case:
    return read_case(path, [f"{key}={value}" for key, value in settings.items()], oversubscribe=True, force=True)


def total(known, case: Case) -> float:
    """Wall time [s] of all stages that have a forecast, corrected by what was measured."""
    return sum(known.seconds(stage, seconds) for stage, seconds in stage_seconds(case).items())


def _show_choice(accuracy: Accuracy, console: Console) -> None:
    chosen = accuracy.recommended
    if chosen is None:
        console.print(styled("\n[bold]Nothing to recommend[/]: no run within the budget has a known error."))
        return
    advice = styled("\n[bold]Recommended: {}[/], {}. In the case file:\n", chosen.run.name, chosen.why)
    console.print(advice, soft_wrap=True)
    for line in tables.as_lines(chosen.run.settings):
        console.print(f"    {line}")
    console.print(f"\nor {tables.as_options(chosen.run.settings)}", soft_wrap=True)
    rows = tables.prediction(accuracy)
    if rows is not None:
        console.print(table(rows, ""))


def table(texts: dict, title: str) -> Table:
    """Lay out head and rows of text."""
    return text_table(f"\n{title}" if title else "", texts["head"], texts["rows"], remarks=texts.get("prose", False))
