"""Physics of a liquid body: forces, operators, events and constraints of the active effects."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import slide
from reflowshock.particles.core.symmetry import fold
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.plate_motion import PlateMotion
from reflowshock.particles.surface.contact_line import ContactLine


class Force(Protocol):
    """Conservative force on the surface."""

    def energy(self, body: Body) -> float:
        """Return the energy [J]."""

    def force(self, body: Body) -> Floats:
        """Return the force -dE/dx, shape (n, 3) [N]: the exact negative gradient of ``energy``."""


class BodyForce(ABC):
    """Force on the volume of the liquid, applied as an equal load on its surface."""

    __slots__ = ()

    @abstractmethod
    def hydrostatic_pressure(self, points: Floats) -> Floats:
        """Return the pressure whose gradient balances the force, which the solver does not see, shape (n,) [Pa]."""


class Operator(Protocol):
    """Part of the implicit step: a symmetric matrix that multiplies the new velocity."""

    def matrix(self, body: Body, space: Discretisation, time_step: float) -> sparse.csr_matrix:
        """Return the matrix, shape (3 n, 3 n) [kg/s], ordered by component."""


class Momentum(Protocol):
    """Momentum carried over from the last step."""

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """Return the momentum divided by the time step, shape (n, 3) [N]."""


class Hold(Protocol):
    """Constraint that pins particles to their plates."""

    def pinned(self, body: Body) -> NDArray[np.int32]:
        """Return the indices of the pinned particles."""


class Event(Protocol):
    """Discrete change of the boundary before a step."""

    def update(self, body: Body) -> None:
        """Change the state of the boundary without changing the energy."""

    def attempt(self, body: Body) -> bool:
        """Make a change that may raise the energy; return whether any was made.

        The caller undoes it unless the next step lowers the energy again.
        """


@dataclass(frozen=True, slots=True)
class Physics:
    """Active effects on a body; the lists contain only the effects that are on.

    Attributes:
        forces: Conservative forces.
        operators: Parts of the implicit matrix, including the mass.
        momenta: Momenta of the last step; empty in the quasi-static mode, where each step relaxes towards rest.
        events: Changes of the boundary before a step.
        lines: Contact lines, which hold their pinned vertices.
        motions: Motions of the moving plates.
        frictions: Operators on the velocities relative to the plates.
        holds: Further constraints that pin particles to their plates.
        is_axisymmetric: Whether the effects keep the axis of a drop.
    """

    forces: Sequence[Force]
    operators: Sequence[Operator]
    momenta: Sequence[Momentum]
    events: Sequence[Event]
    lines: Sequence[ContactLine]
    motions: Sequence[PlateMotion] = ()
    frictions: Sequence[Operator] = ()
    holds: Sequence[Hold] = ()
    is_axisymmetric: bool = True

    def force(self, body: Body) -> Floats:
        """Return the sum of the forces, shape (n, 3) [N]."""
        return sum((force.force(body) for force in self.forces), np.zeros_like(body.points))

    def energy(self, body: Body) -> float:
        """Return the sum of the energies [J], including the potential of the loads on the plates."""
        loads = sum(float(motion.load @ body.plates[motion.wall].origin) for motion in self.motions)
        return sum(force.energy(body) for force in self.forces) - loads

    def pinned(self, body: Body) -> NDArray[np.bool_]:
        """Return whether each particle is pinned by an edge or a wall, shape (n,)."""
        pinned = np.zeros(len(body.points), bool)
        for hold in (*self.lines, *self.holds):
            pinned[hold.pinned(body)] = True
        return pinned

    def admit(self, body: Body, field: Floats) -> Floats:
        """Project a displacement field on the admissible one, shape (n, 3).

        Particles slide along resting plates and planes of symmetry; pinned particles do not move.
        """
        along = fold(body.cloud, slide(body.plates, body.cloud.wall, field))
        return np.where(self.pinned(body)[:, None], 0.0, along)

    def projections(self, body: Body) -> Floats:
        """Return the projection matrices of ``admit``, one per particle, shape (n, 3, 3)."""
        fields = (np.tile(axis, (len(body.points), 1)) for axis in np.eye(3))
        return np.stack([self.admit(body, field) for field in fields], axis=-1)


class Acting(Protocol):
    """Class that implements an effect; ``LiquidEffect.implementation`` names it."""

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """Return the physics extended by the effect, with the properties of the solder."""


def plate_wrench(body: Body, others: Sequence[Force], wall: int) -> Floats:
    """Compute the wrench of the solder on a plate.

    A moving plate carries its contact line along, and the energy E - p V changes by the forces on the line: the tension
    of the free surface, and the pressure on the wetted area and on the line's share of the free surface.

    Args:
        body: Body at rest.
        others: Surface forces that act, except wetting, since the wetted area does not change with the plate.
        wall: Index of the plate in ``body.plates``.

    Returns:
        Force [N] and moment about the origin of the plate [N m], shape (6,).
    """
    ring = body.cloud.rings[wall]
    pressure = body.surface_pressure * body.volume()[1]
    load = sum((force.force(body) for force in others), pressure)[ring]
    lever = body.points[ring] - body.plates[wall].origin
    return np.concatenate((load.sum(axis=0), np.cross(lever, load).sum(axis=0)))
