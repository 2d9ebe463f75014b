"""The command ``study``: read a study, check every point, compute missing products, write the results."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from reflowshock.names import find_nearest
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import duration
from reflowshock.workflow.jobs.batch import Machine, list_missing, run_points, show_products
from reflowshock.workflow.pipeline.points import PointsError, read_possible_points
from reflowshock.workflow.process.terminal import console, new_table, print_error, progress_bar, text_table
from reflowshock.workflow.store.folders import lock_folder
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.store.view import adopt
from reflowshock.workflow.study import tables
from reflowshock.workflow.study.main_effects import is_number
from reflowshock.workflow.study.progress import forecast_stages, progress_reporter
from reflowshock.workflow.study.results import HEALTHY, IMPOSSIBLE, Row, row_of
from reflowshock.workflow.study.study_file import Study, read_study

LAST = "report"
CONTENT = "study"  # content of the folder, for its marker file
RANKED_POINTS = 10  # points of the ranking in the terminal


@dataclass(frozen=True, slots=True)
class Points:
    """Points of a study.

    Attributes:
        study: Study.
        settings: Settings of each point.
        possible: Index of a point -> point with a valid case.
        impossible: Index of a point -> error of its case.
    """

    study: Study
    settings: list[dict[str, str]]
    possible: dict[int, Point]
    impossible: dict[int, CaseError]


def read_points_of(path: Path, oversubscribe: bool = False, force: bool = False) -> Points:
    """Read a study and all its points.

    Args:
        path: TOML file.
        oversubscribe: Whether MPI may have more ranks than cores.
        force: Whether implausible values are accepted.

    Returns:
        Study, points with a valid case, and the errors of the others, both by index.

    Raises:
        CaseError: The study is invalid, or has invalid points that it does not skip.
    """
    study = read_study(path)
    settings = study.points
    points, impossible = read_possible_points(study.case, settings, oversubscribe, force)
    if impossible and not (study.about.skip_impossible and points):
        raise PointsError(str(path), impossible, settings)
    indices = [index for index in range(len(settings)) if index not in impossible]
    return Points(study, settings, dict(zip(indices, points, strict=True)), impossible)


def show_forecast(points: Points, store: Store) -> None:
    """Print the products of a study that are missing, by stage, with their predicted cost.

    Args:
        points: Points of the study, possible and impossible ones.
        store: Store of the products, which is examined.
    """
    possible = list(points.possible.values())
    stages = forecast_stages(possible, list_missing(store, possible, LAST))
    table = new_table(
        f"{points.study.about.name}: {len(possible)} points, in {store.folder}",
        "stage",
        "products",
        "available",
        "to compute",
        "cost",
    )
    for stage in stages:
        cost = "" if stage.seconds is None else f"about {duration(stage.seconds)}"
        available = stage.products - stage.missing
        table.add_row(stage.stage, f"{stage.products}", f"{available}", f"{stage.missing}", cost)
    total = sum(stage.seconds or 0.0 for stage in stages)
    count = sum(stage.missing for stage in stages)
    table.add_row(
        "all",
        f"{sum(stage.products for stage in stages)}",
        f"{sum(stage.products - stage.missing for stage in stages)}",
        f"{count}",
        f"about {duration(total)}" if total else "",
        style="bold",
    )
    console.print(table)
    if points.impossible:
        console.print(f"{len(points.impossible)} points are impossible and are skipped")


def predicted_study_seconds(points: Points, store: Store) -> float:
    """Predict the total wall time [s] of the missing products of a study, computed one after the other.

    Args:
        points: Points of the study.
        store: Store of the products, which is examined.
    """
    possible = list(points.possible.values())
    return sum(stage.seconds or 0.0 for stage in forecast_stages(possible, list_missing(store, possible, LAST)))


def run_study(points: Points, store: Store, machine: Machine, *, force: bool = False) -> bool:
    """Compute the missing products of a study and write its results.

    Args:
        points: Points of the study.
        store: Store: the folder of all products of a run or study.
        machine: Resources for the computation.
        force: Whether the folder may hold another study.

    Returns:
        Whether every possible point is complete and healthy, and the metrics of the study exist.

    Raises:
        CaseError: The folder belongs to something else or is not writable.
        RunFolderBusy: Another process uses the folder.
    """
    possible, about = list(points.possible.values()), points.study.about
    with lock_folder(store.folder, CONTENT, about.name, force) as lock:
        jobs = list_missing(store, possible, LAST)
        if jobs:
            with progress_bar(f"{about.name}: {len(jobs)} products to compute") as bar:
                report = progress_reporter(store, possible, jobs, bar, partial(warn_of_metrics, points, store))
                watched = replace(machine, each_second=report)
                failed = run_points(store, possible, LAST, watched, lock)
        else:
            console.print(f"nothing to compute: {store.folder} has all {len(possible)} points")
            for point in possible:
                show_products(store, point)
            failed = {}
        rows = results(points, store, failed)
        _write_results(store, points.study, rows)
    show_results(points.study, rows, store.folder)
    return has_metrics(points.study, rows) and all(row.verdict in (HEALTHY, IMPOSSIBLE) for row in rows)


def _write_results(store: Store, study: Study, rows: Sequence[Row]) -> None:
    """Write the results of a study next to its store; files that the user has changed are kept under another name."""
    from reflowshock.workflow.study.page import write_results

    folder = store.home / "work" / "results"
    discard(folder)
    folder.mkdir(parents=True)
    write_results(folder, study, rows)
    adopt(store, store.folder, folder)
    discard(folder)


def results(points: Points, store: Store, failed: dict[str, str]) -> list[Row]:
    """Return a row for each point, in the order of the study.

    Args:
        points: Points of the study, possible and impossible ones.
        store: Store of the products, from which summaries are read.
        failed: Key of a point (name of its run folder) -> reason of its failure.

    Returns:
        Number, key, settings, verdict, message, wall time [s] and metrics of each point.
    """
    keys = points.study.design.keys
    rows = [row_of(index + 1, store, point, keys, failed.get(point.key)) for index, point in points.possible.items()]
    rows += [
        Row(index + 1, "", {key: points.settings[index][key] for key in keys}, IMPOSSIBLE, "; ".join(error.lines()))
        for index, error in points.impossible.items()
    ]
    return sorted(rows, key=lambda row: row.number)


def warn_of_metrics(points: Points, store: Store, first: Point) -> None:
    """Print a warning of metrics of a study that the first complete point lacks, so that the user can stop early.

    Args:
        points: Points with their study, whose metrics are named in its file.
        store: Store: the folder of all products of a run or study.
        first: The first complete point.
    """
    show_products(store, first)
    row = row_of(1, store, first, points.study.design.keys, None)
    available = _metrics_of(points.study, [row])
    for name in points.study.metrics:
        if name not in available:
            hint = find_nearest(name, sorted(available))
            suggestion = f"; did you mean {hint}?" if hint else "."
            print_error(
                f"the first point has no {_required_type(points.study, name)}metric {name}{suggestion} "
                "Ctrl-C stops the study and keeps results"
            )


def has_metrics(study: Study, rows: Sequence[Row]) -> bool:
    """Check that the points of a study have all its metrics, and print the missing ones.

    The metric by which points are ranked must be a number.

    Args:
        study: Study, which names its metrics.
        rows: Results of the points.

    Returns:
        Whether every metric exists in at least one point, or no point has any metric.
    """
    available = _metrics_of(study, rows)
    unavailable = [name for name in study.metrics if available and name not in available]
    for name in unavailable:
        hint = find_nearest(name, sorted(available))
        print_error(
            f"no point has a {_required_type(study, name)}metric {name}" + (f"; did you mean {hint}?" if hint else "")
        )
    return not unavailable


def _metrics_of(study: Study, rows: Sequence[Row]) -> set[str]:
    """Return the metrics of points that a study can use: numbers, and texts except for the ranking metric."""
    return {
        name
        for row in rows
        for name, metric in row.metrics.items()
        if is_number(metric["value"]) or (isinstance(metric["value"], str) and name != study.about.rank_by)
    }


def _required_type(study: Study, name: str) -> str:
    return "numeric " if name == study.about.rank_by else ""


def show_results(study: Study, rows: Sequence[Row], folder: Path) -> None:
    """Print the best points, the main effects, and failures.

    Args:
        study: Study.
        rows: Results of the points.
        folder: Folder of the study, named in the output.
    """
    ranking = tables.ranking(study, rows)
    if ranking["rows"]:
        count = min(RANKED_POINTS, len(ranking["rows"]))
        title = f"{count} of {len(rows)} points by {study.about.rank_by}"
        console.print(text_table(title, ranking["head"], ranking["rows"][:count]))
        effects = tables.effect_table(tables.effects(study, rows))
        console.print(text_table("\nMain effects", effects["head"], effects["rows"]))
        if remark := tables.imbalance(rows):
            console.print(remark, soft_wrap=True)
    for row in rows:
        if row.verdict != HEALTHY:
            print_error(f"point {row.number} {row.key} {row.verdict}: {row.message}")
    pictures = [name for name in ("main_effects.png", "process_map.png") if (folder / name).exists()]
    console.print(f"results: {folder}/" + ", ".join(("study.html", "results.csv", "results.parquet", *pictures)))
