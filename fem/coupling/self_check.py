"""What must be exact between two models before they move: fields through tie and interface, forces back, masses."""

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
SHIFT = np.array([0.2, -0.5, 0.3])  # of the size of the models


@dataclass(frozen=True, slots=True)
class SelfCheck:
    """What was found, the same on all ranks.

    Attributes:
        rigid: Largest error of a rigid motion at slaves and interface, of its size.
        linear: The same of a linear field.
        tie: Net force and moment that ties lose, of the sum of magnitudes.
        interface: The same of the coupling interface.
        macro_mass: Mass of the macro model [kg].
        interface_mass: Mass that the meso model gives to the nodes of the interface [kg].
        meso_mass: Its other mass [kg].
        volume_mass: Density times volume of both, and lumped masses [kg].
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
        """Check that all is exact.

        Raises:
            AgreedError: A residual above 1e-12, or masses that do not add up.
        """
        sums = self.macro_mass + self.interface_mass + self.meso_mass
        exact = max(self.rigid, self.linear, self.tie, self.interface) <= EXACT  # false for what is no number
        if not exact or not abs(sums - self.volume_mass) <= MASS_TOLERANCE * self.volume_mass:
            raise AgreedError(f"{self.words}; residuals must be at most {EXACT:g}, masses equal to {MASS_TOLERANCE:g}")


def recorded(checked: SelfCheck | None) -> dict[str, Any]:
    """Return what was found for the result, empty for a run of one model."""
    return {"self_check": asdict(checked)} if checked else {}


def self_check(world: MPI.Comm, bodies: Mapping[Role, Body], channels: InterfaceChannels) -> SelfCheck:
    """Try the ties and the interface of two models; collective over ``world``."""
    size = max(float(np.ptp(body.local.points, axis=0).max()) for body in bodies.values())
    size = world.allreduce(size, MPI.MAX)
    rigid, linear = (field_error(bodies, channels, gradient, size) for gradient in (RIGID, LINEAR))
    tie, interface = load_errors(world, bodies, channels, size)
    return SelfCheck(
        world.allreduce(rigid, MPI.MAX),
        world.allreduce(linear, MPI.MAX),
        tie,
        interface,
        *world.allreduce(masses(bodies)),
    )


def field_error(
    bodies: Mapping[Role, Body], channels: InterfaceChannels, gradient: NDArray[np.float64], size: float
) -> float:
    """Return the largest error of a linear field on this rank, at slaves and where the meso model received it."""
    error = 0.0
    for role in sorted(bodies):  # the macro model sends before a rank that has both receives
        body = bodies[role]
        exact = body.local.points @ gradient + size * SHIFT
        values = exact.copy()
        wanted = body.tie.slave
        if role == "meso":
            here = body.interface[body.interface >= 0]
            values[here] = np.nan
            channels.velocities.receive(values)
            wanted = np.concatenate([wanted, here])
        body.tie.spread(values)
        if role == "macro":
            channels.velocities.send(values)
        error = max(error, float(np.abs(values[wanted] - exact[wanted]).max(initial=0.0)) / size)
    return error


def load_errors(
    world: MPI.Comm, bodies: Mapping[Role, Body], channels: InterfaceChannels, size: float
) -> tuple[float, float]:
    """Return the net load that ties, and that the interface, lose of the sum of magnitudes; collective."""
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
        here = body.interface[body.interface >= 0]
        here = here[owned[here]]
        if role == "meso":
            force = np.sin(size * 7.0 + 1e3 * points / size)  # the same on all copies of a node
            channels.forces.send(force)
            lost[1] += net_load(points[here], force[here])
            amount[1] += float(np.abs(force[here]).sum())
        else:
            force[:] = 0.0
            channels.forces.receive(force)
            lost[1] -= net_load(points[here], force[here])
    lost, amount = world.allreduce(lost), world.allreduce(amount)
    scale = np.where(amount > 0.0, amount, 1.0)[:, None] * np.array([1.0] * 3 + [size] * 3)
    tie, interface = np.abs(lost / scale).max(axis=1)
    return float(tie), float(interface)


def masses(bodies: Mapping[Role, Body]) -> NDArray[np.float64]:
    """Return this rank's masses ``(4,)`` [kg]: macro model, interface, rest of the meso model, volumes and lumped."""
    found = np.zeros(4)
    for role, body in bodies.items():
        own = np.where(body.shared.owned, body.mass, 0.0)
        at_interface = float(own[body.interface[body.interface >= 0]].sum())
        found[:3] += [own.sum(), 0.0, 0.0] if role == "macro" else [0.0, at_interface, own.sum() - at_interface]
        found[3] += float(body.elements.density @ body.geometry.volume) + body.lumped
    return found
