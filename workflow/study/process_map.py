"""Process map of a study: outcome of each point over one or two of its factors."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from reflowshock.workflow.case.text import spelled
from reflowshock.workflow.report.colours import CYCLE
from reflowshock.workflow.report.drawing import STYLE, pyplot
from reflowshock.workflow.study.results import Row, numbers
from reflowshock.workflow.study.study_file import Study

MARKERS = "sDo^vP"  # in addition to colours, for colour-blind readers


def outcomes(study: Study, rows: Sequence[Row]) -> tuple[str, list[Row]]:
    """Return the first metric of a study whose values are texts, and the points that have it; else "" and [].

    Args:
        study: Study with its metrics.
        rows: Results of the points.

    Returns:
        Name of the metric, and the points that have it.
    """
    for name in study.metrics:
        described = [row for row in rows if isinstance(row.metrics.get(name, {"value": None})["value"], str)]
        if described:
            return name, described
    return "", []


def process_map(study: Study, metric: str, rows: Sequence[Row]) -> Figure | None:
    """Draw a metric whose values are texts over the first two factors whose values are numbers.

    Args:
        study: Study with its factors.
        metric: Name of the metric.
        rows: Points that have the metric.

    Returns:
        Figure; None if no factor has numbers.
    """
    keys = [factor.keys[0] for factor in study.design.factors]
    columns = {key: numbers([row.settings[key] for row in rows]) for key in keys}
    axes_of = [key for key in keys if all(isinstance(value, float) for value in columns[key][1])][:2]
    if not axes_of:
        return None
    x = columns[axes_of[0]][1]
    y = columns[axes_of[1]][1] if len(axes_of) == 2 else [0.0] * len(rows)
    words = [str(row.metrics[metric]["value"]) for row in rows]
    with pyplot.rc_context(STYLE):
        figure, axis = pyplot.subplots(figsize=(6.4, 3.6 if len(axes_of) == 2 else 1.8), layout="constrained")
        for number, word in enumerate(sorted(set(words))):
            points = [index for index, other in enumerate(words) if other == word]
            axis.scatter(
                [x[index] for index in points], [y[index] for index in points], s=150, label=word, zorder=3,
                color=CYCLE[number % len(CYCLE)], marker=MARKERS[number % len(MARKERS)],
            )  # fmt: skip
        axis.set_xlabel(_titled(axes_of[0], columns[axes_of[0]][0]))
        if len(axes_of) == 2:
            axis.set_ylabel(_titled(axes_of[1], columns[axes_of[1]][0]))
        else:
            axis.set_yticks([])
        axis.margins(0.1, 0.2)
        title, anchor = metric.replace("_", " "), (1.01, 0.5)
        axis.legend(title=title, loc="center left", bbox_to_anchor=anchor, frameon=False, labelspacing=1.0)
    return figure


def _titled(key: str, unit: str) -> str:
    name = key.rpartition(".")[2].replace("_", " ")
    return f"{name} [{spelled(unit)}]" if unit else name
