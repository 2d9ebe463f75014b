"""Curves of accelerations beside their records, and of the response spectrum of the input."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import pyplot
from numpy.typing import NDArray

from reflowshock.workflow.report.curves import MILLI, STYLE, svg
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.records import recorded
from reflowshock.workflow.structure.references import Record

GRAVITY = 9.80665
SAMPLES = 4000  # of an input, for its spectrum
LEAST = 20.0  # samples in a period of the spectrum's highest frequency

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
        figure, axes = pyplot.subplots(
            len(names), 1, figsize=(9.2, 2.8 * len(names)), squeeze=False, sharex=True, constrained_layout=True
        )
        for axis, name in zip(axes[:, 0], names, strict=True):
            for reference in case.references.values():
                if isinstance(reference, Record) and reference.watch == name:
                    course = recorded(case, reference, float(next(iter(histories.values()))["time"][-1]))
                    axis.plot(course.time / MILLI, course.filtered / GRAVITY, color="#777777", label="recorded")
            for solver, found in courses.items():
                axis.plot(found[name].time / MILLI, found[name].filtered / GRAVITY, **styles[solver])
            axis.set(ylabel=f"acceleration of {name} [G]")
        axes[0, 0].legend(frameon=False)
        axes[-1, 0].set_xlabel("time [ms]")
        return svg(figure)


def spectrum_curves(case: StructureCase) -> str:
    """Draw the response spectrum of every input-G over the run's duration; empty without any."""
    from reflowshock.fem.loads.structure_pulses import pulses_of
    from reflowshock.fem.output.response_spectrum import QUALITY, response_spectrum, spectrum_frequencies
    from reflowshock.fem.problem.structure import InputG

    inputs = {name: load for name, load in case.loads.items() if isinstance(load, InputG)}
    if not inputs:
        return ""
    step = case.dynamics.duration / SAMPLES
    frequencies = spectrum_frequencies(1.0 / case.dynamics.duration, 1.0 / (LEAST * step))
    pulses = pulses_of(inputs)
    with pyplot.rc_context(STYLE):
        figure, axis = pyplot.subplots(figsize=(9.2, 2.8), constrained_layout=True)
        for name, pulse in pulses.items():
            values = np.array([pulse.value(k * step) for k in range(SAMPLES + 1)])
            axis.loglog(frequencies, response_spectrum(values, step, frequencies) / GRAVITY, label=name)
        axis.set(xlabel="natural frequency [Hz]", ylabel=f"peak acceleration, Q = {QUALITY:g} [G]")
        axis.legend(frameon=False)
        return svg(figure)
