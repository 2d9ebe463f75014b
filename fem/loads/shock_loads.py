"""Loads and damping of a drop shock: objects that act on each model, built from parameters."""

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
    """Check that a large mass, which moves the supports in place of the drop table, has support nodes to act on.

    Args:
        tables: Tables of all models, with the nodes of their mounting holes.
        shock: Parameters of the shock; nothing is checked unless its method is ``large_mass``.

    Raises:
        LoadError: No model has support nodes.
    """
    if shock.method == "large_mass" and not any(len(item.shaken) for item in tables):
        raise LoadError("shock.method = large_mass needs mounting holes: the facet set mounting_holes is empty")


def shock_loads(comm: MPI.Comm, mass: float, body: Body, tables: JointTables, shock: Shock) -> list[Load]:
    """Return the loads and the damping of one model on this rank; collective over the model.

    With a large mass, a model without support nodes has no nodal load; its results refer to the frame of the mass.

    Args:
        comm: Communicator of the model.
        mass: Total mass of all models, for the size of a large mass [kg].
        body: Model on this rank.
        tables: Tables of the model, with its support nodes.
        shock: Parameters of the shock.

    Returns:
        Gravity if it acts, body acceleration or large mass that drives the model, and damping if the shock has any.
    """
    pulse = shock_pulse(shock)
    loads: list[Load] = [BodyAcceleration(DOWN, Constant(STANDARD_GRAVITY))] if pulse.gravity["on"] else []
    if shock.method == "direct":
        loads.append(BodyAcceleration(DOWN, pulse.pulse))
    elif not len(tables.shaken):
        loads.append(ShakenBase(DOWN, pulse.pulse))
    else:
        loads.append(LargeMass.build(comm, body, tables.shaken, BodyAcceleration(DOWN, pulse.pulse), mass))
    if any(shock.damping.coefficients):
        loads.append(RayleighDamping.build(body, *shock.damping.coefficients))
    return loads
