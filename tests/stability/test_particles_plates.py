"""Large plate motions: the joint follows with its volume and its Young-Laplace shape."""

import numpy as np
import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.reference.young_laplace import joint_meridian
from reflowshock.particles.scenes.moving_joint import follow_path
from reflowshock.particles.scenes.reflow import solve_joint

BALL, RADIUS, GAMMA, WEIGHT = 0.0724e-9, 0.24e-3, 0.4985, 8930.0 * 9.81
SOLDER = Solder(volume=BALL, numerics=SolderNumerics(spacing=7e-5, time_step_limit=100))
LIMITS = (SOLDER.pad_contact_angle, SOLDER.mask_contact_angle)


def follow(gaps):
    """Return the shapes of a joint at rest at each of some gaps [m]."""
    places = [JointGeometry(gap, RADIUS, RADIUS) for gap in gaps]
    return list(follow_path(places[0], SOLDER, places[1:]))


def check(shape, gap, tolerance):
    """Check standoff, volume, width and waist of a joint at rest against its exact shape."""
    exact = joint_meridian(BALL, RADIUS, RADIUS, gap, GAMMA, WEIGHT, angle_limits=LIMITS)
    assert shape.metrics["standoff"][0] == pytest.approx(gap)
    assert abs(shape.metrics["volume_drift"][0]) < 1e-6
    assert np.isfinite(shape.points).all()
    assert shape.metrics["max_width"][0] == pytest.approx(exact.max_width, rel=5e-3)
    assert shape.metrics["waist"][0] == pytest.approx(exact.waist, rel=tolerance)


def test_gap_squeezed_by_40_percent_in_10_steps():
    """The pinned barrel spreads over the edges of the pads onto the mask."""
    gaps = 0.31e-3 * np.linspace(1.0, 0.6, 11)
    shapes = follow(gaps)
    assert len(shapes) == len(gaps)
    for shape, gap in zip(shapes, gaps, strict=True):
        check(shape, gap, 0.03)
    assert shapes[0].verdict == "ok"
    assert shapes[-1].verdict == "overflow"


@pytest.mark.long
def test_gap_pulled_until_the_neck_ruptures():
    gaps = np.arange(0.35e-3, 1.1e-3, 0.075e-3)
    shapes = follow(gaps)
    waist = [shape.metrics["waist"][0] for shape in shapes]
    assert (np.diff(waist) < 0.0)[1:].all()
    for shape, gap in zip(shapes, gaps, strict=False):
        assert abs(shape.metrics["volume_drift"][0]) < 1e-6
        if shape.metrics["waist"][0] > 1.2 * RADIUS:
            check(shape, gap, 0.02)
    assert [shape.verdict for shape in shapes] == ["ok"] * (len(shapes) - 1) + ["open"]


@pytest.mark.parametrize(
    ("offset", "tilt"),
    [(0.3, 0.0), (0.0, 3.0), (0.3, 3.0), (0.6, -10.0)],
    ids=["offset 0.3 radius", "tilt 3 deg", "offset and tilt", "far off"],
)
def test_plates_out_of_line(offset, tilt):
    geometry = JointGeometry(0.31e-3, RADIUS, RADIUS, offset=(offset * RADIUS, 0.0), tilt=(0.0, np.radians(tilt)))
    shape = solve_joint(geometry, SOLDER)
    energy = shape.history["energy"]
    assert np.diff(energy).max() < 1e-4 * energy[0]
    assert abs(shape.metrics["volume_drift"][0]) < 1e-6
    assert np.isfinite(shape.points).all()
    assert shape.verdict in ("ok", "overflow")
