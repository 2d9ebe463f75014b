"""Surface tension by pairwise forces: f(r) = s cos(3 pi r / (2 L)) up to L (Tartakovsky & Meakin 2005).

Particles repel each other within L / 3 and attract each other beyond; L^3 contains 27 particles. A continuum with
number density n has the tension gamma = -(pi / 8) n^2 times the integral of r^4 f, and a pressure of (2 pi / 3) n^2
times the integral of r^3 f (Tartakovsky & Panchenko 2016, after Kirkwood & Buff 1949). The first gives the strength s.
The second, which is negative, is subtracted from the reference density of the equation of state, so that the liquid
rests at its density.

This pressure p is balanced by the SPH pressure, whose pairwise forces have by the same integral a tension of their own,
-p <r> / 4 with the mean distance <r> of the kernel, in the limit of many neighbours. A factor of s is therefore
calibrated. A wall is a half space of the same number density. Its images give the liquid its whole pressure, so that
works of adhesion and cohesion (Young & Dupre) require the strength (1 + cos theta / factor) / 2 of the liquid's own.
The wall force depends on height alone and is integrated once.
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
# L over the spacing: L^3 contains 27 particles.
PAIRED = 3.0
# Added to distances [m], far below rounding, so that a particle exerts no force on itself.
NOTHING = 1e-200


def strength(law: Law, tension: float) -> float:
    """Return the strength s of the pairwise forces for which a continuum of particles has a surface tension [N].

    Args:
        law: Parameters of the pair interactions, of which the spacing is used.
        tension: Surface tension [N/m].
    """
    per_volume, length = law.spacing**-3, PAIRED * law.spacing / REACH
    return tension / (-(pi / 8.0) * per_volume**2 * length**5 * FOURTH)


def cohesion(law: Law, tension: float) -> float:
    """Return the (negative) pressure of the pairwise forces inside the liquid [Pa].

    Args:
        law: Parameters of the pair interactions, of which the spacing is used.
        tension: Surface tension of these forces [N/m].
    """
    per_volume, length = law.spacing**-3, PAIRED * law.spacing / REACH
    return (2.0 * pi / 3.0) * per_volume**2 * strength(law, tension) * length**4 * THIRD


@dataclass(slots=True)
class Pairwise(Untracked):
    """Surface tension by pairwise forces; ``factor``: strength over its theoretical value."""

    factor: float = 1.0
    _by_height: Floats = field(init=False)

    def __post_init__(self) -> None:
        Untracked.__post_init__(self)
        self.lists = Lists(PAIRED * self.law.spacing, self.law.spacing)
        self._by_height = _wall_force(self.lists.reach, self.law.spacing)

    def accelerations(self, points: Floats, fields: Fields) -> Floats:
        """Return the accelerations, as ``Untracked.accelerations``."""
        lists, force = self.lists.update(points, points), np.zeros((3, len(points)))
        size = self.factor * strength(self.law, self.tension)
        _pair_forces(lists, points, self.lists.reach, force, np.empty(len(points)))
        if self.law.mirror:
            heights = np.linspace(0.0, self.lists.reach, HEIGHTS)
            force[2] += 0.5 * (1.0 + self.cosine / self.factor) * np.interp(points[:, 2], heights, self._by_height)
        return size * force / fields.mass[: len(points)]

    def bulk_pressure(self, points: Floats, fields: Fields) -> Floats:
        """Return the pressure [Pa] of ``Untracked.bulk_pressure``: a sixth of the pair virials times number density.

        It balances a pressure of the equation of state that is many times the pressure of the drop, so that the error
        of the pairwise sums matters: the virial of the equation of state replaces its pressure.
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
    """Return the force of a half space of particles over s at heights up to the reach [m], shape (400,)."""
    height = np.linspace(0.0, reach, HEIGHTS)
    scale = REACH / reach
    inner = (np.sin(REACH) - np.sin(scale * height)) / scale  # integral of f / s from a height to the reach
    moment = height * inner
    steps = 0.5 * (moment[1:] + moment[:-1]) * np.diff(height)
    return 2.0 * pi / spacing**3 * np.append(np.cumsum(steps[::-1])[::-1], 0.0)


@looped
def _virials_of_pressure(lists, fields, law, virials):
    """Compute a sixth of the virials of the pressure forces times the number density [Pa], shape (n,)."""
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
    """Return the cosine of the root of a square up to (3 pi / 2)^2, to 1e-6, by a series that vectorises over pairs."""
    total = 1.0
    for k in range(11, 0, -1):
        total = 1.0 - square * total / ((2 * k) * (2 * k - 1))
    return total


@looped
def _pair_forces(lists, points, reach, force, virial):
    """Compute forces, shape (3, n), and virials [m], shape (n,), of pairs over s."""
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
