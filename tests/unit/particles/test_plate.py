import numpy as np
import pytest

from reflowshock.particles.core.cloud import joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import Plate, joint_plates, placed_geometry, slide

SEED = 11


def random_plate():
    """Return a plate that is offset and tilted."""
    return Plate.horizontal(0.4, (0.2, -0.1)).moved(np.array([0.3, 0.1, -0.2, 0.4, -0.7, 0.2]))


def test_local_coordinates_are_inverted_by_placing():
    points = np.random.default_rng(SEED).normal(size=(5, 3))
    plate = random_plate()
    assert plate.frame @ plate.frame.T == pytest.approx(np.eye(3))
    assert plate.place(plate.local(points)) == pytest.approx(points)


def test_motion_to_a_plate_leads_there():
    start, target = Plate.horizontal(0.1), random_plate()
    moved = start.moved(start.motion_to(target))
    assert moved.origin == pytest.approx(target.origin)
    assert moved.frame == pytest.approx(target.frame)


def test_rigid_velocity_is_the_rate_of_a_small_motion():
    plate, twist, step = random_plate(), np.random.default_rng(SEED).normal(size=6), 1e-6
    local = np.random.default_rng(SEED + 1).normal(size=(4, 3))
    rate = (plate.moved(step * twist).place(local) - plate.place(local)) / step
    assert plate.rigid_velocity(twist, plate.place(local)) == pytest.approx(rate, abs=1e-5)


def test_sliding_leaves_what_is_along_the_plate():
    plate, field = random_plate(), np.random.default_rng(SEED).normal(size=(3, 3))
    slid = slide((Plate.horizontal(0.0), plate), np.array([1, -1, 0], np.int8), field)
    assert slid[0] @ plate.normal == pytest.approx(0.0, abs=1e-15)
    assert np.cross(slid[0] - field[0], plate.normal) == pytest.approx(np.zeros(3), abs=1e-15)
    assert (slid[1] == field[1]).all()
    assert slid[2] == pytest.approx(field[2] * [1, 1, 0])


def test_a_cloud_leans_to_an_offset_and_tilted_plate_with_its_volume():
    upright = JointGeometry(0.31e-3, 0.24e-3, 0.20e-3)
    leaning = JointGeometry(0.31e-3, 0.24e-3, 0.20e-3, offset=(5e-5, -2e-5), tilt=(0.03, 0.05))
    assert upright.is_coaxial
    assert not leaning.is_coaxial
    straight, cloud = (joint_cloud(geometry, 0.06e-9, 5e-5) for geometry in (upright, leaning))
    plate = joint_plates(leaning)[1]
    local = plate.local(cloud.points[cloud.wall == 1])
    assert local[:, 2] == pytest.approx(0.0, abs=1e-18)
    assert local[:, :2] == pytest.approx(straight.points[straight.wall == 1, :2], abs=1e-18)
    assert (cloud.points[cloud.wall == 0, 2] == 0.0).all()


def test_the_geometry_of_plates_that_moved_is_seen_from_the_board():
    geometry = JointGeometry(0.3, 0.2, 0.1, offset=(0.1, 0.05), tilt=(0.03, -0.2))
    plates = joint_plates(geometry)
    turned = [plate.moved(np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0])) for plate in plates]
    placed = placed_geometry(JointGeometry(1.0, 0.2, 0.1), turned)
    for name in ("gap", "radius_board", "radius_package", "offset", "tilt"):
        assert getattr(placed, name) == pytest.approx(getattr(geometry, name))
