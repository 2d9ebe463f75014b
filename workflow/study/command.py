"""The command study: reads the study, checks every point, computes what is missing, writes the results."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from reflowshock.names import nearest
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.text import duration
from reflowshock.workflow.jobs.batch import Machine, missing, run_points, show_products
from reflowshock.workflow.pipeline.points import PointsError, read_possible_points
from reflowshock.workflow.process.terminal import console, new_table, print_error, progress_bar, text_table
from reflowshock.workflow.store.folders import locked
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.product import discard
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.store.view import adopt
from reflowshock.workflow.study import tables
from reflowshock.workflow.study.main_effects import is_number
from reflowshock.workflow.study.progress import outlook, teller
from reflowshock.workflow.study.results import HEALTHY, IMPOSSIBLE, Row, row_of
from reflowshock.workflow.study.study_file import Study, read_study

LAST = "report"
WHAT = "study"  # its folder holds
SHOWN = 10  # points of the ranking in the terminal


@dataclass(frozen=True, slots=True)
class Points:
    """The points of a study.

    Attributes:
        study: the study.
        settings: of each point.
        possible: place in the study -> point.
        impossible: place in the study -> what is wrong with its case.
    """

    study: Study
    settings: list[dict[str, str]]
    possible: dict[int, Point]
    impossible: dict[int, CaseError]


def read_points_of(path: Path, oversubscribe: bool = False, force: bool = False) -> Points:
    """Read a study and all its points.

    Args:
        path: TOML file.
        oversubscribe: as `read_case` takes it.
        force: likewise.

    Raises:
        CaseError: the study is wrong, or points of it cannot be and are not to be skipped.
    """
    study = read_study(path)
    settings = study.points
    points, impossible = read_possible_points(study.case, settings, oversubscribe, force)
    if impossible and not (study.about.skip_impossible and points):
        raise PointsError(str(path), impossible, settings)
    places = [place for place in range(len(settings)) if place not in impossible]
    return Points(study, settings, dict(zip(places, points, strict=True)), impossible)


def show_outlook(points: Points, store: Store) -> None:
    """Print what would be computed, and its predicted cost."""
    every = list(points.possible.values())
    stages = outlook(every, missing(store, every, LAST))
    table = new_table(
        f"{points.study.about.name}: {len(every)} points, in {store.folder}",
        "stage",
        "products",
        "there",
        "to do",
        "cost",
    )
    for own in stages:
        cost = "" if own.seconds is None else f"about {duration(own.seconds)}"
        table.add_row(own.stage, f"{own.products}", f"{own.products - own.missing}", f"{own.missing}", cost)
    total = sum(own.seconds or 0.0 for own in stages)
    count = sum(own.missing for own in stages)
    table.add_row(
        "all",
        f"{sum(own.products for own in stages)}",
        f"{sum(own.products - own.missing for own in stages)}",
        f"{count}",
        f"about {duration(total)}" if total else "",
        style="bold",
    )
    console.print(table)
    if points.impossible:
        console.print(f"{len(points.impossible)} points are not possible and are skipped")


def predicted_study_seconds(points: Points, store: Store) -> float:
    """Predict the wall time [s] of all that is missing of a study, one stage after the other."""
    every = list(points.possible.values())
    return sum(own.seconds or 0.0 for own in outlook(every, missing(store, every, LAST)))


def run_study(points: Points, store: Store, machine: Machine, *, force: bool = False) -> bool:
    """Compute what is missing of a study and write its results.

    Args:
        points: of the study.
        store: where products are.
        machine: what they are computed with.
        force: whether the folder may hold another study.

    Returns:
        Whether every point that can be is complete and healthy.

    Raises:
        CaseError: the folder must not, or cannot be written into.
        RunFolderBusy: another process is at work in it.
    """
    every, about = list(points.possible.values()), points.study.about
    with locked(store.folder, WHAT, about.name, force) as lock:
        jobs = missing(store, every, LAST)
        if jobs:
            with progress_bar(f"{about.name}: {len(jobs)} products to compute") as bar:
                report = teller(store, every, jobs, bar, partial(warn_of_metrics, points, store))
                watched = replace(machine, each_second=report)
                failed = run_points(store, every, LAST, watched, lock)
        else:
            console.print(f"nothing to compute: {store.folder} has all {len(every)} points")
            for point in every:
                show_products(store, point)
            failed = {}
        rows = results(points, store, failed)
        _write_results(store, points.study, rows)
    show_results(points.study, rows, store.folder)
    return has_metrics(points.study, rows) and all(row.verdict in (HEALTHY, IMPOSSIBLE) for row in rows)


def _write_results(store: Store, study: Study, rows: Sequence[Row]) -> None:
    """Write the results of a study beside its store; what a user has changed in earlier ones is set aside."""
    from reflowshock.workflow.study.page import write_results

    made = store.home / "work" / "results"
    discard(made)
    made.mkdir(parents=True)
    write_results(made, study, rows)
    adopt(store, store.folder, made)
    discard(made)


def results(points: Points, store: Store, failed: dict[str, str]) -> list[Row]:
    """Return a row for each point, in the order of the study."""
    keys = points.study.design.keys
    rows = [row_of(place + 1, store, point, keys, failed.get(point.key)) for place, point in points.possible.items()]
    rows += [
        Row(place + 1, "", {key: points.settings[place][key] for key in keys}, IMPOSSIBLE, "; ".join(error.lines()))
        for place, error in points.impossible.items()
    ]
    return sorted(rows, key=lambda row: row.number)


def warn_of_metrics(points: Points, store: Store, first: Point) -> None:
    """Say early which metrics of a study the first point that is complete does not have."""
    show_products(store, first)
    row = row_of(1, store, first, points.study.design.keys, None)
    known = _known(points.study, [row])
    for name in points.study.metrics:
        if name not in known:
            hint = nearest(name, sorted(known))
            suggestion = f"; did you mean {hint}?" if hint else "."
            print_error(
                f"the first point has no {_sort(points.study, name)}metric {name}{suggestion} "
                "Ctrl-C stops the study and keeps results"
            )


def has_metrics(study: Study, rows: Sequence[Row]) -> bool:
    """Whether points have the metrics of a study, the one that ranks as a number; tells those that they have not."""
    known = _known(study, rows)
    missing_ones = [name for name in study.metrics if known and name not in known]
    for name in missing_ones:
        hint = nearest(name, sorted(known))
        print_error(f"no point has a {_sort(study, name)}metric {name}" + (f"; did you mean {hint}?" if hint else ""))
    return not missing_ones


def _known(study: Study, rows: Sequence[Row]) -> set[str]:
    """Metrics of points that a study can show: numbers, and words but for the one that ranks."""
    return {
        name
        for row in rows
        for name, metric in row.metrics.items()
        if is_number(metric["value"]) or (isinstance(metric["value"], str) and name != study.about.rank_by)
    }


def _sort(study: Study, name: str) -> str:
    return "numeric " if name == study.about.rank_by else ""


def show_results(study: Study, rows: Sequence[Row], folder: Path) -> None:
    """Print the best points, the effects, and what went wrong."""
    ranking = tables.ranking(study, rows)
    if ranking["rows"]:
        count = min(SHOWN, len(ranking["rows"]))
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
