"""Process map of a study: what came out of each point, in words, over one or two of its factors."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from reflowshock.workflow.case.text import spelled
from reflowshock.workflow.report.colours import CYCLE
from reflowshock.workflow.report.drawing import STYLE, pyplot
from reflowshock.workflow.study.results import Row, numbers
from reflowshock.workflow.study.study_file import Study

MARKERS = "sDo^vP"  # beside colours, for readers who do not tell them apart


def outcomes(study: Study, rows: Sequence[Row]) -> tuple[str, list[Row]]:
    """Return the first metric of a study that is told in words, and the points that have it; none: "", []."""
    for name in study.metrics:
        told = [row for row in rows if isinstance(row.metrics.get(name, {"value": None})["value"], str)]
        if told:
            return name, told
    return "", []


def process_map(study: Study, metric: str, rows: Sequence[Row]) -> Figure | None:
    """Draw a metric told in words over the first two factors whose values are numbers; None where there are none.

    Args:
        study: what was varied.
        metric: its name.
        rows: points that have it.
    """
    keys = [factor.keys[0] for factor in study.design.factors]
    found = {key: numbers([row.settings[key] for row in rows]) for key in keys}
    axes_of = [key for key in keys if all(isinstance(value, float) for value in found[key][1])][:2]
    if not axes_of:
        return None
    x = found[axes_of[0]][1]
    y = found[axes_of[1]][1] if len(axes_of) == 2 else [0.0] * len(rows)
    words = [str(row.metrics[metric]["value"]) for row in rows]
    with pyplot.rc_context(STYLE):
        figure, axis = pyplot.subplots(figsize=(6.4, 3.6 if len(axes_of) == 2 else 1.8), layout="constrained")
        for number, word in enumerate(sorted(set(words))):
            own = [place for place, one in enumerate(words) if one == word]
            axis.scatter(
                [x[place] for place in own], [y[place] for place in own], s=150, label=word, zorder=3,
                color=CYCLE[number % len(CYCLE)], marker=MARKERS[number % len(MARKERS)],
            )  # fmt: skip
        axis.set_xlabel(_titled(axes_of[0], found[axes_of[0]][0]))
        if len(axes_of) == 2:
            axis.set_ylabel(_titled(axes_of[1], found[axes_of[1]][0]))
        else:
            axis.set_yticks([])
        axis.margins(0.1, 0.2)
        title, place = metric.replace("_", " "), (1.01, 0.5)
        axis.legend(title=title, loc="center left", bbox_to_anchor=place, frameon=False, labelspacing=1.0)
    return figure


def _titled(key: str, unit: str) -> str:
    name = key.rpartition(".")[2].replace("_", " ")
    return f"{name} [{spelled(unit)}]" if unit else name
