"""Young-Laplace references of joints and drops, and the bound of the width of a joint that has none."""

import numpy as np

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.young_laplace import Meridian, NoMeridian, joint_meridian, pad_meridian

WIDTH_CHANGE, TILT_LEVER = 0.1, 2.0


def reference_meridian(geometry: JointGeometry, solder: Solder, weight: float | None) -> Meridian | None:
    """Return the Young-Laplace meridian of a coaxial joint with Gibbs' condition at the pad edges.

    Args:
        geometry: Gap and pad radii.
        solder: Volume, surface tension and contact angles.
        weight: Specific weight [N/m^3]; None if the shape is not axisymmetric.

    Returns:
        Meridian; None without a weight, if the joint is not coaxial, or if it has no equilibrium.
    """
    if weight is None or not geometry.is_coaxial:
        return None
    try:
        return joint_meridian(
            solder.volume,
            geometry.radius_board,
            geometry.radius_package,
            geometry.gap,
            solder.surface_tension,
            weight,
            angle_limits=(solder.pad_contact_angle, solder.mask_contact_angle),
        )
    except NoMeridian:
        return None


def reference_drop(solder: Solder, pad_radius: float, weight: float | None) -> Meridian | None:
    """Return the Young-Laplace meridian of a drop on a pad in the mask, with Gibbs' condition at the pad's edge.

    Args:
        solder: Volume, surface tension and contact angles.
        pad_radius: Radius of the pad [m], infinite for a uniform wall.
        weight: Specific weight [N/m^3]; None if the shape is not axisymmetric.

    Returns:
        Meridian; None without a weight.
    """
    if weight is None:
        return None
    limits = (solder.pad_contact_angle, solder.mask_contact_angle)
    return pad_meridian(solder.volume, pad_radius, solder.surface_tension, weight, angle_limits=limits)


def width_change_bound(geometry: JointGeometry) -> float:
    """Return a bound on the relative change of a joint's width by offset and tilt of the package, at equal gap.

    By symmetry the change is of second order. The factors bound barrels and hourglasses of equal discs, 1.2 to 2.1
    radii apart, to 0.3 radii and 5 deg; widths of Surface Evolver keep to them (test_particles_leaning_joints.py).

    Args:
        geometry: Radii, offset and tilt of the joint; the gap is ignored.
    """
    radius = min(geometry.radius_board, geometry.radius_package)
    lean = float(np.hypot(*geometry.offset)) / radius + TILT_LEVER * float(np.hypot(*geometry.tilt))
    return WIDTH_CHANGE * lean**2
