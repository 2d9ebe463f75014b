"""Self-check before a coupled run: exactness of fields, forces and masses through tie and interface."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.errors import AgreedError
from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.mesh.tie import EXACT, net_load
from reflowshock.fem.model.assembly import MASS_TOLERANCE
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.exchange import InterfaceChannels

RIGID = np.array([[0.0, -0.7, 0.4], [0.7, 0.0, -0.9], [-0.4, 0.9, 0.0]])
LINEAR = np.array([[0.3, -1.0, 0.5], [1.0, 0.2, -0.7], [-0.4, 0.6, 1.0]])
SHIFT = np.array([0.2, -0.5, 0.3])  # relative to the size of the models


@dataclass(frozen=True, slots=True)
class SelfCheck:
    """Result of the self-check, equal on all ranks.

    Attributes:
        rigid: Largest relative error of a rigid motion at slaves and interface.
        linear: Largest relative error of a linear field at slaves and interface.
        tie: Net force and moment lost by ties, relative to the sum of magnitudes.
        interface: Net force and moment lost at the coupling interface, relative to the sum of magnitudes.
        macro_mass: Mass of the macro model [kg].
        interface_mass: Mass of the meso model at interface nodes [kg].
        meso_mass: Remaining mass of the meso model [kg].
        volume_mass: Density times volume of both models plus attached masses [kg].
    """

    rigid: float
    linear: float
    tie: float
    interface: float
    macro_mass: float
    interface_mass: float
    meso_mass: float
    volume_mass: float

    @property
    def words(self) -> str:
        """Return it in a line."""
        return (
            f"self-check: rigid motion {self.rigid:.1e}, linear field {self.linear:.1e}, net force and moment through"
            f" tie {self.tie:.1e} and interface {self.interface:.1e}; mass {self.macro_mass:.6e} +"
            f" {self.interface_mass:.6e} (interface) + {self.meso_mass:.6e} = {self.volume_mass:.6e} kg"
        )

    def judge(self) -> None:
        """Check that all residuals are at round-off.

        Raises:
            AgreedError: A residual exceeds ``EXACT``, or the masses do not add up.
        """
        sums = self.macro_mass + self.interface_mass + self.meso_mass
        exact = max(self.rigid, self.linear, self.tie, self.interface) <= EXACT  # False for NaN
        if not exact or not abs(sums - self.volume_mass) <= MASS_TOLERANCE * self.volume_mass:
            raise AgreedError(f"{self.words}; residuals must be at most {EXACT:g}, masses equal to {MASS_TOLERANCE:g}")


def recorded(checked: SelfCheck | None) -> dict[str, Any]:
    """Return the self-check as a section of ``result.json``.

    Args:
        checked: Result of the self-check, None for a run with one model.

    Returns:
        ``{"self_check": {...}}`` with the attributes of ``SelfCheck`` as keys; an empty dictionary for None.
    """
    return {"self_check": asdict(checked)} if checked else {}


def self_check(world: MPI.Comm, bodies: Mapping[Role, Body], channels: InterfaceChannels) -> SelfCheck:
    """Measure the errors of fields, forces and masses at ties and interface of two models; collective over ``world``.

    The limits of these errors are checked by ``SelfCheck.judge``.

    Args:
        world: Communicator of all ranks.
        bodies: Models of this rank, ``macro``, ``meso`` or both.
        channels: Open channels between both models.

    Returns:
        Relative errors of a rigid motion, a linear field and net forces, and the masses of both models [kg]; equal on
        all ranks.
    """
    size = max(float(np.ptp(body.local.points, axis=0).max()) for body in bodies.values())
    size = world.allreduce(size, MPI.MAX)
    rigid, linear = (_field_error(bodies, channels, gradient, size) for gradient in (RIGID, LINEAR))
    tie, interface = _load_errors(world, bodies, channels, size)
    return SelfCheck(
        world.allreduce(rigid, MPI.MAX),
        world.allreduce(linear, MPI.MAX),
        tie,
        interface,
        *world.allreduce(_masses(bodies)),
    )


def _field_error(
    bodies: Mapping[Role, Body], channels: InterfaceChannels, gradient: NDArray[np.float64], size: float
) -> float:
    """Return the largest relative error of a linear field on this rank, at slaves and received interface values."""
    error = 0.0
    for role in sorted(bodies):  # the macro model sends before a rank that has both receives
        body = bodies[role]
        exact = body.local.points @ gradient + size * SHIFT
        values = exact.copy()
        checked_nodes = body.tie.slave
        if role == "meso":
            interface = body.interface[body.interface >= 0]
            values[interface] = np.nan
            channels.velocities.receive(values)
            checked_nodes = np.concatenate([checked_nodes, interface])
        body.tie.spread(values)
        if role == "macro":
            channels.velocities.send(values)
        error = max(error, float(np.abs(values[checked_nodes] - exact[checked_nodes]).max(initial=0.0)) / size)
    return error


def _load_errors(
    world: MPI.Comm, bodies: Mapping[Role, Body], channels: InterfaceChannels, size: float
) -> tuple[float, float]:
    """Return the relative net load lost by the ties and at the interface; collective."""
    lost, amount = np.zeros((2, 6)), np.zeros(2)
    for role in sorted(bodies, reverse=True):  # now the meso model sends
        body = bodies[role]
        points, owned = body.local.points, body.shared.owned
        force = np.zeros_like(points)
        force[body.tie.slave] = np.sin(1.0 + np.arange(3 * len(body.tie.slave))).reshape(-1, 3)
        lost[0] += net_load(points, force)
        amount[0] += float(np.abs(force).sum())
        body.tie.gather(force)
        body.shared.add(force)
        lost[0] -= net_load(points[owned], force[owned])
        nodes = body.interface[body.interface >= 0]
        nodes = nodes[owned[nodes]]
        if role == "meso":
            force = np.sin(size * 7.0 + 1e3 * points / size)  # equal on all copies of a node
            channels.forces.send(force)
            lost[1] += net_load(points[nodes], force[nodes])
            amount[1] += float(np.abs(force[nodes]).sum())
        else:
            force[:] = 0.0
            channels.forces.receive(force)
            lost[1] -= net_load(points[nodes], force[nodes])
    lost, amount = world.allreduce(lost), world.allreduce(amount)
    scale = np.where(amount > 0.0, amount, 1.0)[:, None] * np.array([1.0] * 3 + [size] * 3)
    tie, interface = np.abs(lost / scale).max(axis=1)
    return float(tie), float(interface)


def _masses(bodies: Mapping[Role, Body]) -> NDArray[np.float64]:
    """Return this rank's masses of macro model, interface, rest of the meso model, and volumes, shape (4,) [kg]."""
    result = np.zeros(4)
    for role, body in bodies.items():
        mass = np.where(body.shared.owned, body.mass, 0.0)
        at_interface = float(mass[body.interface[body.interface >= 0]].sum())
        result[:3] += [mass.sum(), 0.0, 0.0] if role == "macro" else [0.0, at_interface, mass.sum() - at_interface]
        result[3] += float(body.elements.density @ body.geometry.volume) + body.lumped
    return result
