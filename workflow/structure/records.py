"""Comparison of computed accelerations with accelerometer records."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.case.run import metric
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.references import Record


def recorded_acceleration(case: StructureCase, reference: Record, end: float):
    """Read a recorded acceleration, filter it as the run's and cut it at the end of the run.

    Args:
        case: Case with the filter.
        reference: Record with the table of the accelerometer.
        end: End of the run [s].

    Returns:
        ``Acceleration`` with times [s], raw and filtered values [m/s^2].
    """
    from reflowshock.fem.loads.pulse_table import read_pulse
    from reflowshock.fem.output.acceleration import Acceleration, apply_low_pass

    pulse = read_pulse(Path(reference.table), "acceleration", reference.table_column)
    step = float(np.diff(pulse.times).min())
    times = np.arange(int(pulse.times[-1] / step) + 1) * step
    values = np.interp(times, pulse.times, pulse.values)
    within = times <= end
    return Acceleration(times[within], values[within], apply_low_pass(values, step, case.dynamics.filter)[within])


def compare_with_record(case: StructureCase, reference: Record, history: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return the peaks of a record and the relative differences of the computed peaks, as metrics.

    Args:
        case: Case of a structure.
        reference: Recorded acceleration at a watch point.
        history: Arrays of ``history.npz``: ``time``, shape (k,) [s], ``joints`` (names), and k rows of each quantity of
            the watch points.

    Returns:
        Metrics by name: ``measured_<peak>@<watch point>`` [G] and ``<peak>_difference@<watch point>``.
    """
    from reflowshock.fem.loads.structure_pulses import pulses_of
    from reflowshock.fem.output.acceleration import watch_accelerations

    computed = watch_accelerations(history, case.problem, pulses_of(case.loads)).get(reference.watch)
    measured = recorded_acceleration(case, reference, float(history["time"][-1])).peaks_in_g(reference.watch)
    metrics = {f"measured_{name}": metric(value, "G") for name, value in measured.items()}
    for name, value in computed.peaks_in_g(reference.watch).items() if computed else ():
        quantity, _, location = name.partition("@")
        metrics[f"{quantity}_difference@{location}"] = metric(value / measured[name] - 1.0)
    return metrics
