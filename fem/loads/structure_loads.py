"""Loads and damping of a structure: objects that act on a motion, built from parameters.

``BUILDERS`` has one row for each kind of load of ``problem.load_kinds``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.structure_tables import StructureTables, shaken_supports
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.follower_pressure import FollowerPressure
from reflowshock.fem.loads.large_mass import LargeMass
from reflowshock.fem.loads.load import BodyAcceleration, Load, NodalForces, PrescribedVelocity
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.model.body import Body
from reflowshock.fem.problem.fittings import AXES
from reflowshock.fem.problem.load_kinds import Gravity, InputG, PointForce, PrescribedMotion, Pressure, Pulsed
from reflowshock.fem.problem.shock import Damping
from reflowshock.fem.problem.structure import StructureProblem


@dataclass(frozen=True, slots=True)
class LoadedModel:
    """Model on which loads act.

    Attributes:
        comm: Communicator of the model.
        body: Model on this rank.
        tables: Nodes and areas of facet sets, nodes at point forces.
        problem: Parameters of the structure.
    """

    comm: MPI.Comm
    body: Body
    tables: StructureTables
    problem: StructureProblem


def structure_loads(model: LoadedModel, pulses: Mapping[str, Pulse]) -> list[Load]:
    """Return the loads of a structure on this rank, in the order of the case file; collective.

    Args:
        model: Model on which the loads act.
        pulses: Name of a load -> its pulse over time [s], in SI units of the load.
    """
    return [BUILDERS[type(load)](model, name, load, pulses[name]) for name, load in model.problem.loads.items()]


def _input_g(model: LoadedModel, name: str, load: InputG, pulse: Pulse) -> Load:
    if not load.is_large_mass:
        return BodyAcceleration(-unit(load.direction), pulse)  # inertia acts against the acceleration of the supports
    supports = [model.tables.nodes_of[model.problem.supports[name].on] for name in shaken_supports(model.problem)]
    nodes = np.unique(np.concatenate(supports))
    return LargeMass.build(model.comm, model.body, nodes, BodyAcceleration(-unit(load.direction), pulse))


def _gravity(model: LoadedModel, name: str, load: Gravity, pulse: Pulse) -> Load:
    return BodyAcceleration(unit(load.direction), pulse)


def _pressure(model: LoadedModel, name: str, load: Pressure, pulse: Pulse) -> Load:
    if model.problem.dynamics.kinematics != "small":
        return FollowerPressure.build(model.body, model.tables.pressed[load.on], pulse)
    nodes, areas = model.tables.areas[load.on]
    return NodalForces.build(model.body, nodes, -areas, pulse)


def _prescribed_motion(model: LoadedModel, name: str, load: PrescribedMotion, pulse: Pulse) -> Load:
    local = model.body.local.locate(model.tables.nodes_of[load.on])
    return PrescribedVelocity(local[local >= 0], AXES.index(load.component), pulse)


def _point_force(model: LoadedModel, name: str, load: PointForce, pulse: Pulse) -> Load:
    nodes, shares = model.tables.pushed[name]
    return NodalForces.build(model.body, nodes, np.outer(shares, unit(load.direction)), pulse)


Builder = Callable[[LoadedModel, str, Any, Pulse], Load]
BUILDERS: Mapping[type[Pulsed], Builder] = {
    InputG: _input_g,
    Gravity: _gravity,
    Pressure: _pressure,
    PrescribedMotion: _prescribed_motion,
    PointForce: _point_force,
}


def unit(direction: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return the unit vector along a direction, shape (3,).

    Args:
        direction: Components along x, y, z, not all zero.
    """
    return np.array(direction) / np.linalg.norm(direction)


def damping_loads(damping: Damping, body: Body) -> list[Load]:
    """Return the Rayleigh damping of a structure as a list with one load, or an empty list without damping.

    Args:
        damping: Coefficients of mass-proportional [1/s] and stiffness-proportional [s] damping.
        body: Model on this rank.
    """
    return [RayleighDamping.build(body, *damping.coefficients)] if any(damping.coefficients) else []
