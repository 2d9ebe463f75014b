"""Surface tension as a pressure on the free surface: a_i = 2 p_i G_i / rho_i, p = gamma kappa, G the sum of V grad W.

G is the defect of the pairwise pressure sums at the surface: under a uniform p the liquid rests exactly, so that the
only error is in the curvature. The curvature is evaluated on the level c = 1/2 of a colour function with a wide, smooth
kernel (Wendland C4, support of four spacings) at the foot point of each particle, which one Newton step per time step
keeps on the level. It is then smoothed over the surface particles, which have |G| h above 0.03. The model has no
contact angle; at a mirror the angle would be 90 degrees.
"""

from dataclasses import dataclass, field
from math import pi, sqrt

import numpy as np
from numba import njit, prange

from benchmarks.tension.lists import Lists, Untracked, looped
from reflowshock.arrays import Floats
from reflowshock.particles.sph.fluid_state import Fields
from reflowshock.particles.sph.smoothing import shape, slope

# Support of the colour over the spacing; smoothing passes of the curvature; threshold of |G| h at the surface.
COLOUR_SUPPORT, PASSES, THRESHOLD = 4.0, 2, 0.03
# Longest Newton step over the spacing; number of steps at the start.
LONGEST, FIRST_STEPS = 0.5, 12
WENDLAND_C4 = 495.0 / (32.0 * pi)


@dataclass(slots=True)
class FreeSurfacePressure(Untracked):
    """Surface tension by a pressure on the free surface.

    Attributes:
        offsets: Vectors [m] from particles to their foot points on the level, shape (n, 3).
    """

    offsets: Floats = field(default_factory=lambda: np.empty((0, 3)))
    _around_feet: Lists = field(init=False)

    def __post_init__(self) -> None:
        Untracked.__post_init__(self)
        self._around_feet = Lists(COLOUR_SUPPORT * self.law.spacing, self.law.spacing)

    def accelerations(self, points: Floats, fields: Fields) -> Floats:
        """Return the accelerations, as ``Untracked.accelerations``."""
        count = len(points)
        lists, lack = self.lists.update(points, points), np.empty((3, count))
        _lacks(lists, fields, self.law, lack)
        at_surface = np.linalg.norm(lack, axis=0) * self.law.length > THRESHOLD
        steps = 1 if len(self.offsets) == count else FIRST_STEPS
        if steps > 1:
            self.offsets = np.zeros((count, 3))
        self.offsets[~at_surface] = 0.0
        curvature, smoothed = np.zeros(count), np.zeros(count)
        for _ in range(steps):
            feet = points + self.offsets
            rows = self._around_feet.update(feet, points)
            _curvatures(rows, feet, at_surface, fields, (self.law.spacing, curvature, self.offsets))
        for _ in range(PASSES):
            _smooth(lists, at_surface, fields, self.law, (curvature, smoothed))
            curvature, smoothed = smoothed, curvature
        return 2.0 * self.tension * np.where(at_surface, curvature, 0.0) * lack / fields.density[:count]


@looped
def _lacks(lists, fields, law, lack):
    """Compute G [1/m] of each particle, shape (3, n)."""
    offsets, indices = lists
    for i in prange(lack.shape[1]):
        gx = gy = gz = 0.0
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            dx, dy, dz = fields.x[i] - fields.x[j], fields.y[i] - fields.y[j], fields.z[i] - fields.z[j]
            q = sqrt(dx * dx + dy * dy + dz * dz) / law.length
            weight = law.norm / law.length**2 * slope(law.kernel, False, q) * fields.mass[j] / fields.density[j]
            gx, gy, gz = gx + weight * dx, gy + weight * dy, gz + weight * dz
        lack[0, i], lack[1, i], lack[2, i] = gx, gy, gz


@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def level_at(point, row, fields, support):
    """Return the smoothed colour function (1 inside the liquid, 0 outside) and its derivatives at a point.

    Args:
        point: Position (x, y, z) [m].
        row: Numbers of the particles near the point, shape (k,).
        fields: ``Fields``: arrays of position, mass and density of all particles.
        support: Radius of the kernel, scalar [m].

    Returns:
        Ten scalars: colour, gradient (x, y, z) [1/m], second derivatives xx, yy, zz, xy, yz, xz [1/m^2].
    """
    x, y, z = point
    level = gx = gy = gz = xx = yy = zz = xy = yz = xz = 0.0
    for j in row:
        dx, dy, dz = x - fields.x[j], y - fields.y[j], z - fields.z[j]
        q = sqrt(dx * dx + dy * dy + dz * dz) / support
        rest = max(1.0 - q, 0.0)
        fourth = WENDLAND_C4 * rest**4 * fields.mass[j] / fields.density[j] / support**3
        level += fourth * rest * rest * (1.0 + 6.0 * q + 35.0 / 3.0 * q * q)
        first = -56.0 / 3.0 * fourth * rest * (1.0 + 5.0 * q) / support**2
        second = 560.0 * fourth / support**4
        gx, gy, gz = gx + first * dx, gy + first * dy, gz + first * dz
        xx, yy, zz = xx + first + second * dx * dx, yy + first + second * dy * dy, zz + first + second * dz * dz
        xy, yz, xz = xy + second * dx * dy, yz + second * dy * dz, xz + second * dx * dz
    return level, gx, gy, gz, xx, yy, zz, xy, yz, xz


@looped
def _curvatures(lists, feet, at_surface, fields, result):
    """Compute the curvature [1/m] of the level at the foot points, and their offsets [m] after a Newton step."""
    spacing, curvature, offset = result
    offsets, indices = lists
    for i in prange(feet.shape[0]):
        if not at_surface[i]:
            continue
        row = indices[offsets[i] : offsets[i + 1]]
        foot = (feet[i, 0], feet[i, 1], feet[i, 2])
        level, gx, gy, gz, xx, yy, zz, xy, yz, xz = level_at(foot, row, fields, COLOUR_SUPPORT * spacing)
        square = gx * gx + gy * gy + gz * gz
        if square * spacing * spacing < 1e-8:  # an isolated particle has no surface
            curvature[i] = 0.0
            continue
        bend = (
            gx * (xx * gx + xy * gy + xz * gz) + gy * (xy * gx + yy * gy + yz * gz) + gz * (xz * gx + yz * gy + zz * gz)
        )
        size = sqrt(square)
        curvature[i] = -(xx + yy + zz - bend / square) / size
        step = min(max((0.5 - level) / size, -LONGEST * spacing), LONGEST * spacing) / size
        offset[i, 0], offset[i, 1], offset[i, 2] = (
            offset[i, 0] + step * gx,
            offset[i, 1] + step * gy,
            offset[i, 2] + step * gz,
        )


@looped
def _smooth(lists, at_surface, fields, law, values):
    """Average the first of two arrays over the surface particles with the kernel, into the second."""
    values_in, values_out = values
    offsets, indices = lists
    for i in prange(values_in.shape[0]):
        total = weights = 0.0
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            if not at_surface[i] or not at_surface[j]:
                continue
            dx, dy, dz = fields.x[i] - fields.x[j], fields.y[i] - fields.y[j], fields.z[i] - fields.z[j]
            level = shape(law.kernel, False, sqrt(dx * dx + dy * dy + dz * dz) / law.length)
            weight = level * fields.mass[j] / fields.density[j]
            total, weights = total + weight * values_in[j], weights + weight
        values_out[i] = total / weights if weights > 0.0 else 0.0
