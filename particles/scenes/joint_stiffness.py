"""Stiffness of a joint at rest against motions of its package's pad: an estimate from Young-Laplace and a cylinder."""

from dataclasses import replace
from math import isfinite, pi

import numpy as np
from numpy.typing import NDArray

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.effects import acting_weight, decide_effects
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.metrics import reference_meridian

STEP = 0.01  # of the gap


def stiffness_estimate(geometry: JointGeometry, solder: Solder) -> NDArray[np.float64]:
    """Return the derivative `(6, 6)` of the solder's wrench on the package's pad by its motion, where it is level.

    Along z it is that of the Young-Laplace joint. Sideways a cylinder of the pad's radius a and the gap h, whose
    sections stay discs, resists with pi a gamma / h; a tilt as if each part of the pad bore what it does along z.
    """
    radius, gap = min(geometry.radius_board, geometry.radius_package), geometry.gap
    lateral = pi * radius * solder.surface_tension / gap
    upper, lower = (axial_force(geometry, solder, factor * gap) for factor in (1.0 + STEP, 1.0 - STEP))
    axial = (lower - upper) / (2.0 * STEP * gap)
    axial = axial if isfinite(axial) and axial > 0.0 else 4.0 * lateral  # what barrels of 1.2 to 1.7 radii have
    tilt = axial * radius**2 / 4.0
    return -np.diag([lateral, lateral, axial, tilt, tilt, 0.0])


def axial_force(geometry: JointGeometry, solder: Solder, gap: float) -> float:
    """Force on the package along z [N] of the coaxial Young-Laplace joint at a gap [m]; nan where there is none."""
    weight = acting_weight(solder, decide_effects(geometry, solder))
    meridian = reference_meridian(replace(geometry, gap=gap, offset=(0.0, 0.0), tilt=(0.0, 0.0)), solder, weight)
    return float("nan") if meridian is None else meridian.axial_force
