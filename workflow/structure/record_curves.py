"""Curves of accelerations beside their records, and of the response spectra of the inputs."""

from collections.abc import Mapping
from typing import Any

from matplotlib import pyplot
from numpy.typing import NDArray

from reflowshock.workflow.report.curves import MILLI, STYLE, stacked, svg
from reflowshock.workflow.report.spectra import GRAVITY, spectrum_curves
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.records import recorded
from reflowshock.workflow.structure.references import Record

Histories = Mapping[str, Mapping[str, NDArray]]


def acceleration_curves(case: StructureCase, histories: Histories, styles: Mapping[str, dict[str, Any]]) -> str:
    """Draw the acceleration of every watch point in space, after the filter, beside its records; empty without any."""
    from reflowshock.fem.loads.structure_pulses import pulses_of
    from reflowshock.fem.output.acceleration import watch_accelerations

    pulses = pulses_of(case.loads)
    courses = {solver: watch_accelerations(arrays, case.problem, pulses) for solver, arrays in histories.items()}
    names = list(next(iter(courses.values())))
    if not names:
        return ""
    with pyplot.rc_context(STYLE):
        figure, axes = stacked(len(names), 2.8)
        for axis, name in zip(axes, names, strict=True):
            for reference in case.references.values():
                if isinstance(reference, Record) and reference.watch == name:
                    course = recorded(case, reference, float(next(iter(histories.values()))["time"][-1]))
                    axis.plot(course.time / MILLI, course.filtered / GRAVITY, color="#777777", label="recorded")
            for solver, found in courses.items():
                axis.plot(found[name].time / MILLI, found[name].filtered / GRAVITY, **styles[solver])
            axis.set(ylabel=f"acceleration of {name} [G]")
        axes[0].legend(frameon=False)
        axes[-1].set_xlabel("time [ms]")
        return svg(figure)


def input_spectra(case: StructureCase) -> str:
    """Draw the response spectrum of every input-G over the run's duration; empty without any."""
    from reflowshock.fem.loads.structure_pulses import pulses_of
    from reflowshock.fem.problem.structure import InputG

    inputs = {name: load for name, load in case.loads.items() if isinstance(load, InputG)}
    return spectrum_curves(pulses_of(inputs), case.dynamics.duration)
