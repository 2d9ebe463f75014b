"""Shared parts of the surface tension models: neighbour lists, and the surface interface of a simulation."""

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import find_near, have_moved
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT

# Skin of the neighbour lists over the spacing.
SKIN = 0.4
# The same compiler options as the program's own loops, so that sums vectorise.
looped = njit(cache=True, parallel=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})


@dataclass(slots=True)
class Lists:
    """Neighbour lists of particles within a reach [m] of points, rebuilt when a point has moved by the skin.

    Attributes:
        reach: Search radius [m].
        spacing: Particle spacing [m].
        rows: Offsets, shape (m + 1,), and indices.
    """

    reach: float
    spacing: float
    rows: tuple[Indices, Indices] = field(default_factory=lambda: (np.zeros(1, np.int32), np.empty(0, np.int32)))
    _built_at: Floats = field(default_factory=lambda: np.empty((0, 3)))

    def update(self, places: Floats, points: Floats) -> tuple[Indices, Indices]:
        """Return the neighbour lists of ``places`` [m], shape (m, 3), among ``points`` [m], shape (n, 3)."""
        together, skin = np.concatenate((places, points)), SKIN * self.spacing
        if len(together) != len(self._built_at) or have_moved(together.T, self._built_at.T, skin):
            self.rows, self._built_at = find_near(places, points, self.reach + skin), together
        return self.rows


@dataclass(slots=True)
class Untracked:
    """Surface tension as a force on the particles, in place of the tracked surface of ``Simulation``.

    Attributes:
        law: Constants of the particles.
        tension: Surface tension gamma [N/m].
        cosine: Cosine of the contact angle.
        pressure: Pressure of a tracked surface [Pa], always zero.
        needs_volume: Whether a step needs the volume enclosed by a tracked surface.
        lists: Neighbours within the kernel support.
    """

    law: Law
    tension: float
    cosine: float = 0.0
    pressure: float = 0.0
    needs_volume: bool = False
    lists: Lists = field(init=False)

    def __post_init__(self) -> None:
        self.lists = Lists(SUPPORT * self.law.length, self.law.spacing)

    def move(self, velocity: Floats, time_step: float, volume: float) -> None:
        """Do nothing, since no surface is advected."""

    def add_to(self, rates: Floats, fields: Fields, carriers: int) -> None:
        """Add the accelerations of the model to rows 1 to 3 of the rates, shape (10, n)."""
        points = np.stack(fields[:3], axis=1)[:carriers]
        rates[1:4] += self.accelerations(points, fields)

    def accelerations(self, points: Floats, fields: Fields) -> Floats:
        """Return accelerations [m/s^2], shape (3, n), of particles at points [m], shape (n, 3)."""
        raise NotImplementedError

    def bulk_pressure(self, points: Floats, fields: Fields) -> Floats | float:
        """Return the contribution [Pa] of the model's forces to the pressure of inner particles, shape (n,)."""
        return 0.0
