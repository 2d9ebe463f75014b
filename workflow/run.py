"""The commands run, report, verify and clean: what they do with a run folder, and what the user sees."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.jobs.batch import Machine, failure_of, run_points, show_products
from reflowshock.workflow.pipeline.points import read_case_of_run
from reflowshock.workflow.pipeline.stage_runner import execute
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.process.terminal import console, print_error, styled
from reflowshock.workflow.store.folders import locked, read_mark, remove_own
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.state import StageState, examine, failed_checks, why_stale
from reflowshock.workflow.store.store import TRACEBACK, Store
from reflowshock.workflow.store.view import adopt, not_as_put, remove_unused, withdraw_all

WHAT = "run"  # a run folder holds
REPORT = "report"
COLOURS = {"PASS": "green", "FAIL": "red", "NO LIMIT": "default"}


@dataclass(frozen=True, slots=True)
class Ended:
    """How a run ended: whether all products are there and every health check holds, and the verdict on the design."""

    healthy: bool
    verdict: str = ""


def run_case(store: Store, point: Point, until: str, machine: Machine, *, force: bool = False) -> Ended:
    """Make what is missing, stale or damaged of a run, and tell how it ended.

    Args:
        store: of the run folder.
        point: the case.
        until: the last stage.
        machine: what it is computed with.
        force: whether the folder may hold another case.

    Returns:
        How it ended; the verdict is empty where there is no report, or nothing in the case is judged.

    Raises:
        CaseError: the folder must not, or cannot be written into.
        RunFolderBusy: another process is at work in it.
    """
    with locked(store.folder, WHAT, point.case.case.name, force) as lock:
        states = examine(store, point)
        wanted = {stage.name: states[stage.name] for stage in point.case.pipeline.upstream(until)}
        _tell_damage(wanted)
        for name in show_products(store, point):
            console.print(f"restored {store.folder / name}")
        if any(state.stale for state in wanted.values()):
            watched = replace(machine, each_second=machine.each_second or _shower(store, point))
            run_points(store, [point], until, watched, lock)
        else:
            console.print(f"nothing to do: {store.folder} is up to date")
        failure = failure_of(store, point, until)
    if failure:
        _tell_failure(store, point, *failure)
        return Ended(healthy=False)
    failures = failed_checks(store, point, until)
    for failed in failures:
        print_error(failed)
    return Ended(not failures, _conclude(store, point) if until == REPORT else "")


def _conclude(store: Store, point: Point) -> str:
    """Tell where the report is, its warnings and, last, its answer; return the verdict on the design."""
    console.print(f"report: {store.folder / 'report.html'}")
    summary = read_json(store.product(point, REPORT) / "summary.json")
    for warning in summary.get("warnings", ()):
        console.print(styled("[bold yellow]warning:[/] {}", warning), soft_wrap=True)
    if "verdict" not in summary:
        return ""
    design = summary["verdict"]["design"]
    console.print(styled(f"[bold {COLOURS[design]}]{{}}[/]", summary["answer"]), soft_wrap=True)
    return design


def check_movie(path: Path) -> None:
    """Refuse a file that a GIF cannot be written to.

    Raises:
        CaseError: it is not a GIF by its name, it exists and is none, or its folder does not exist.
    """
    why = ""
    if path.suffix.lower() != ".gif":
        why = "is not the name of a GIF; allowed: FILE.gif"
    elif not path.parent.is_dir():
        why = f"cannot be written: there is no folder {path.parent}"
    elif path.exists() and (path.is_dir() or path.read_bytes()[:3] != b"GIF"):
        why = "exists and is not a GIF; give another --movie"
    if why:
        raise CaseError(str(path), [Problem("", why)])


def write_run_movie(folder: Path, path: Path) -> None:
    """Write what moves in the report of a run as a GIF.

    Raises:
        CaseError: nothing moves in it, since the stage that would has not run.
    """
    from reflowshock.workflow.pipeline.report import moving_scene
    from reflowshock.workflow.report.movie import write_movie

    scene = moving_scene(folder, read_case_of_run(folder))
    if scene is None:
        raise CaseError(str(folder), [Problem("", "has nothing that moves: its drop, or its reflow, has not been run")])
    write_movie(scene, path)
    console.print(f"movie: {path}, {len(scene.frames)} frames, {path.stat().st_size / 1e6:.2g} MB")


def report_again(folder: Path, name: str, write: Callable[[Path, Case, Path], object], stage: Callable) -> bool:
    """Write the report of a run folder again, from the products that are there and the case that they were made of.

    Where products are missing the report says what is there, and is no product: the next run replaces it.

    Args:
        folder: the run folder.
        name: of its case.
        write: writes a report of a run folder and a case into a folder.
        stage: function of the stage that does so.

    Returns:
        Whether it was written; not where a product is damaged.

    Raises:
        CaseError: nothing was run in the folder.
    """
    case = read_case_of_run(folder)
    store, point = Store(folder, one_run=True), Point({}, case)
    with locked(folder, WHAT, name):
        states = examine(store, point)
        upstream = {one: states[one] for one in point.case.pipeline.names[:-1]}
        if _tell_damage(upstream, "run makes it again"):
            return False
        if any(state.stale for state in upstream.values()):
            show_products(store, point)
            _adopt_report(store, folder, case, write)
            return True
        store.prepare_work(point, REPORT)
        work = store.work_folder(point, REPORT)
        done = execute(REPORT, stage, Run(work, case, 1), store.product(point, REPORT))
        show_products(store, point)
        store.drop_work(point, REPORT)
    if not done and (failure := failure_of(store, point, REPORT)):
        _tell_failure(store, point, *failure)
    return done


def _adopt_report(store: Store, folder: Path, case: Case, write: Callable[[Path, Case, Path], object]) -> None:
    """Write a report that is no product, and put it into the run folder when it is complete."""
    made = store.home / "work" / REPORT
    discard(made)
    made.mkdir(parents=True)
    write(folder, case, made)
    adopt(store, folder, made)
    discard(made)


def verify(store: Store, point: Point) -> bool:
    """Look at every file of a run, in its store and in its folder, and tell what is damaged or missing.

    Returns:
        Whether every product is there and as it was written, and so is what the run folder shows.
    """
    states = examine(store, point)
    for name, state in states.items():
        if state.damaged:
            print_error(f"{name}: {why_stale(state)}")
        elif state.stale:
            print_error(
                f"{name}: {why_stale(state)}" if state.missing else f"{name}: belongs to other settings of this case"
            )
        else:
            record = store.record(point, name) or {"files": {}}
            console.print(f"ok     {name:<11} {len(record['files']) + 1} files")
    lost = not_as_put(store, store.folder)
    for fault in lost:
        print_error(f"{fault}; `reflowshock run` restores it")
    return not lost and not any(state.stale for state in states.values())


def clean(folder: Path, name: str, *, unused: bool = False, force: bool = False) -> None:
    """Remove what the program has written into a run folder; what a user has put there stays.

    Args:
        folder: the run folder.
        name: of the case.
        unused: remove only products that the run folder does not show, and work that was broken off.
        force: whether the folder may hold another case, a study or a convergence study: all that is in it is removed.

    Raises:
        CaseError: the folder holds another case.
        RunFolderBusy: a run is at work in it.
    """
    mark = read_mark(folder)
    if mark is None:
        console.print(f"nothing to remove: {folder} is not a run folder")
        return
    with locked(folder, *((mark["holds"], mark["name"]) if force else (WHAT, name))):
        store = Store(folder)
        if unused:
            products, works = remove_unused(store)
            removed = [_count(products, "unused product"), *([_count(works, "unfinished stage")] if works else [])]
            console.print(f"removed {' and '.join(removed)} from {folder}")
            return
        for one in (*(one for one in store.repeated if one.home.is_dir()), store):
            withdraw_all(one)
            left = remove_own(one.folder)
    console.print(f"removed {folder}" if not folder.exists() else f"removed all products from {folder}")
    if left:
        console.print(f"kept files that the program did not write: {', '.join(left)}")


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _shower(store: Store, point: Point) -> Callable[[], None]:
    """Return what shows a product in the run folder soon after it was made, when it is called now and then."""
    there = [0]

    def show_new() -> None:
        count = sum(store.has(point, stage) for stage in point.digests)
        if count != there[0]:
            there[0] = count
            show_products(store, point)

    return show_new


def _tell_damage(states: dict[str, StageState], what: str = "it is made again") -> bool:
    """Tell which products are damaged; return whether any is."""
    damaged = {name: state for name, state in states.items() if state.damaged}
    for name, state in damaged.items():
        print_error(f"product {name} is damaged ({', '.join(state.damaged)}): {what}")
    return bool(damaged)


def _tell_failure(store: Store, point: Point, stage: str, message: str) -> None:
    traceback = store.work_folder(point, stage) / f".{stage}.partial" / TRACEBACK
    place = f"\ntraceback: {traceback}" if traceback.is_file() else ""
    print_error(f"stage {stage} failed: {message}{place}")
