"""Joints in canonical orientation: rotation and reflection of positions, wrenches and shapes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import joint_plates
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.orientation import Orientation, canonical, orient, sizes
from reflowshock.particles.scenes.reflow import solve_joint

RADIUS = 0.24e-3
SOLDER = Solder(volume=0.0724e-9, numerics=SolderNumerics(spacing=8e-5, time_step_limit=100))
small = st.floats(-1.0, 1.0).map(lambda value: 0.0 if abs(value) < 1e-4 else value)


def joint(offset, tilt):
    """Return the geometry of a joint, from offset and tilt in small units."""
    return JointGeometry(
        0.33e-3, RADIUS, RADIUS, tuple(5e-5 * value for value in offset), tuple(0.05 * t for t in tilt)
    )


@given(st.tuples(small, small), st.tuples(small, small))
def test_the_orientation_brings_the_canonical_plate_to_where_it_is(offset, tilt):
    geometry = joint(offset, tilt)
    upright, orientation = canonical(geometry)
    inclined, upright_plate = joint_plates(geometry)[1], joint_plates(upright)[1]
    assert orientation.vectors(upright_plate.origin[None])[0] == pytest.approx(inclined.origin, abs=1e-15)
    assert orientation.vectors(upright_plate.normal[None])[0] == pytest.approx(inclined.normal, abs=1e-12)
    assert upright.tilt[0] == 0.0 and upright.tilt[1] <= 0.0 <= upright.offset[1]


@pytest.mark.parametrize("image", [np.diag([1.0, -1.0]), np.diag([-1.0, 1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])])
def test_mirror_images_and_turns_have_one_canonical_joint(image):
    offset, uphill = np.array([2e-5, -3e-5]), np.array([0.02, 0.05])
    plain = sizes(canonical(joint((0.4, -0.6), (0.05 / 0.05, -0.02 / 0.05)))[0])
    offset, uphill = image @ offset, image @ uphill
    twin = JointGeometry(0.33e-3, RADIUS, RADIUS, tuple(offset), (uphill[1], -uphill[0]))
    assert sizes(canonical(twin)[0]) == pytest.approx(plain, abs=1e-15)


def test_lengths_below_a_picometre_have_no_direction():
    upright, orientation = canonical(JointGeometry(0.33e-3, RADIUS, RADIUS, (1e-13, -1e-13), (1e-10, 1e-10)))
    assert upright.is_coaxial and orientation == Orientation()


def test_wrenches_keep_their_power():
    """Forces and velocities are vectors; moments and spins are axial vectors."""
    rng = np.random.default_rng(1)
    for orientation in (Orientation(0.7, False), Orientation(-2.1, True)):
        points, force = rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
        wrench = np.concatenate((force.sum(axis=0), np.cross(points, force).sum(axis=0)))
        points, force = orientation.vectors(points), orientation.vectors(force)
        turned = np.concatenate((force.sum(axis=0), np.cross(points, force).sum(axis=0)))
        assert orientation.wrenches(wrench[None])[0] == pytest.approx(turned, abs=1e-14)


def test_the_shape_of_a_mirror_image_is_that_of_its_own_reflow():
    """Rings stay counter-clockwise, triangles point outwards and discs stay on their pads."""
    geometry = JointGeometry(0.33e-3, RADIUS, RADIUS, (2e-5, 3e-5), (0.03, 0.05))
    upright, orientation = canonical(geometry)
    assert orientation.mirror
    direct, image = solve_joint(geometry, SOLDER), orient(solve_joint(upright, SOLDER), orientation)
    plate = joint_plates(geometry)[1]
    ring = plate.local(image.surface_points[image.ring_package])
    assert abs(ring[:, 2]).max() < 1e-12
    x, y = ring[:, :2].T
    assert 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() == pytest.approx(np.pi * RADIUS**2, rel=1e-6)

    def moment(shape):
        corners = shape.surface_points[shape.triangles]
        area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return area.T @ corners.mean(axis=1)

    assert moment(image) == pytest.approx(moment(direct), abs=2e-3 * abs(moment(direct)).max())
