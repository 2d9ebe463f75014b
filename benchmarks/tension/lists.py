"""What models of surface tension share: lists of neighbours, and the surface that a simulation asks for."""

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.neighbours import find_near, have_moved
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT

# Of the spacing: how much farther neighbours are listed than they are asked for.
SKIN = 0.4
# The program's own loops are compiled like that: sums in any order, several pairs at a time.
looped = njit(cache=True, parallel=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})


@dataclass(slots=True)
class Lists:
    """Particles within a reach [m] of places, found again when one of either has moved by the skin.

    Attributes:
        reach: [m].
        spacing: of the particles [m].
        rows: offsets `(m + 1,)` and indices.
    """

    reach: float
    spacing: float
    rows: tuple[Indices, Indices] = field(default_factory=lambda: (np.zeros(1, np.int32), np.empty(0, np.int32)))
    _built_at: Floats = field(default_factory=lambda: np.empty((0, 3)))

    def update(self, places: Floats, points: Floats) -> tuple[Indices, Indices]:
        """Return the lists of places `(m, 3)` among points `(n, 3)` [m]."""
        together, skin = np.concatenate((places, points)), SKIN * self.spacing
        if len(together) != len(self._built_at) or have_moved(together.T, self._built_at.T, skin):
            self.rows, self._built_at = find_near(places, points, self.reach + skin), together
        return self.rows


@dataclass(slots=True)
class Untracked:
    """Stands where `Simulation` has its tracked surface: tension as a force on the particles alone.

    Attributes:
        law: of the particles.
        tension: gamma [N/m].
        cosine: of the contact angle.
        pressure: that of a tracked surface [Pa]: there is none.
        needs_volume: whether a step asks for the volume that a tracked surface encloses.
        lists: neighbours within the support of the kernel.
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
        """Nothing is carried along."""

    def add_to(self, rates: Floats, fields: Fields, carriers: int) -> None:
        """Add the accelerations of the model to rows 1 to 3 of the rates `(10, n)`."""
        points = np.stack(fields[:3], axis=1)[:carriers]
        rates[1:4] += self.accelerations(points, fields)

    def accelerations(self, points: Floats, fields: Fields) -> Floats:
        """Accelerations `(3, n)` [m/s^2] of particles at `(n, 3)` [m]."""
        raise NotImplementedError

    def bulk_pressure(self, points: Floats, fields: Fields) -> Floats | float:
        """What the model's own forces add to the pressure of each particle inside `(n,)` [Pa]."""
        return 0.0
