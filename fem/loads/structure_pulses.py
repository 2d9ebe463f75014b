"""Pulses of the loads of a structure, from their parameters; plain NumPy, for plans and runs."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from reflowshock.fem.loads.pulse import Constant, HalfSine, Haversine, Pulse, Tabulated, service_condition
from reflowshock.fem.loads.pulse_table import read_pulse
from reflowshock.fem.problem.load_kinds import StructureLoad

SHAPES: dict[str, type[HalfSine] | type[Haversine]] = {"half_sine": HalfSine, "haversine": Haversine}


def pulses_of(loads: Mapping[str, StructureLoad]) -> dict[str, Pulse]:
    """Return the pulse (value over time) of each load by name, in SI units of the load.

    Args:
        loads: Loads of the case file by name.

    Raises:
        PulseError: A table cannot be read.
        ValueError: A load has neither peak nor table.
    """
    return {name: pulse_of(load) for name, load in loads.items()}


def pulse_of(load: StructureLoad) -> Pulse:
    """Return the pulse of a load over time [s], in SI units of its quantity.

    Args:
        load: Load with a table file, a JEDEC service condition, or a peak with shape and duration; a constant load
            without duration lasts for ever.

    Raises:
        PulseError: The table cannot be read.
        ValueError: The load has neither peak nor table.
    """
    if load.table is not None:
        return read_pulse(Path(load.table), load.quantity, load.table_column)
    if load.jedec_condition is not None:
        return service_condition(load.jedec_condition)
    if load.peak is None:
        raise ValueError(f"a load of kind {load.kind} has neither peak nor table")
    if load.pulse != "constant" and load.duration is not None:
        return SHAPES[load.pulse](load.peak, load.duration)
    return Constant(load.peak, load.duration or np.inf)


def pulse_durations(pulses: Mapping[str, Pulse]) -> list[float]:
    """Return the durations of all pulses that are not constant [s]; empty if all are constant.

    Args:
        pulses: Name of a load -> its pulse; a table lasts from its first to its last time.
    """
    sines = [pulse.duration for pulse in pulses.values() if isinstance(pulse, HalfSine | Haversine)]
    return sines + [float(np.ptp(pulse.times)) for pulse in pulses.values() if isinstance(pulse, Tabulated)]
