"""Loads and damping of a structure: from their parameters to the objects that act on a motion."""

from collections.abc import Mapping

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
from reflowshock.fem.problem.shock import Damping
from reflowshock.fem.problem.structure import Gravity, InputG, PointForce, Pressure, StructureProblem


def structure_loads(
    comm: MPI.Comm, body: Body, tables: StructureTables, problem: StructureProblem, pulses: Mapping[str, Pulse]
) -> list[Load]:
    """Return the loads of a structure on this rank, in the order of the problem; collective."""
    made: list[Load] = []
    for name, load in problem.loads.items():
        pulse = pulses[name]
        if isinstance(load, Pressure) and problem.dynamics.kinematics != "small":
            made.append(FollowerPressure.build(body, tables.pressed[load.on], pulse))
        elif isinstance(load, Pressure):
            nodes, areas = tables.areas[load.on]
            made.append(NodalForces.build(body, nodes, -areas, pulse))
        elif isinstance(load, InputG) and load.method == "large_mass":
            shaken = [tables.nodes_of[problem.supports[support].on] for support in shaken_supports(problem)]
            nodes = np.unique(np.concatenate(shaken))
            made.append(LargeMass.build(comm, body, nodes, (-unit(load.direction), pulse)))
        elif isinstance(load, InputG | Gravity):
            push = -1.0 if isinstance(load, InputG) else 1.0  # seen from the supports, the body is pushed the other way
            made.append(BodyAcceleration(push * unit(load.direction), pulse))
        elif isinstance(load, PointForce):
            nodes, shares = tables.pushed[name]
            made.append(NodalForces.build(body, nodes, np.outer(shares, unit(load.direction)), pulse))
        else:
            local = body.local.locate(tables.nodes_of[load.on])
            made.append(PrescribedVelocity(local[local >= 0], AXES.index(load.component), pulse))
    return made


def unit(direction: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return a vector ``(3,)`` of length one."""
    return np.array(direction) / np.linalg.norm(direction)


def damping_loads(damping: Damping, body: Body) -> list[Load]:
    """Return the damping of a structure, an empty list where there is none."""
    return [RayleighDamping.build(body, damping.coefficients)] if any(damping.coefficients) else []
