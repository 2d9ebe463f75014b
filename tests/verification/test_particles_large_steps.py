"""Steps of 100 capillary limits in a thermal reflow do not change the overflowing joint at rest."""

import numpy as np
import pytest

from reflowshock.meshing.surface.closed_surface import close_rings, measure
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.carried_joint import carried_shape, carry_joint
from reflowshock.workflow.package.case import LARGE_STEPS

PAD = 0.24e-3
PLACES = [
    JointGeometry(3.3e-4, PAD, PAD, (1e-7, 1e-7), (0.004, -0.0007)),
    JointGeometry(2.558e-4, PAD, PAD, (1.2e-7, 3.8e-7), (0.01325, -0.001976)),
]


def carried(limit, folder):
    """Return the joint in its last position, its wrenches on the pads, the number of steps and the solder."""
    solder = Solder(volume=7.24e-11, numerics=SolderNumerics(spacing=8e-5, time_step_limit=limit))
    files = [Checkpoint(folder / f"{limit:g}-{number}", (number, solder)) for number in range(len(PLACES))]
    joints = [
        carry_joint(joint_place, solder, before, now)
        for joint_place, before, now in zip(PLACES, [None, *files], files, strict=False)
    ]
    shape = carried_shape(PLACES[-1], solder, files[0], files[-1])
    return shape, joints[-1].wrenches, sum(joint.steps for joint in joints), solder


def test_an_overflowing_joint_comes_to_rest_in_the_same_shape_in_fewer_steps(tmp_path):
    (small, light, many, solder), (large, heavy, few, _) = (carried(limit, tmp_path) for limit in (20.0, LARGE_STEPS))
    assert (small.verdict, large.verdict) == ("overflow", "overflow")
    assert few < many
    expected, metrics = (measure(close_rings(s.surface_points, s.triangles, s.rings)) for s in (small, large))
    assert metrics == pytest.approx(expected, rel=1e-4)
    pull = np.pi * PAD * solder.surface_tension
    assert np.abs(heavy - light)[:, :3].max() < 2e-4 * pull  # a fifth of the coupling tolerance
    assert np.abs(heavy - light)[:, 3:].max() < 2e-4 * pull * PAD
