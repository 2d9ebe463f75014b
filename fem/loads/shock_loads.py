"""Loads of a drop shock: from its parameters to the objects that act on each model."""

from collections.abc import Iterable

from mpi4py import MPI

from reflowshock.fem.division.tables import JointTables
from reflowshock.fem.errors import LoadError
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.large_mass import LargeMass, ShakenBase
from reflowshock.fem.loads.load import DOWN, BodyAcceleration, Load
from reflowshock.fem.loads.pulse import STANDARD_GRAVITY, Constant
from reflowshock.fem.loads.shock_pulse import shock_pulse
from reflowshock.fem.model.body import Body
from reflowshock.fem.problem.shock import Shock


def check_shaken(tables: Iterable[JointTables], shock: Shock) -> None:
    """Find out before anything is distributed whether a large mass has nodes to act on.

    Raises:
        LoadError: No model has any.
    """
    if shock.method == "large_mass" and not any(len(item.shaken) for item in tables):
        raise LoadError("shock.method = large_mass needs mounting holes: the facet set mounting_holes is empty")


def shock_loads(comm: MPI.Comm, mass: float, body: Body, tables: JointTables, shock: Shock) -> list[Load]:
    """Return the loads and the damping of one model on this rank; collective over the model.

    A model without holes for a large mass to act on tells its results from that frame, and has no load at nodes.

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
        made.append(ShakenBase(DOWN, chosen.pulse))
    else:
        made.append(LargeMass.build(comm, body, tables.shaken, (DOWN, chosen.pulse), mass))
    if any(shock.damping.coefficients):
        made.append(RayleighDamping.build(body, shock.damping.coefficients))
    return made
