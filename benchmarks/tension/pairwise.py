"""Surface tension of forces between pairs: f(r) = s cos(3 pi r / (2 L)) up to L (Tartakovsky & Meakin 2005).

Particles repel each other within L / 3 and attract each other farther off; there are 27 in L^3. With n particles a
volume a continuum of them has the tension gamma = -(pi / 8) n^2 times the integral of r^4 f, and a pressure of
(2 pi / 3) n^2 times that of r^3 f (Tartakovsky & Panchenko 2016, after Kirkwood & Buff 1949): the first gives the
strength s; the second, which is negative, is taken off the reference density of the equation of state, so that the
liquid rests with the density that it has.

That pressure p is balanced by one of the sums of SPH, whose forces between pairs have by the same integral a tension of
their own, -p <r> / 4 with the mean distance <r> of the kernel, in the limit of many neighbours: hence a factor of s is
calibrated. A wall is a half space of as many particles. Its images give the liquid its pressure whole, so that works of
adhesion and cohesion (Young & Dupre) ask for the strength (1 + cos theta / factor) / 2 of that among the liquid's; the
force depends on height alone and is integrated once.
"""

from dataclasses import dataclass, field
from math import pi, sqrt

import numpy as np
from numba import njit, prange

from benchmarks.tension.lists import Lists, Untracked, looped
from reflowshock.arrays import Floats
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import slope

# With x = 3 pi r / (2 L): the integrals of x^3 cos x and of x^4 cos x from 0 to 3 pi / 2.
REACH = 1.5 * pi
THIRD, FOURTH = -(REACH**3) + 6.0 * REACH + 6.0, -(REACH**4) + 12.0 * REACH**2 - 24.0
HEIGHTS = 400
# L over the spacing: 27 particles in L^3.
PAIRED = 3.0
# Added to distances [m], far below rounding: a particle does nothing to itself.
NOTHING = 1e-200


def strength(law: Law, tension: float) -> float:
    """Return s [N] at which a continuum of particles a spacing apart has a tension [N/m]."""
    per_volume, length = law.spacing**-3, PAIRED * law.spacing / REACH
    return tension / (-(pi / 8.0) * per_volume**2 * length**5 * FOURTH)


def cohesion(law: Law, tension: float) -> float:
    """Return the pressure of these forces inside the liquid [Pa], a negative one."""
    per_volume, length = law.spacing**-3, PAIRED * law.spacing / REACH
    return (2.0 * pi / 3.0) * per_volume**2 * strength(law, tension) * length**4 * THIRD


@dataclass(slots=True)
class Pairwise(Untracked):
    """The forces of pairs; `factor`: their strength over the theoretical one."""

    factor: float = 1.0
    _by_height: Floats = field(init=False)

    def __post_init__(self) -> None:
        Untracked.__post_init__(self)
        self.lists = Lists(PAIRED * self.law.spacing, self.law.spacing)
        self._by_height = _wall_force(self.lists.reach, self.law.spacing)

    def accelerations(self, points: Floats, fields: Fields) -> Floats:
        """As `Untracked.accelerations`."""
        lists, force = self.lists.update(points, points), np.zeros((3, len(points)))
        size = self.factor * strength(self.law, self.tension)
        _pair_forces(lists, points, self.lists.reach, force, np.empty(len(points)))
        if self.law.mirror:
            heights = np.linspace(0.0, self.lists.reach, HEIGHTS)
            force[2] += 0.5 * (1.0 + self.cosine / self.factor) * np.interp(points[:, 2], heights, self._by_height)
        return size * force / fields.mass[: len(points)]

    def bulk_pressure(self, points: Floats, fields: Fields) -> Floats:
        """As `Untracked.bulk_pressure`: a sixth of the virials of pairs, times particles a volume.

        It balances a pressure of the equation of state many times that of the drop, so that what the sums over pairs
        make of the latter counts: its own virial in place of it.
        """
        lists, virial, pressure_virial = self.lists.update(points, points), np.empty(len(points)), np.empty(len(points))
        _pair_forces(lists, points, self.lists.reach, np.empty((3, len(points))), virial)
        _virials_of_pressure(lists, fields, self.law, pressure_virial)
        per_volume = fields.density / fields.mass
        return (
            self.factor * strength(self.law, self.tension) * virial * per_volume / 6.0
            + pressure_virial
            - fields.pressure
        )


def _wall_force(reach: float, spacing: float) -> Floats:
    """Force of a half space of particles over s at heights `(400,)` up to the reach [m]."""
    height = np.linspace(0.0, reach, HEIGHTS)
    scale = REACH / reach
    inner = (np.sin(REACH) - np.sin(scale * height)) / scale  # of f / s from a height to the reach
    moment = height * inner
    steps = 0.5 * (moment[1:] + moment[:-1]) * np.diff(height)
    return 2.0 * pi / spacing**3 * np.append(np.cumsum(steps[::-1])[::-1], 0.0)


@looped
def _virials_of_pressure(lists, fields, law, virials):
    """A sixth of the virials of the forces of pressure, times particles a volume `(n,)` [Pa]."""
    offsets, indices = lists
    for i in prange(virials.shape[0]):
        total = 0.0
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            dx, dy, dz = fields.x[i] - fields.x[j], fields.y[i] - fields.y[j], fields.z[i] - fields.z[j]
            distance2 = dx * dx + dy * dy + dz * dz
            weight = slope(law.kernel, False, sqrt(distance2) / law.length) * fields.mass[j] / fields.density[j]
            total -= (fields.pressure[i] + fields.pressure[j]) * weight * distance2
        virials[i] = law.norm / law.length**2 * total / 6.0


@njit(cache=True, error_model="numpy")
def _cosine(square):
    """Cosine of the root of a square up to (3 pi / 2)^2, to 1e-6: a series, so that pairs are computed side by side."""
    total = 1.0
    for k in range(11, 0, -1):
        total = 1.0 - square * total / ((2 * k) * (2 * k - 1))
    return total


@looped
def _pair_forces(lists, points, reach, force, virial):
    """Forces `(3, n)` and virials `(n,)` [m] of pairs over s."""
    offsets, indices = lists
    for i in prange(points.shape[0]):
        fx = fy = fz = total = 0.0
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            dx, dy, dz = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            distance = sqrt(dx * dx + dy * dy + dz * dz)
            push = _cosine(REACH**2 * distance**2 / reach**2) if distance < reach else 0.0
            over = push / (distance + NOTHING)
            fx, fy, fz, total = fx + over * dx, fy + over * dy, fz + over * dz, total + push * distance
        force[0, i], force[1, i], force[2, i], virial[i] = fx, fy, fz, total
