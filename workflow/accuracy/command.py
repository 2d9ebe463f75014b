"""The command accuracy: climb the ladder of a case, tell what it costs, recommend, and run the recommendation."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.table import Table

from reflowshock.problem import Problem
from reflowshock.workflow.accuracy.recommend import Goal, recommend
from reflowshock.workflow.accuracy.runs import Climb, Compute
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import duration, percent
from reflowshock.workflow.case.units import UnitError, to_si
from reflowshock.workflow.convergence import tables
from reflowshock.workflow.convergence.calibration import calibration, default_folder
from reflowshock.workflow.convergence.machine import this_machine
from reflowshock.workflow.convergence.measured import FILE, Accuracy, Recommended, fits_of, write_accuracy
from reflowshock.workflow.convergence.page import PAGE, PICTURE, write_pages
from reflowshock.workflow.convergence.series import Ladder
from reflowshock.workflow.jobs import batch
from reflowshock.workflow.kinds import kind_of, stage_seconds
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.process.progress import progress_bar
from reflowshock.workflow.process.terminal import styled
from reflowshock.workflow.store.folders import check_folder, locked
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import failed_checks
from reflowshock.workflow.store.store import Store

WHAT = "accuracy"  # its folder holds
TOLERANCE = 0.02  # where neither a tolerance nor a budget is given
LONGEST = 600.0  # wall time of a run that nobody has given a budget for [s]


@dataclass(frozen=True, slots=True)
class Wish:
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
        """Wall time that a run of the ladder may take [s]."""
        return LONGEST if self.budget == float("inf") else self.budget

    @property
    def overrides(self) -> list[str]:
        """The settings as options have them."""
        return [f"{key}={value}" for key, value in self.settings.items()]


def read_wish(case: Path, settings: Sequence[str], tolerance: str | None, budget: str | None) -> Wish:
    """Read what the command line asks for.

    Raises:
        CaseError: a tolerance or a budget that is none.
    """
    given = [("--tolerance", tolerance), ("--budget", budget)]
    options = [item for name, text in given if text is not None for item in (name, text)]
    options += [item for setting in settings for item in ("--set", setting)]
    share = None if tolerance is None else _share(tolerance)
    limit = float("inf") if budget is None else _seconds(budget)
    return Wish(
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
        message = "is no share of the answer"
        raise CaseError("command line", [Problem("--tolerance", message, text, '"0.0001%" to "99%", e.g. "2%"')])
    return share


def _seconds(text: str) -> float:
    """Read a time, such as "10min"."""
    try:
        seconds = to_si(text, "s")
    except UnitError as error:
        raise CaseError("command line", [Problem("--budget", str(error), text, 'a time, e.g. "10min"')]) from error
    if not seconds > 0.0:
        raise CaseError("command line", [Problem("--budget", "is no time to spend", text, "> 0 s")])
    return seconds


def measure(wish: Wish, folder: Path, compute: Compute, ladder: Ladder | None = None) -> tuple[Accuracy, Climb]:
    """Measure what is missing of a case's ladder, choose settings, run them, and write all of it.

    Args:
        wish: what is asked for.
        folder: of the store and of what is written.
        compute: computes points.
        ladder: in place of that of the case's kind.

    Returns:
        What was measured, and how.
    """
    case = read_case(wish.case, wish.overrides, wish.oversubscribe, wish.force)
    ladder = ladder or kind_of(case).ladder(case)
    climb = Climb(
        ladder, wish.case, wish.settings, folder, compute, wish.budget, wish.longest, wish.oversubscribe, wish.force
    )
    climb.climb(ladder.rungs)
    measured = climb.measured(ladder.rungs)
    fits = fits_of(ladder, measured)
    goal = Goal(wish.tolerance, climb.left)
    chosen = recommend(ladder, measured, fits, goal)
    accuracy = Accuracy(
        case.case.name, case.kind, wish.command, this_machine(), ladder.errors, tuple(measured.values()), fits,
        wish.tolerance, None if chosen is None else _run(chosen, climb),
    )  # fmt: skip
    write_accuracy(folder, accuracy)
    return accuracy, climb


def _run(chosen: Recommended, climb: Climb) -> Recommended:
    """Run what was chosen, if it was not measured, and say what was found."""
    rungs = [*(rung for rung in climb.ladder.rungs if rung.name != chosen.rung.name), chosen.rung]
    climb.climb([chosen.rung])
    return replace(chosen, found=climb.measured(rungs).get(chosen.rung.name))


def show(wish: Wish, out: Path | None, console: Console) -> bool:
    """Run the command and tell what was found.

    Args:
        wish: what is asked for.
        out: folder; None: the default one.
        console: where it is told.

    Returns:
        Whether the recommendation was run and keeps its promise: the tolerance, where there is one.
    """
    case = read_case(wish.case, wish.overrides, wish.oversubscribe, wish.force)
    folder = out or default_folder(case)
    check_folder(folder, WHAT, case.case.name, wish.force)
    compute = partial(_compute, wish=wish, until=kind_of(case).ladder(case).until)
    accuracy, climb = measure(wish, folder, compute)
    tried = (*_left_out(climb), *_impossible(climb), *_failed(climb))
    remarks = (*tried, *unproved(accuracy), *_unhealthy(accuracy, climb), *_own_size(wish, accuracy))
    write_pages(folder, accuracy, remarks)
    console.print(
        table(tables.runs(accuracy), f"Errors and costs, the least of all times that it was run: {accuracy.machine}")
    )
    console.print(styled("[dim]{}", tables.legend(accuracy)), soft_wrap=True)
    console.print(table(tables.orders(accuracy), "Orders in h, the value of a knob; core-seconds t0 + D h^-q"))
    for remark in remarks:
        console.print(f"\n{remark}", soft_wrap=True)
    _show_choice(accuracy, console)
    console.print(f"\n{folder / PAGE}, {folder / PICTURE}, {folder / FILE}", soft_wrap=True)
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
    wish: Wish,
) -> Mapping[str, str]:
    """Compute points one stage at a time, so that measurements do not disturb each other; show how far it is."""
    again = " once more, for their times" if store.folder.name.startswith("again") else ""
    with progress_bar(f"{len(points)} point{'s' if len(points) > 1 else ''}{again}") as progress:

        def count() -> None:
            progress(sum(store.is_complete(point, until) for point in points) / len(points))

        machine = batch.Machine(available_cores(), True, wish.oversubscribe, each_second=count)
        with locked(store.folder, WHAT, points[0].case.case.name, wish.force) as lock:
            return batch.run_points(store, points, until, machine, lock)


def _left_out(climb: Climb) -> list[str]:
    if not climb.left_out:
        return []
    texts = [f"{name} (about {duration(seconds)})" for name, seconds in climb.left_out.items()]
    limited = climb.budget < float("inf")
    why = "did not fit into what was left of the budget" if limited else f"take more than {duration(climb.longest)}"
    more = "" if limited else "; a budget pays for them, e.g. --budget 10h"
    return [f"Not run, since they {why}: {', '.join(texts)}{more}."]


def _impossible(climb: Climb) -> list[str]:
    return [f"Not possible for this case: {name}: {why}" for name, why in climb.impossible.items()]


def _failed(climb: Climb) -> list[str]:
    """Say how runs that failed are tried again, which no call does by itself."""
    work = climb.stores[0].home / "work"
    return [f"Runs that failed are not tried again, unless you remove {work}."] if climb.failed else []


def unproved(accuracy: Accuracy) -> list[str]:
    """Say that the recommended settings were not run to their end, so that nothing was found of them."""
    chosen = accuracy.recommended
    if chosen is None or tables.prediction(accuracy) is not None:
        return []
    why = chosen.found.failed if chosen.found is not None else "it did not fit into what was left of the budget"
    foreseen = f"its error of {percent(chosen.error)} and {chosen.core_seconds:.2f} core-seconds"
    return [f"The recommendation was not run ({why}): {foreseen} are foreseen, not found."]


def _unhealthy(accuracy: Accuracy, climb: Climb) -> list[str]:
    """Say which checks of the recommended run do not hold, for which `run` would call it a failure."""
    chosen = accuracy.recommended
    if chosen is None or chosen.found is None or chosen.found.failed:
        return []
    point = climb.points[chosen.rung.name]
    missed = failed_checks(climb.stores[0], point, climb.ladder.until)
    return [f"Checks of the recommended run that do not hold: {'; '.join(missed)}."] if missed else []


def _own_size(wish: Wish, accuracy: Accuracy) -> list[str]:
    """Say what the case costs at its own size, as it is and with the recommended settings."""
    own = {key: value for key, value in wish.settings.items() if key != "scale"}
    known, chosen = calibration(one.stages for one in accuracy.measurements), accuracy.recommended
    told = [f"{duration(total(known, _case(wish.case, own)))} as it is"]
    if chosen is not None and own != wish.settings:
        told.append(f"{duration(total(known, _case(wish.case, own | dict(chosen.rung.settings))))} as recommended")
    how = f"times measured over foreseen of the nearest of {known.points} points" if known.points else "not measured"
    return [f"Wall time of the case at its own size: about {', '.join(told)} (forecast, {how})."]


def _case(path: Path, settings: Mapping[str, str]) -> Case:
    return read_case(path, [f"{key}={value}" for key, value in settings.items()], oversubscribe=True, force=True)


def total(known, case: Case) -> float:
    """Wall time [s] of all stages that have a forecast, corrected by what was measured."""
    return sum(known.seconds(stage, seconds) for stage, seconds in stage_seconds(case).items())


def _show_choice(accuracy: Accuracy, console: Console) -> None:
    chosen = accuracy.recommended
    if chosen is None:
        console.print(styled("\n[bold]Nothing to recommend[/]: no run has a known error within the budget."))
        return
    advice = styled("\n[bold]Recommended: {}[/], {}. In the case file:\n", chosen.rung.name, chosen.why)
    console.print(advice, soft_wrap=True)
    for line in tables.as_lines(chosen.rung.settings):
        console.print(f"    {line}")
    console.print(f"\nor {tables.as_options(chosen.rung.settings)}", soft_wrap=True)
    told = tables.prediction(accuracy)
    if told is not None:
        console.print(table(told, ""))


def table(texts: dict, title: str) -> Table:
    """Lay out head and rows of text; the last column takes what room is left."""
    shown = Table(
        title=f"\n{title}" if title else None, title_justify="left", title_style="bold", show_edge=False, pad_edge=False
    )
    for place, name in enumerate(texts["head"]):
        last = place == len(texts["head"]) - 1
        shown.add_column(name, no_wrap=not last, justify="left" if last or place == 0 else "right")
    for row in texts["rows"]:
        shown.add_row(*row)
    return shown
