"""Loads of a drop shock: from its parameters to the objects that act on each model."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI

from fem.body import Body
from fem.damping import RayleighDamping
from fem.effects import Effect, weight
from fem.errors import LoadError
from fem.large_mass import LargeMass
from fem.loads import DOWN, BodyAcceleration, Load
from fem.parameters import Shock
from fem.pulse import STANDARD_GRAVITY, Constant, HalfSine, Pulse, Tabulated, service_condition
from fem.pulse_table import read_pulse
from fem.scene import JointTables


@dataclass(frozen=True, slots=True)
class ShockPulse:
    """The course of the shock, and whether weight acts beside it.

    Attributes:
        pulse: Upward acceleration of the table [m/s^2].
        source: Where it comes from, in words.
        gravity: Whether weight acts, and why, as an effect.
    """

    pulse: Pulse
    source: str
    gravity: Effect


def shock_pulse(shock: Shock) -> ShockPulse:
    """Return the pulse of a shock.

    Raises:
        PulseError: A table cannot be read.
    """
    pulse, source = input_pulse(shock)
    peak = float(np.abs(pulse.values).max()) if isinstance(pulse, Tabulated) else pulse.peak
    return ShockPulse(pulse, source, weight(shock.gravity, peak, STANDARD_GRAVITY))


def input_pulse(shock: Shock) -> tuple[HalfSine | Tabulated, str]:
    """Return the acceleration of the drop table [m/s^2], and where it comes from; errors as ``shock_pulse``."""
    if shock.table is not None:
        return read_pulse(Path(shock.table), "acceleration"), f"table {Path(shock.table).name}"
    if shock.service_condition is not None:
        return service_condition(shock.service_condition), f"JEDEC service condition {shock.service_condition}"
    if shock.peak_acceleration is None or shock.pulse_duration is None:
        raise ValueError("a shock needs peak_acceleration and pulse_duration, a service_condition, or a table")
    return HalfSine(shock.peak_acceleration, shock.pulse_duration), "half sine"


def check_shaken(tables: Iterable[JointTables], shock: Shock) -> None:
    """Find out before anything is distributed whether a large mass has nodes to act on.

    Raises:
        LoadError: No model has any.
    """
    if shock.method == "large_mass" and not any(len(item.shaken) for item in tables):
        raise LoadError("shock.method = large_mass needs mounting holes: the facet set mounting_holes is empty")


def shock_loads(comm: MPI.Comm, mass: float, body: Body, tables: JointTables, shock: Shock) -> list[Load]:
    """Return the loads and the damping of one model on this rank; collective over the model.

    A model without holes for a large mass to act on only tells its results from that frame.

    Args:
        comm: Communicator of the model.
        mass: Of all models, which a large mass is to move [kg].
        body: The model.
        tables: Its support nodes.
        shock: Pulse, method, gravity, damping.
    """
    chosen = shock_pulse(shock)
    made: list[Load] = [BodyAcceleration(DOWN, Constant(STANDARD_GRAVITY))] if chosen.gravity["on"] else []
    if shock.method == "direct":
        made.append(BodyAcceleration(DOWN, chosen.pulse))
    elif not len(tables.shaken):
        made.append(LargeMass(np.empty(0, np.int32), np.empty(0), DOWN, chosen.pulse))
    else:
        made.append(LargeMass.build(comm, body, tables.shaken, (DOWN, chosen.pulse), mass))
    if any(shock.damping.coefficients):
        made.append(RayleighDamping.build(body, shock.damping.coefficients))
    return made
