"""Commands run, report, verify and clean: operations on a run folder, and their output."""

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
from reflowshock.workflow.process.terminal import console, print_error, style_text
from reflowshock.workflow.store.folders import lock_folder, read_mark, remove_program_files
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.state import StageState, examine, failed_checks, why_stale
from reflowshock.workflow.store.store import TRACEBACK, Store
from reflowshock.workflow.store.view import adopt, altered_files, list_program_files, remove_all_links, remove_unused

WHAT = "run"  # kind of content in the mark of a run folder
REPORT = "report"
COLOURS = {"PASS": "green", "FAIL": "red", "NO LIMIT": "default"}


@dataclass(frozen=True, slots=True)
class Ended:
    """Result of a run: whether all products exist and all health checks pass, and the verdict on the design."""

    healthy: bool
    verdict: str = ""


def run_case(store: Store, point: Point, until: str, machine: Machine, *, force: bool = False) -> Ended:
    """Make the missing, stale and damaged products of a run and print the result.

    Args:
        store: Store of the run folder.
        point: Case of the run.
        until: Last stage to run.
        machine: Resources of the computation.
        force: Whether the folder may contain another case.

    Returns:
        Whether the run is complete and healthy, and the verdict, empty without a report or without limits in the case.

    Raises:
        CaseError: The folder belongs to something else, is not writable, or contains an input of the case.
        RunFolderBusy: Another process is running in the folder.
    """
    _check_inputs(store, point)
    with lock_folder(store.folder, WHAT, point.case.case.name, force) as lock:
        states = examine(store, point)
        required = {stage.name: states[stage.name] for stage in point.case.pipeline.upstream(until)}
        _tell_damage(required)
        for name in show_products(store, point):
            console.print(f"restored {store.folder / name}")
        if any(state.stale for state in required.values()):
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


def _check_inputs(store: Store, point: Point) -> None:
    """Raise CaseError if an input file of the case is a product in its own run folder, which the run would replace."""
    folder, own = store.folder.resolve(), list_program_files(store, store.folder)
    inside = {key: path for key, path in point.case.files.items() if path.resolve().is_relative_to(folder)}
    for key, path in inside.items():
        if path.resolve().relative_to(folder).as_posix() in own:
            message = "lies in the folder of this run, which replaces it; choose another --out"
            raise CaseError(point.case.case.name, [Problem(key, message, str(path))])


def _conclude(store: Store, point: Point) -> str:
    """Print the path of the report, its warnings and its answer; return the verdict on the design."""
    console.print(f"report: {store.folder / 'report.html'}")
    summary = read_json(store.product(point, REPORT) / "summary.json")
    for warning in summary.get("warnings", ()):
        console.print(style_text("[bold yellow]warning:[/] {}", warning), soft_wrap=True)
    if "answer" not in summary:
        return ""
    design = summary["verdict"]["design"]
    console.print(style_text(f"[bold {COLOURS[design]}]{{}}[/]", summary["answer"]), soft_wrap=True)
    return design


def check_movie(path: Path) -> None:
    """Check that a GIF can be written to a path.

    Args:
        path: Path of the GIF; an existing GIF may be replaced.

    Raises:
        CaseError: The name does not end in .gif, another file exists there, or the folder is missing.
    """
    why = ""
    if path.suffix.lower() != ".gif":
        why = "is not the name of a GIF; allowed: FILE.gif"
    elif not path.parent.is_dir():
        why = f"cannot be written: folder {path.parent} does not exist"
    elif path.exists() and (path.is_dir() or path.read_bytes()[:3] != b"GIF"):
        why = "exists and is not a GIF; give another --movie"
    if why:
        raise CaseError(str(path), [Problem("", why)])


def write_run_movie(folder: Path, path: Path) -> None:
    """Write the first animated scene of a report as a GIF.

    Args:
        folder: Run folder, whose products are read.
        path: GIF to write; an existing one is replaced.

    Raises:
        CaseError: No scene is animated, since its stage has not run.
    """
    from reflowshock.workflow.pipeline.report import moving_scene
    from reflowshock.workflow.report.movie import write_movie

    scene = moving_scene(folder, read_case_of_run(folder))
    if scene is None:
        raise CaseError(str(folder), [Problem("", "has no animated scene; run its drop or reflow first")])
    write_movie(scene, path)
    console.print(f"movie: {path}, {len(scene.frames)} frames, {path.stat().st_size / 1e6:.2g} MB")


def report_again(folder: Path, name: str, write: Callable[[Path, Case, Path], object], stage: Callable) -> bool:
    """Rewrite the report of a run folder from its existing products and its stored case.

    If products are missing, the report is partial and not stored as a product: the next run replaces it.

    Args:
        folder: Run folder.
        name: Name of its case.
        write: Function that writes the report of a run folder and a case into a folder.
        stage: Stage function of the report.

    Returns:
        Whether the report was written; False if a product is damaged.

    Raises:
        CaseError: Nothing was run in the folder.
    """
    case = read_case_of_run(folder)
    store, point = Store(folder, one_run=True), Point({}, case)
    with lock_folder(folder, WHAT, name):
        states = examine(store, point)
        upstream = {stage_name: states[stage_name] for stage_name in point.case.pipeline.names[:-1]}
        if _tell_damage(upstream, "`reflowshock run` rebuilds it"):
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
    """Write a partial report and move it into the run folder when it is complete."""
    made = store.home / "work" / REPORT
    discard(made)
    made.mkdir(parents=True)
    write(folder, case, made)
    adopt(store, folder, made)
    discard(made)


def verify(store: Store, point: Point) -> bool:
    """Check every file of a run, in its store and in its folder, and print damaged and missing ones.

    Args:
        store: Store of the run folder; nothing is changed.
        point: Case of the run with its settings.

    Returns:
        Whether all products and all files of the run folder are present and unmodified.
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
    lost = altered_files(store, store.folder)
    for fault in lost:
        print_error(f"{fault}; `reflowshock run` restores it")
    return not lost and not any(state.stale for state in states.values())


def clean(folder: Path, name: str, *, unused: bool = False, force: bool = False) -> None:
    """Remove the files of the program from a run folder; files of the user stay.

    Args:
        folder: The run folder.
        name: Name of the case.
        unused: Whether to remove only products without links in the run folder, and interrupted work.
        force: Whether to clean the folder even if it contains another case, a study or a convergence study.

    Raises:
        CaseError: The folder contains another case.
        RunFolderBusy: A run is active in the folder.
    """
    mark = read_mark(folder)
    if mark is None:
        console.print(f"nothing to remove: {folder} is not a run folder")
        return
    with lock_folder(folder, *((mark["holds"], mark["name"]) if force else (WHAT, name))):
        store = Store(folder)
        if unused:
            products, works = remove_unused(store)
            removed = [_count(products, "unused product"), *([_count(works, "unfinished stage")] if works else [])]
            console.print(f"removed {' and '.join(removed)} from {folder}")
            return
        for used_store in (*(again for again in store.repeated if again.home.is_dir()), store):
            remove_all_links(used_store)
            left = remove_program_files(used_store.folder)
    console.print(f"removed {folder}" if not folder.exists() else f"removed all products from {folder}")
    if left:
        console.print(f"kept files that the program did not write: {', '.join(left)}")


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _shower(store: Store, point: Point) -> Callable[[], None]:
    """Return a function that links new products into the run folder; it is called periodically."""
    there = [0]

    def show_new() -> None:
        count = sum(store.has(point, stage) for stage in point.digests)
        if count != there[0]:
            there[0] = count
            show_products(store, point)

    return show_new


def _tell_damage(states: dict[str, StageState], what: str = "it will be rebuilt") -> bool:
    """Print the damaged products; return whether there are any."""
    damaged = {name: state for name, state in states.items() if state.damaged}
    for name, state in damaged.items():
        print_error(f"product {name} is damaged ({', '.join(state.damaged)}): {what}")
    return bool(damaged)


def _tell_failure(store: Store, point: Point, stage: str, message: str) -> None:
    traceback = store.work_folder(point, stage) / f".{stage}.partial" / TRACEBACK
    suffix = f"\ntraceback: {traceback}" if traceback.is_file() else ""
    print_error(f"stage {stage} failed: {message}{suffix}")
