"""Pulses of a structure's loads, from their parameters. Plain NumPy, for ``plan`` and for the run itself."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from reflowshock.fem.loads.pulse import Constant, HalfSine, Haversine, Pulse, Tabulated, service_condition
from reflowshock.fem.loads.pulse_table import read_pulse
from reflowshock.fem.problem.structure import InputG, StructureLoad

SHAPES: dict[str, type[HalfSine] | type[Haversine]] = {"half_sine": HalfSine, "haversine": Haversine}


def pulses_of(loads: Mapping[str, StructureLoad]) -> dict[str, Pulse]:
    """Return the pulse of each load.

    Raises:
        PulseError: A table cannot be read.
    """
    return {name: pulse_of(load) for name, load in loads.items()}


def pulse_of(load: StructureLoad) -> Pulse:
    """Return the pulse of a load, in its own unit; errors as ``pulses_of``."""
    if load.table is not None:
        return read_pulse(Path(load.table), load.quantity, load.table_column)
    if isinstance(load, InputG) and load.service_condition is not None:
        return service_condition(load.service_condition)
    if load.peak is None:
        raise ValueError(f"a load of kind {load.kind} has neither peak nor table")
    if load.pulse != "constant" and load.duration is not None:
        return SHAPES[load.pulse](load.peak, load.duration)
    return Constant(load.peak, load.duration or np.inf)


def pulse_durations(pulses: Mapping[str, Pulse]) -> list[float]:
    """Return the durations [s] of those pulses that have a course of their own."""
    sines = [pulse.duration for pulse in pulses.values() if isinstance(pulse, HalfSine | Haversine)]
    return sines + [float(np.ptp(pulse.times)) for pulse in pulses.values() if isinstance(pulse, Tabulated)]
