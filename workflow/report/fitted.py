"""Tables and charts of strain gauges."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from reflowshock.workflow.case.text import number
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.curves import MICRO, MILLI, TIME

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reflowshock.fem.problem.fittings import StrainGauge

Histories = Mapping[str, Mapping[str, "NDArray"]]


def gauge_table(gauges: "Mapping[str, StrainGauge]", metrics: Mapping[str, Any], lengths: Mapping[str, float]) -> dict:
    """Return the table of peak strain and strain rate of each strain gauge.

    Args:
        gauges: Gauges by name.
        metrics: Name -> record with ``value`` (SI) and ``unit``; ``peak_strain@<gauge>`` must exist.
        lengths: Length of each gauge in the model [m].

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per gauge: name, face, position,
        direction, length [mm], peak strain [µm/m] and strain rate [1/s]; an empty dict without gauges.
    """
    rows = []
    for name, gauge in gauges.items():
        rate = metrics.get(f"peak_strain_rate@{name}")
        rows.append(
            [
                name,
                gauge.face,
                in_mm(gauge.at),
                ", ".join(number(along) for along in gauge.direction),
                number(lengths[name] / MILLI),
                f"{metrics[f'peak_strain@{name}']['value'] / MICRO:.0f}",
                "samples too far apart" if rate is None else number(rate["value"]),
            ]
        )
    head = ["gauge", "face", "x, y [mm]", "direction", "length [mm]", "peak strain [µm/m]", "peak strain rate [1/s]"]
    return {"head": head, "rows": rows} if rows else {}


def in_mm(position: tuple[float, ...]) -> str:
    """Return a position as text in millimetres, coordinates separated by commas.

    Args:
        position: Coordinates [m].
    """
    return ", ".join(number(value / MILLI) for value in position)


def gauge_curves(histories: Histories, gauges: "Mapping[str, StrainGauge]", styles: Mapping[str, dict]) -> list[Chart]:
    """Return one chart for each gauge, with its strain over time in every run.

    Args:
        histories: Mode or solver -> arrays of its ``history.npz``, with ``time`` and ``gauge@<name>``, both shape (k,).
        gauges: Gauges by name.
        styles: Mode or solver -> attributes of its line: name, colour, line style.

    Returns:
        Interactive charts for the report page.
    """
    return [
        Chart(
            TIME,
            Axis("strain [µm/m]"),
            [
                Series(x=history["time"] / MILLI, y=history[f"gauge@{name}"] / MICRO, **styles[run])
                for run, history in histories.items()
            ],
            title=name,
        )
        for name in gauges
    ]
