"""What acts on a liquid body: lists of effects. An effect that is off is absent from its list."""

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
    """A conservative force on the surface."""

    def energy(self, body: Body) -> float:
        """Energy [J]."""

    def force(self, body: Body) -> Floats:
        """Force -dE/dx, `(n, 3)` [N]: the gradient of this very energy, so that a step along it lowers it."""


class Operator(Protocol):
    """A part of the implicit step: a symmetric matrix that multiplies the new velocity."""

    def matrix(self, body: Body, space: Discretisation, time_step: float) -> sparse.csr_matrix:
        """Matrix `(3 n, 3 n)` [kg/s], components one after the other."""


class Momentum(Protocol):
    """What is left of the last step's velocity."""

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """Momentum over the time step, `(n, 3)` [N]."""


class Hold(Protocol):
    """What keeps particles where they are on their plates."""

    def pinned(self, body: Body) -> NDArray[np.int32]:
        """The particles."""


class Event(Protocol):
    """A discrete change before a step."""

    def update(self, body: Body) -> None:
        """Change the state of the body's boundary where that changes no energy."""

    def attempt(self, body: Body) -> bool:
        """Change it where a step may make up for the energy, which is else undone; return whether it did."""


@dataclass(frozen=True, slots=True)
class Physics:
    """Everything that acts on a body.

    Attributes:
        forces: conservative forces.
        operators: parts of the implicit matrix; the mass is one of them.
        momenta: empty in the quasi-static mode, where each step relaxes towards rest.
        events: changes before a step.
        lines: contact lines, which hold their pinned vertices.
        motions: of the plates that do not rest.
        frictions: operators on the velocities relative to the plates.
        holds: what else pins particles to their plates.
    """

    forces: Sequence[Force]
    operators: Sequence[Operator]
    momenta: Sequence[Momentum]
    events: Sequence[Event]
    lines: Sequence[ContactLine]
    motions: Sequence[PlateMotion] = ()
    frictions: Sequence[Operator] = ()
    holds: Sequence[Hold] = ()

    def force(self, body: Body) -> Floats:
        """Sum of the forces `(n, 3)` [N]."""
        return sum((force.force(body) for force in self.forces), np.zeros_like(body.points))

    def energy(self, body: Body) -> float:
        """Sum of the energies [J], with the potential of the loads on the plates."""
        loads = sum(float(motion.load @ body.plates[motion.wall].origin) for motion in self.motions)
        return sum(force.energy(body) for force in self.forces) - loads

    def pinned(self, body: Body) -> NDArray[np.bool_]:
        """The particles that edges and walls hold, `(n,)`."""
        pinned = np.zeros(len(body.points), bool)
        for hold in (*self.lines, *self.holds):
            pinned[hold.pinned(body)] = True
        return pinned

    def admit(self, body: Body, field: Floats) -> Floats:
        """The part of a displacement `(n, 3)` that resting plates, symmetry (free slip) and edges (none) allow."""
        along = fold(body.cloud, slide(body.plates, body.cloud.wall, field))
        return np.where(self.pinned(body)[:, None], 0.0, along)

    def projections(self, body: Body) -> Floats:
        """The matrices `(n, 3, 3)` of `admit`, one for each particle: what it leaves of the unit vectors."""
        fields = (np.tile(axis, (len(body.points), 1)) for axis in np.eye(3))
        return np.stack([self.admit(body, field) for field in fields], axis=-1)


class Acting(Protocol):
    """The object of an effect, `place` in `parameters/effects.py`: a class that joins what acts."""

    @classmethod
    def added_to(cls, physics: Physics, solder: Solder) -> Physics:
        """The lists with an object of it for a solder."""


def plate_wrench(body: Body, others: Sequence[Force], wall: int) -> Floats:
    """Force `(3,)` [N] and moment about the plate's origin `(3,)` [N m] of the solder on a plate, `(6,)`.

    A plate that moves takes its contact line along, and the energy E - p V changes by the forces on the line: the
    pull of the free surface, and the pressure on the wetted area and on the line's share of the free surface.

    Args:
        body: a body at rest.
        others: forces on the surface but wetting (the wetted area does not change).
        wall: index of the plate.
    """
    ring = body.cloud.rings[wall]
    pressure = body.surface_pressure * body.volume()[1]
    load = sum((force.force(body) for force in others), pressure)[ring]
    lever = body.points[ring] - body.plates[wall].origin
    return np.concatenate((load.sum(axis=0), np.cross(lever, load).sum(axis=0)))
