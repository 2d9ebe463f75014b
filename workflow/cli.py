"""Command line: new, import, plan, run, accuracy, status, report, verify, clean, study, effects, schema and others."""

import json
import shutil
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from reflowshock.workflow import __version__
from reflowshock.workflow.compare.command import compare
from reflowshock.workflow.examples import examples
from reflowshock.workflow.jobs.executor import JOBS, ExecutorName, executor_for
from reflowshock.workflow.new_case import import_board, init, new
from reflowshock.workflow.pipeline.points import read_case_of_run
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.process.environment import available_cores, prepare
from reflowshock.workflow.process.error_exit import handle_signals, one_line_errors, run_app, set_run_folder
from reflowshock.workflow.process.terminal import console, interruptible, print_error
from reflowshock.workflow.store.folders import check_folder, read_mark
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.store import Store

app = typer.Typer(
    name="reflowshock",
    help="Solder reflow with particles and two-scale explicit drop shock, from a case file to a report.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

app.command()(compare)

CasePath = Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help='override a value, e.g. "shock.peak_acceleration=1000 G"'),
]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="run folder (default: runs/<case name>-<scale>)")
]
Oversubscribe = Annotated[bool, typer.Option("--oversubscribe", help="allow more MPI ranks than cores")]
Force = Annotated[
    bool,
    typer.Option("--force", help="use the folder even if it contains another case; accept implausible values"),
]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="do not ask before runs of more than an hour")]
WITHOUT_ERRORS = "numerics.error.method=off"  # as an argument of --set
MOST_AT_ONCE = 10_000  # cores, or jobs of a cluster
AtOnce = Annotated[
    int | None,
    typer.Option(
        "-j",
        "--cores",
        min=1,
        max=MOST_AT_ONCE,
        help=f"cores to use (default: all); on a cluster: jobs at a time (default: {JOBS})",
    ),
]
ExecutorOption = Annotated[
    ExecutorName, typer.Option("--executor", help="where stages run: on this machine or as Slurm jobs")
]
ProfileOption = Annotated[
    Path | None,
    typer.Option(
        "--profile",
        metavar="DIR",
        help="profile of the cluster (default: profiles/slurm if it exists, else the built-in one)",
    ),
]


app.command()(new)
app.command()(init)
app.command("import")(import_board)


@app.command()
def plan(
    case: CasePath,
    settings: Settings = None,
    out: Out = None,
    oversubscribe: Oversubscribe = False,
    force: Force = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="print stages, effects and predicted times for a script")
    ] = False,
) -> None:
    """Show the stages that a run would execute, why, and their predicted cost, without running them."""
    from reflowshock.workflow.plan import plan_record, show_plan
    from reflowshock.workflow.run import WHAT

    store, point = _load(case, settings, out, oversubscribe, force)
    check_folder(store.folder, WHAT, point.case.case.name, force)
    if as_json:
        print(json.dumps(plan_record(store, point), indent=2))
        return
    show_plan(store, point, console)


@app.command()
def run(
    case: CasePath,
    settings: Settings = None,
    until: Annotated[str, typer.Option(metavar="STAGE", help="last stage to run (see plan)")] = "report",
    cores: AtOnce = None,
    out: Out = None,
    oversubscribe: Oversubscribe = False,
    executor: ExecutorOption = ExecutorName.LOCAL,
    profile: ProfileOption = None,
    force: Force = False,
    yes: Yes = False,
    fail_on_verdict: Annotated[
        bool, typer.Option("--fail-on-verdict", help="exit code 3 if the verdict on the design is FAIL")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", "-n", help="show what would run and its cost, as plan")] = False,
    no_error: Annotated[bool, typer.Option("--no-error", help=f"estimate no errors ({WITHOUT_ERRORS})")] = False,
) -> None:
    """Run all stages that are missing, stale or damaged; ends with the verdict on the design.

    The exit code is 0 if all stages up to --until are complete and healthy, 1 if not or if a long run is declined, and
    3 if only --fail-on-verdict objects. Products are in the run folder, by default runs/<case name>-<scale>.
    """
    from reflowshock.workflow.jobs.batch import machine_of
    from reflowshock.workflow.pipeline.gate import ask_if_long
    from reflowshock.workflow.plan import predicted_seconds, show_plan
    from reflowshock.workflow.run import WHAT, run_case
    from reflowshock.workflow.verdict.criterion import FAIL

    settings = [*(settings or []), *([WITHOUT_ERRORS] if no_error else [])]
    store, point = _load(case, settings, out, oversubscribe or executor != ExecutorName.LOCAL, force)
    if until not in point.case.pipeline.names:
        allowed = ", ".join(point.case.pipeline.names)
        raise typer.BadParameter(f"'{until}' is not a stage of this case; allowed: {allowed}", param_hint="--until")
    if fail_on_verdict and until != point.case.pipeline.names[-1]:
        raise typer.BadParameter("needs the report, which has the verdict", param_hint="--fail-on-verdict")
    check_folder(store.folder, WHAT, point.case.case.name, force)
    if dry_run:
        show_plan(store, point, console)
        return
    machine = machine_of(executor_for(executor, profile, cores, oversubscribe, [point.case]), one_run=True)
    if executor == ExecutorName.LOCAL:
        seconds = predicted_seconds(store, point, until)
        if not ask_if_long(point.case.run_name, seconds, yes, console):
            raise typer.Exit(1)
    with interruptible("complete stages and checkpoints are kept; repeat the command to continue"):
        ended = run_case(store, point, until, machine, force=force)
    broken = fail_on_verdict and ended.verdict == FAIL
    raise typer.Exit(1 if not ended.healthy else 3 if broken else 0)


@app.command()
def accuracy(
    case: CasePath,
    tolerance: Annotated[
        str | None,
        typer.Option(metavar="SHARE", help='allowed error, e.g. "2%" (default: 2% if no budget is given)'),
    ] = None,
    budget: Annotated[
        str | None,
        typer.Option(metavar="TIME", help='total wall time of all runs, e.g. "10min" (default: no limit)'),
    ] = None,
    settings: Settings = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="folder (default: runs/<case name>-accuracy)")
    ] = None,
    oversubscribe: Oversubscribe = False,
    force: Force = False,
) -> None:
    """Run a convergence study; recommend and run the cheapest settings within a tolerance, or the best in a budget."""
    from reflowshock.workflow.accuracy.command import read_request, show

    request = replace(read_request(case, settings or [], tolerance, budget), oversubscribe=oversubscribe, force=force)
    with interruptible("complete points and checkpoints are kept; repeat the command to continue"):
        is_satisfied = show(request, out, console)
    raise typer.Exit(0 if is_satisfied else 1)


@app.command()
def status(
    case: CasePath,
    settings: Settings = None,
    out: Out = None,
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="watch a run that another terminal has started, until it ends")
    ] = False,
) -> None:
    """Show stages done, stale, damaged or missing in a run folder, with times and key results; changes nothing."""
    from reflowshock.workflow.status import follow_run, show_status

    store, point = _load(case, settings, out, True, True)
    if follow:
        with interruptible("the run goes on"):
            follow_run(store, point, console)
    show_status(store, point, console)


@app.command()
def report(
    case: CasePath,
    settings: Settings = None,
    out: Out = None,
    show: Annotated[bool, typer.Option("--open", help="open it in the browser")] = False,
    movie: Annotated[Path | None, typer.Option(metavar="FILE.gif", help="also write its animation as a GIF")] = None,
) -> None:
    """Rewrite report.html and summary.json in the run folder from the existing products, without computing anything."""
    from reflowshock.workflow.pipeline.report import write_report
    from reflowshock.workflow.run import check_movie, report_again, write_run_movie
    from reflowshock.workflow.stages import report as stage_function

    if movie is not None:
        check_movie(movie)

    store, point = _load(case, settings, out, True, True)
    if read_mark(store.folder) is None:
        print_error(f"{store.folder} is not a run folder")
        raise typer.Exit(1)
    if not report_again(store.folder, point.case.case.name, write_report, stage_function):
        raise typer.Exit(1)
    console.print(f"report: {store.folder / 'report.html'}")
    if movie is not None:
        write_run_movie(store.folder, movie)
    if show and not webbrowser.open((store.folder / "report.html").resolve().as_uri()):
        print_error("no browser can be opened here")
        raise typer.Exit(1)


@app.command()
def verify(case: CasePath, settings: Settings = None, out: Out = None) -> None:
    """Verify that all products in a run folder exist and are unchanged: exit code 0 if so, else 1."""
    from reflowshock.workflow.run import verify as verify_run

    raise typer.Exit(0 if verify_run(*_load(case, settings, out, True, True)) else 1)


@app.command()
def clean(
    case: CasePath,
    settings: Settings = None,
    out: Out = None,
    unused: Annotated[
        bool, typer.Option("--unused", help="remove only products of other settings and unfinished work")
    ] = False,
    force: Force = False,
) -> None:
    """Remove the program's own files from a run folder, or with --unused only superseded ones; other files stay."""
    from reflowshock.workflow.run import clean as clean_run

    store, point = _load(case, settings, out, True, True)
    clean_run(store.folder, point.case.case.name, unused=unused, force=force)


@app.command()
def stress_test(
    cases: Annotated[list[Path] | None, typer.Argument(metavar="CASES", help="hard cases (default: all)")] = None,
    family: Annotated[
        list[str] | None,
        typer.Option(metavar="FAMILY", help="reflow, elements, coupling, remesh, droplets (default: all)"),
    ] = None,
    random: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="random cases (default: 200, 0 if CASES are given)")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="seed of the random cases")] = 1,
    cores: Annotated[
        int | None, typer.Option("-j", "--cores", min=1, max=MOST_AT_ONCE, help="cases at a time (default: cores)")
    ] = None,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="results")] = Path("runs/stress-test"),
) -> None:
    """Run hard and random cases and check that each stays within its bounds; write results, exit code 0 if all do."""
    from reflowshock.workflow.stress_test.command import RANDOM_COUNT, Request
    from reflowshock.workflow.stress_test.command import stress_test as try_cases

    count = random if random is not None else 0 if cases else RANDOM_COUNT
    request = Request(cases or [], family or [], count, seed, cores or available_cores(), out)
    with interruptible("no results are written"):
        survived = try_cases(request)
    raise typer.Exit(0 if survived else 1)


@app.command()
def effects(
    case: Annotated[
        Path | None, typer.Argument(metavar="[CASE]", help="case file; without it, all effects of the program")
    ] = None,
    settings: Settings = None,
) -> None:
    """Show all effects of the program, or those of a case: on or off, why, expected influence, share of the cost."""
    from reflowshock.workflow.effects.page import show_effects, show_registry

    if case is None:
        show_registry(console)
    else:
        show_effects(read_case(case, settings or [], True), console)


@app.command()
def study(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="study file (TOML)")],
    cores: AtOnce = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", "-n", help="show what would be computed and its cost")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="folder of the study (default: runs/<study name>)")
    ] = None,
    oversubscribe: Oversubscribe = False,
    executor: ExecutorOption = ExecutorName.LOCAL,
    profile: ProfileOption = None,
    force: Force = False,
    yes: Yes = False,
) -> None:
    """Run a parametric study: compute only missing points, write tables, plots and a page; exit code 0 if healthy."""
    from reflowshock.workflow.jobs.batch import machine_of
    from reflowshock.workflow.pipeline.gate import ask_if_long
    from reflowshock.workflow.study.command import predicted_study_seconds, read_points_of, run_study, show_forecast

    points = read_points_of(study, oversubscribe or executor != ExecutorName.LOCAL, force)
    store = Store(out or Path("runs") / points.study.about.name)
    if dry_run:
        show_forecast(points, store)
        return
    cases = [point.case for point in points.possible.values()]
    machine = machine_of(executor_for(executor, profile, cores, oversubscribe, cases))
    if executor == ExecutorName.LOCAL:
        seconds = predicted_study_seconds(points, store) / machine.cores
        if not ask_if_long(f"study {points.study.about.name}", seconds, yes, console):
            raise typer.Exit(1)
    with interruptible("complete products and checkpoints are kept; repeat the command to continue"):
        healthy = run_study(points, store, machine, force=force)
    raise typer.Exit(0 if healthy else 1)


@app.command()
def schema() -> None:
    """Print the JSON schema (draft 2020-12) of case files of all kinds to standard output."""
    from reflowshock.workflow.pipeline.schema import case_schema

    print(json.dumps(case_schema(), indent=2))


@app.command(hidden=True)
def stage(
    name: str,
    key: str,
    cores: Annotated[int, typer.Option("--cores")] = 1,
    oversubscribe: Oversubscribe = False,
    mark: Annotated[Path | None, typer.Option(help="file that marks the job as done for Snakemake")] = None,
) -> None:
    """Make the product of stage NAME with a store key, in the working directory's store (called by Snakemake)."""
    from reflowshock.workflow.case.run import Run
    from reflowshock.workflow.pipeline.stage_runner import execute
    from reflowshock.workflow.process.progress_file import write_progress_to
    from reflowshock.workflow.stages import stage_function

    product, folder = Path("products", f"{name}-{key}"), Path("work", f"{name}-{key}")
    write_progress_to(folder)
    run = Run(folder, read_case_of_run(folder), cores, oversubscribe)
    if not execute(name, stage_function(run.case, name), run, product):
        raise typer.Exit(1)
    shutil.rmtree(folder)
    if mark is not None:
        mark.touch()


for command in app.registered_commands:
    command.epilog = examples(command.name or getattr(command.callback, "__name__", "").replace("_", "-"))


def main() -> None:
    """Run the command line; exit codes: 0 success, 1 failure, 2 bad input, 3 verdict FAIL (with --fail-on-verdict)."""
    with one_line_errors():
        handle_signals()
        prepare()
        run_app(app)


def _version(requested: bool) -> None:
    if requested:
        console.print(f"reflowshock {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="show the version")
    ] = False,
) -> None:
    pass


def _load(
    path: Path, settings: list[str] | None, out: Path | None, lenient: bool, force: bool = False
) -> tuple[Store, Point]:
    """Read a case and open its store; ``lenient`` allows cases that are too large for this machine."""
    case = read_case(path, settings or [], lenient, force)
    store = Store(out or Path("runs") / case.run_name, one_run=True)
    if read_mark(store.folder) is not None:
        set_run_folder(store.folder)
    return store, Point({}, case)
