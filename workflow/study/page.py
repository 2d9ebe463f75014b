"""study.html, main_effects.png, results.csv and results.parquet of a study."""

from collections.abc import Sequence
from pathlib import Path

from reflowshock.workflow import __version__
from reflowshock.workflow.report.template import write_page
from reflowshock.workflow.study import tables
from reflowshock.workflow.study.results import HEALTHY, Row, columns, write_csv, write_parquet
from reflowshock.workflow.study.study_file import Study


def write_results(folder: Path, study: Study, rows: Sequence[Row]) -> None:
    """Write all results of a study.

    Args:
        folder: where they go.
        study: what was varied.
        rows: one a point.
    """
    table = columns(rows, study)
    write_csv(folder / "results.csv", table)
    write_parquet(folder / "results.parquet", table)
    found = tables.effects(study, rows)
    write_page(folder / "study.html", "study.html.j2", _context(study, rows, found) | _picture(folder, found))


def _context(study: Study, rows: Sequence[Row], found: list) -> dict:
    healthy = sum(row.verdict == HEALTHY for row in rows)
    return {
        "version": __version__,
        "study": study.about,
        "fixed": {"head": ["setting of all points", "value"], "rows": [list(item) for item in study.settings.items()]},
        "count": len(rows),
        "healthy": healthy,
        "ranking": tables.ranking(study, rows),
        "effects": tables.effect_table(found),
        "imbalance": tables.imbalance(rows),
        "troubles": tables.troubles(rows),
        "continuous": any(factor.continuous for factor in study.design.factors),
        "rank_by": study.about.rank_by.replace("_", " "),
    }


def _picture(folder: Path, found: list) -> dict:
    """Draw main effects into a PNG; return them as SVG. Nothing where no point has a metric."""
    if not found:
        return {"picture": ""}
    from reflowshock.workflow.report.curves import svg
    from reflowshock.workflow.study.figures import main_effects

    figure = main_effects(found)
    figure.savefig(folder / "main_effects.png", dpi=150)
    return {"picture": svg(figure)}
