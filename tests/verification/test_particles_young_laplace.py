"""The Young-Laplace reference against shapes known in closed form or from tables."""

import numpy as np
import pytest

from reflowshock.particles.reference.young_laplace import (
    NoMeridian,
    cap_angle,
    joint_meridian,
    sessile_meridian,
    sessile_section,
)

GAMMA, RADIUS = 0.4985, 0.24e-3


@pytest.mark.parametrize("gap", [0.2e-3, 0.31e-3, 0.45e-3])
def test_truncated_sphere_has_no_axial_force(gap):
    """V = pi H (6 a^2 + H^2) / 6, R^2 = a^2 + H^2 / 4."""
    volume = np.pi * gap * (6 * RADIUS**2 + gap**2) / 6
    sphere = np.sqrt(RADIUS**2 + gap**2 / 4)
    joint = joint_meridian(volume, RADIUS, RADIUS, gap, GAMMA)
    assert joint.max_width == pytest.approx(2 * sphere, rel=1e-6)
    assert joint.pressure == pytest.approx(2 * GAMMA / sphere, rel=1e-6)
    assert abs(joint.axial_force) < 1e-7 * GAMMA * RADIUS
    assert joint.angle_board == pytest.approx(np.pi - np.arcsin(RADIUS / sphere), rel=1e-6)


def test_cylinder():
    gap = 0.4e-3
    joint = joint_meridian(np.pi * RADIUS**2 * gap, RADIUS, RADIUS, gap, GAMMA)
    assert joint.waist == pytest.approx(2 * RADIUS, rel=1e-8)
    assert joint.pressure == pytest.approx(GAMMA / RADIUS, rel=1e-6)
    assert joint.axial_force == pytest.approx(-np.pi * RADIUS * GAMMA, rel=1e-6)


def test_catenoid_has_no_pressure():
    """r = c cosh(z / c): zero mean curvature, axial force -2 pi gamma c."""
    neck, half = 0.2e-3, 0.1e-3
    rim = neck * np.cosh(half / neck)
    volume = np.pi * neck**2 * (half + 0.5 * neck * np.sinh(2 * half / neck))
    joint = joint_meridian(volume, rim, rim, 2 * half, GAMMA)
    assert joint.waist == pytest.approx(2 * neck, rel=1e-5)
    assert abs(joint.pressure) < 1e-5 * GAMMA / neck
    assert joint.axial_force == pytest.approx(-2 * np.pi * GAMMA * neck, rel=1e-6)


@pytest.mark.parametrize("volume", [0.05e-9, 0.0724e-9])
def test_axial_force_is_the_slope_of_the_energy(volume):
    """F = -dE/dH at constant volume, E = gamma times the area of revolution."""

    def energy(gap):
        joint = joint_meridian(volume, RADIUS, RADIUS, gap, GAMMA)
        length = np.hypot(np.diff(joint.r), np.diff(joint.z))
        return GAMMA * np.pi * float(((joint.r[1:] + joint.r[:-1]) * length).sum())

    gap, step = 0.31e-3, 2e-6
    slope = (energy(gap + step) - energy(gap - step)) / (2 * step)
    force = joint_meridian(volume, RADIUS, RADIUS, gap, GAMMA).axial_force
    assert force == pytest.approx(-slope, abs=2e-3 * GAMMA * RADIUS)


def test_weight_of_the_liquid_is_the_difference_of_the_end_forces():
    volume, gap, weight = 0.0724e-9, 0.31e-3, 8930 * 9.81
    joint = joint_meridian(volume, RADIUS, RADIUS, gap, GAMMA, weight)
    below = np.pi * RADIUS**2 * joint.pressure - 2 * np.pi * RADIUS * GAMMA * np.sin(joint.angle_board)
    assert below - joint.axial_force == pytest.approx(weight * volume, rel=1e-6)


def test_an_end_past_the_angle_of_the_mask_leaves_the_edge():
    limits = np.radians([5.0, 148.0])
    joint = joint_meridian(0.0724e-9, RADIUS, RADIUS, 0.22e-3, GAMMA, angle_limits=tuple(limits))
    assert joint.angle_board == pytest.approx(limits[1])
    assert joint.r[0] > 1.1 * RADIUS


def test_impossible_joint_is_an_error():
    with pytest.raises(NoMeridian, match="no equilibrium joint"):
        joint_meridian(0.01e-9, RADIUS, RADIUS, 0.5e-3, GAMMA)


@pytest.mark.parametrize("degrees", [30, 60, 90, 120, 148])
def test_drop_without_weight_is_a_spherical_cap(degrees):
    """V = pi R^3 / 3 (1 - c)^2 (2 + c), h = R (1 - c)."""
    c = np.cos(np.radians(degrees))
    radius = (3 / np.pi / ((1 - c) ** 2 * (2 + c))) ** (1 / 3)
    drop = sessile_meridian(1.0, np.radians(degrees), 1.0)
    assert drop.height == pytest.approx(radius * (1 - c), rel=1e-6)
    assert drop.r[0] == pytest.approx(radius * np.sqrt(1 - c * c), rel=1e-6)
    assert drop.pressure == pytest.approx(2 / radius, rel=1e-6)
    assert cap_angle(1.0, float(drop.r[0])) == pytest.approx(np.radians(degrees), rel=1e-6)


@pytest.mark.parametrize(
    ("degrees", "bond", "height", "base", "width"),
    [
        (60, 0.1757, 0.56816, 2.00514, 2.00514),
        (60, 1.0, 0.53497, 2.05048, 2.05048),
        (60, 5.0, 0.41956, 2.23102, 2.23102),
        (120, 0.1757, 0.96300, 1.16422, 1.32904),
        (120, 1.0, 0.88340, 1.26334, 1.39380),
        (148, 0.1757, 1.11345, 0.72924, 1.26252),
    ],
)
def test_drop_with_weight(degrees, bond, height, base, width):
    """Bashforth-Adams, lengths over V^(1/3), reference values to five digits."""
    drop = sessile_meridian(1.0, np.radians(degrees), 1.0, bond)
    assert (drop.height, 2 * drop.r[0], drop.max_width) == pytest.approx((height, base, width), abs=2e-5)


@pytest.mark.parametrize("degrees", [30, 60, 90, 120, 148])
def test_a_section_without_weight_is_a_segment_of_a_circle(degrees):
    """A = R^2 (theta - sin theta cos theta), h = R (1 - cos theta)."""
    angle = np.radians(degrees)
    radius = np.sqrt(2.0 / (angle - np.sin(angle) * np.cos(angle)))
    drop = sessile_section(2.0, angle, 3.0)
    assert drop.height == pytest.approx(radius * (1.0 - np.cos(angle)), rel=1e-6)
    assert drop.max_width == pytest.approx(2.0 * radius * np.sin(min(angle, 0.5 * np.pi)), rel=2e-6)
    assert drop.pressure == pytest.approx(3.0 / radius, rel=1e-6)


@pytest.mark.parametrize(("degrees", "bond"), [(60, 1.0), (60, 5.0), (120, 1.0), (148, 5.0)])
def test_section_with_weight_is_in_equilibrium(degrees, bond):
    """Forces along both axes vanish, for one half cut at the middle and for the whole section on the wall."""
    angle = np.radians(degrees)
    drop = sessile_section(1.0, angle, 1.0, bond)
    across = drop.pressure * drop.height - 0.5 * bond * drop.height**2
    assert across == pytest.approx(1.0 - np.cos(angle), rel=1e-6)
    assert 2.0 * drop.r[0] * drop.pressure == pytest.approx(bond + 2.0 * np.sin(angle), rel=1e-6)
