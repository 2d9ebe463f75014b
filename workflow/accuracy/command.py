"""The command ``accuracy``: run the convergence study of a case, report errors and costs, recommend settings."""

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
from reflowshock.workflow.convergence.accuracy_file import (
    FILE,
    Accuracy,
    Recommended,
    fit_measurements,
    this_host,
    write_accuracy,
)
from reflowshock.workflow.convergence.calibration import Calibration, calibration_from_runs, default_folder
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy
from reflowshock.workflow.convergence.page import PAGE, PICTURE, write_pages
from reflowshock.workflow.jobs import batch
from reflowshock.workflow.kinds import kind_of, stage_seconds
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.process.terminal import progress_bar, style_text, text_table
from reflowshock.workflow.store.folders import check_folder, lock_folder
from reflowshock.workflow.store.keys import product_keys
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import failed_checks
from reflowshock.workflow.store.store import Store

CONTENT = "accuracy"  # content of the folder, for its marker file
TOLERANCE = 0.02  # default, if neither a tolerance nor a budget is given
LONGEST = 600.0  # largest wall time of a run without a budget [s]


@dataclass(frozen=True, slots=True)
class AccuracyRequest:
    """Request of the user.

    Attributes:
        case: Case file.
        settings: Dotted key -> value.
        tolerance: Tolerance of the judged error; None for the most accurate setting within the budget.
        budget: Wall time for all runs together [s]; infinite without a limit.
        command: Command line of the request.
        oversubscribe: Whether MPI may have more ranks than cores.
        force: Whether implausible values, and a folder with another case, are accepted.
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
        """Largest wall time of a run of the study [s]."""
        return LONGEST if self.budget == float("inf") else self.budget

    @property
    def overrides(self) -> list[str]:
        """Settings in the form of ``--set`` options."""
        return [f"{key}={value}" for key, value in self.settings.items()]


def read_request(case: Path, settings: Sequence[str], tolerance: str | None, budget: str | None) -> AccuracyRequest:
    """Read the request from the command line.

    Args:
        case: Case file.
        settings: Values of the ``--set`` options, "key=value".
        tolerance: Value of ``--tolerance``, such as "2%".
        budget: Value of ``--budget``, such as "10min".

    Returns:
        Case file, settings, tolerance (None with a budget alone), budget [s] and command line.

    Raises:
        CaseError: A tolerance or a budget is invalid.
    """
    limits = [("--tolerance", tolerance), ("--budget", budget)]
    options = [item for name, text in limits if text is not None for item in (name, text)]
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
    """Return key and value of a setting; without "=" the key is empty, which `read_case` rejects."""
    key, equals, text = setting.partition("=")
    return (key.strip(), text.strip()) if equals else ("", setting)


def _share(text: str) -> float:
    """Return a relative error from text such as "2%" or "0.02"."""
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
    """Return a time [s] from text such as "10min"."""
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
    """Run the missing parts of a case's convergence study, recommend settings, run them, and write ``accuracy.json``.

    Args:
        request: Case file, settings, tolerance and budget of the user.
        folder: Folder of the store and the results.
        compute: Function of a store and points that makes their products and returns reasons of failure by key.
        study: Convergence study; None for the study of the case's kind.

    Returns:
        The measured study, and the runner with its points.
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
    measurements = runner.measurements(study.runs)
    fits = fit_measurements(study, measurements)
    goal = Goal(request.tolerance, runner.remaining)
    chosen = recommend(study, measurements, fits, goal)
    recommended = None if chosen is None else _run_recommended(chosen, runner)
    accuracy = Accuracy(
        case.case.name, case.kind, request.command, this_host(), study.errors, tuple(measurements.values()), fits,
        request.tolerance, recommended, product_keys(case)[study.until],
    )  # fmt: skip
    write_accuracy(folder, accuracy)
    return accuracy, runner


def _run_recommended(chosen: Recommended, runner: StudyRunner) -> Recommended:
    """Run the recommended settings unless they are measured, and return them with their measurement."""
    runs = [*(run for run in runner.study.runs if run.name != chosen.run.name), chosen.run]
    runner.compute_runs([chosen.run])
    return replace(chosen, found=runner.measurements(runs).get(chosen.run.name))


def show(request: AccuracyRequest, out: Path | None, console: Console) -> bool:
    """Run the command and print its results.

    Args:
        request: Case file, settings, tolerance and budget of the user.
        out: Output folder; None for the default one.
        console: Console to print to.

    Returns:
        Whether the recommendation was run and satisfies the tolerance, if there is one.
    """
    case = read_case(request.case, request.overrides, request.oversubscribe, request.force)
    folder = out or default_folder(case)
    check_folder(folder, CONTENT, case.case.name, request.force)
    compute = partial(_compute, request=request, until=kind_of(case).study(case).until)
    accuracy, runner = measure(request, folder, compute)
    missing = (*_left_out(runner), *_impossible(runner), *_failed(runner))
    remarks = (*missing, *remark_unverified(accuracy), *_unhealthy(accuracy, runner), *_full_size(request, accuracy))
    write_pages(folder, accuracy, remarks)
    runs = tables.runs(accuracy)
    title = f"\nErrors and costs (smallest of repeated runs) on {accuracy.machine}"
    console.print(text_table(title, runs["head"][:-1], [row[:-1] for row in runs["rows"]]))
    for remark in (tables.legend(accuracy), *tables.remarks(accuracy)):
        console.print(style_text("[dim]{}", remark), soft_wrap=True)
    console.print(
        table(
            tables.orders(accuracy),
            "Observed orders in the parameter value h; cost in core-seconds: t0 + D h^-q",
        )
    )
    for remark in remarks:
        console.print(f"\n{remark}", soft_wrap=True)
    _show_recommendation(accuracy, console)
    console.print(f"\n{folder / PAGE}, {folder / PICTURE}, {folder / FILE}", soft_wrap=True)
    report = f"reflowshock report {shlex.quote(str(request.case))} {tables.as_options(request.settings)}".rstrip()
    console.print(f"`{report}` includes these errors in the report of a run.", soft_wrap=True, markup=False)
    return is_within_tolerance(accuracy)


def is_within_tolerance(accuracy: Accuracy) -> bool:
    """Return whether the recommended settings were run and their measured error is within the user's tolerance.

    Args:
        accuracy: Convergence study; without a tolerance any measured error is accepted.
    """
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
    """Compute points one stage at a time, so that measurements do not disturb each other, and show the progress."""
    suffix = " again, to measure their times" if store.folder.name.startswith("again") else ""
    with progress_bar(f"{len(points)} point{'s' if len(points) > 1 else ''}{suffix}") as progress:

        def count() -> None:
            progress(sum(store.is_complete(point, until) for point in points) / len(points))

        machine = batch.Machine(available_cores(), True, request.oversubscribe, each_second=count)
        with lock_folder(store.folder, CONTENT, points[0].case.case.name, request.force) as lock:
            return batch.run_points(store, points, until, machine, lock)


def _left_out(runner: StudyRunner) -> list[str]:
    if not runner.left_out:
        return []
    texts = [f"{name} (about {duration(seconds)})" for name, seconds in runner.left_out.items()]
    limited = runner.budget < float("inf")
    reason = "exceed the remaining budget" if limited else f"take more than {duration(runner.longest)}"
    advice = "" if limited else "; to run them, set a budget, e.g. --budget 10h"
    return [f"Not run because they {reason}: {', '.join(texts)}{advice}."]


def _impossible(runner: StudyRunner) -> list[str]:
    return [f"Not possible for this case: {name}: {problem}" for name, problem in runner.impossible.items()]


def _failed(runner: StudyRunner) -> list[str]:
    """Return the advice on how to repeat failed runs."""
    work = runner.stores[0].home / "work"
    return [f"Failed runs are not repeated unless you remove {work}."] if runner.failed else []


def remark_unverified(accuracy: Accuracy) -> list[str]:
    """Return a remark if the recommended settings were not run, so that their error is predicted only.

    Args:
        accuracy: Convergence study with its recommendation.

    Returns:
        List with one sentence, which gives the reason; empty if they were run successfully.
    """
    chosen = accuracy.recommended
    if chosen is None or tables.prediction(accuracy) is not None:
        return []
    reason = chosen.found.failed if chosen.found is not None else "it exceeds the remaining budget"
    predicted = f"its error of {percent(chosen.error)} and {chosen.core_seconds:.2f} core-seconds"
    return [f"The recommendation was not run ({reason}): {predicted} are predicted, not measured."]


def _unhealthy(accuracy: Accuracy, runner: StudyRunner) -> list[str]:
    """Return the failed health checks of all runs."""
    store, texts = runner.stores[0], []
    for m in tables.all_measurements(accuracy):
        checks = [] if m.failed else failed_checks(store, runner.points[m.run], runner.study.until)
        if checks:
            texts.append(f"Failed checks of {m.run}: {'; '.join(checks)}.")
    return texts


def _full_size(request: AccuracyRequest, accuracy: Accuracy) -> list[str]:
    """Return the predicted wall time of the case at full size, unchanged and with the recommended settings."""
    settings = {key: value for key, value in request.settings.items() if key != "scale"}
    chosen = accuracy.recommended
    calibration = calibration_from_runs(measurement.stages for measurement in accuracy.measurements)
    times = [f"{duration(total(calibration, _case(request.case, settings)))} unchanged"]
    if chosen is not None and settings != request.settings:
        recommended = _case(request.case, settings | dict(chosen.run.settings))
        times.append(f"{duration(total(calibration, recommended))} with the recommended settings")
    source = "not measured"
    if calibration.points:
        source = f"corrected by the measured time of the nearest of {calibration.points} runs"
    return [f"Wall time of the case at full size: about {', '.join(times)} (forecast, {source})."]


def _case(path: Path, settings: Mapping[str, str]) -> Case:
    return read_case(path, [f"{key}={value}" for key, value in settings.items()], oversubscribe=True, force=True)


def total(calibration: Calibration, case: Case) -> float:
    """Return the predicted wall time of all stages of a case, corrected by measured times [s].

    Args:
        calibration: Predicted and measured times of earlier runs.
        case: Case to predict.
    """
    return sum(calibration.corrected(stage, seconds) for stage, seconds in stage_seconds(case).items())


def _show_recommendation(accuracy: Accuracy, console: Console) -> None:
    chosen = accuracy.recommended
    if chosen is None:
        console.print(style_text("\n[bold]No recommendation[/]: no run within the budget has a known error."))
        return
    advice = style_text("\n[bold]Recommended: {}[/], {}. In the case file:\n", chosen.run.name, chosen.why)
    console.print(advice, soft_wrap=True)
    for line in tables.as_lines(chosen.run.settings):
        console.print(f"    {line}")
    console.print(f"\nor {tables.as_options(chosen.run.settings)}", soft_wrap=True)
    rows = tables.prediction(accuracy)
    if rows is not None:
        console.print(table(rows, ""))


def table(texts: dict, title: str) -> Table:
    """Return a table for the terminal.

    Args:
        texts: Table with ``head`` (column titles) and ``rows`` (lists of text).
        title: Title of the table.

    Returns:
        Table of rich with the same columns and rows.
    """
    return text_table(f"\n{title}" if title else "", texts["head"], texts["rows"], remarks=texts.get("prose", False))
