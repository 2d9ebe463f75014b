"""Charts of computed and recorded accelerations, and of the response spectra of the inputs."""

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import GREY
from reflowshock.workflow.report.curves import GRAVITY, MILLI, TIME
from reflowshock.workflow.report.spectra import spectrum_curves
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.records import recorded_acceleration

Histories = Mapping[str, Mapping[str, NDArray]]


def acceleration_curves(case: StructureCase, histories: Histories, styles: Mapping[str, dict[str, Any]]) -> list[Chart]:
    """Return one chart for each watch point: its filtered acceleration relative to space, and its records.

    Args:
        case: Case with watch points, loads and records.
        histories: Solver -> arrays of its ``history.npz``: ``time``, shape (k,) [s], and k rows of each quantity.
        styles: Solver -> attributes of its line: name, colour, line style.

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.fem.loads.structure_pulses import pulses_of
    from reflowshock.fem.output.acceleration import watch_accelerations

    pulses = pulses_of(case.loads)
    accelerations = {solver: watch_accelerations(arrays, case.problem, pulses) for solver, arrays in histories.items()}
    end = float(next(iter(histories.values()))["time"][-1])
    charts = []
    for name in next(iter(accelerations.values())):
        lines = [
            Series("recorded", recorded.time / MILLI, recorded.filtered / GRAVITY, GREY)
            for reference in case.references.values()
            if (record := reference.record) is not None and record.watch == name
            for recorded in [recorded_acceleration(case, record, end)]
        ]
        lines += [
            Series(x=computed[name].time / MILLI, y=computed[name].filtered / GRAVITY, **styles[solver])
            for solver, computed in accelerations.items()
        ]
        charts.append(Chart(TIME, Axis("acceleration [G]"), lines, title=name))
    return charts


def input_spectra(case: StructureCase) -> list[Chart]:
    """Return the chart of the shock response spectra of all input accelerations of a run.

    Args:
        case: Case of a structure with its loads.

    Returns:
        List of one interactive chart for the report page; empty without input accelerations.
    """
    from reflowshock.fem.loads.structure_pulses import pulses_of

    inputs = {name: load for name, load in case.loads.items() if load.is_base_excitation}
    return spectrum_curves(pulses_of(inputs), case.dynamics.duration)
