"""Runs besides a single joint that are broken off continue to the same bits: a floating plate, a path, free drops."""

from functools import partial

import numpy as np
import pytest

from particles.checkpoint import Checkpoint
from particles.cloud_sphere import sphere_cloud
from particles.drops import run_drops
from particles.free_drop import solve_free_drop
from particles.geometry import JointGeometry
from particles.moving_joint import follow_path, settle_joint
from particles.parameters import Solder, SolderNumerics
from particles.plate_motion import LIFT, Floating
from particles.reflow import start_flow, stop_rule

RADIUS = 0.24e-3
JOINT = JointGeometry(0.31e-3, RADIUS, RADIUS)
SOLDER = Solder(volume=0.0724e-9, numerics=SolderNumerics(spacing=1e-4, time_step_limit=100))
FREE = {"surface_tension": True, "gravity": False, "wall_adhesion": False, "viscosity": False, "inertia": False}


class BrokenOff(Exception):
    pass


class BreakingCheckpoint(Checkpoint):
    """A checkpoint after every step; the run breaks off after some of them."""

    def __init__(self, path, steps):
        super().__init__(path, ("inputs",), 0.0)
        self.left = steps

    def write(self, state):
        super().write(state)
        self.left -= 1
        if self.left == 0:
            raise BrokenOff


def points_of(shapes):
    return [shape.points for shape in shapes]


def settle(checkpoint):
    plate = Floating(1, LIFT, np.array([0.0, 0.0, 1e-4]))
    return points_of([settle_joint(JOINT, SOLDER, (plate,), checkpoint=checkpoint)])


def follow(checkpoint):
    """Broken off on the way to the second of three places."""
    path = [JointGeometry(gap, RADIUS, RADIUS) for gap in (0.29e-3, 0.27e-3)]

    def at(number):
        path = checkpoint.path.with_name(f"{number}")
        return BreakingCheckpoint(path, checkpoint.left if number == 1 else -1)

    return points_of(follow_path(JOINT, SOLDER, path, at if checkpoint else None))


def swing(checkpoint):
    drop = solve_free_drop(SOLDER, amplitude=0.1, periods=0.1, steps_per_period=100, checkpoint=checkpoint)
    return [drop.points, *drop.history.values(), *(snapshot.points for snapshot in drop.snapshots)]


def merge(checkpoint):
    flows = [start_flow(sphere_cloud(1e-10, 3), SOLDER, FREE, ()) for _ in range(2)]
    spacing = flows[0].body.cloud.spacing
    flows[1].body.points[:, 0] += 2.0 * np.cbrt(3e-10 / (4.0 * np.pi)) + 0.5 * spacing
    start = partial(start_flow, solder=SOLDER, effects=FREE, lines=())
    rule = stop_rule(flows[0].body.cloud, SOLDER, FREE)
    drops = run_drops(flows, rule, lambda body: start(body.cloud), checkpoint)
    return [drop.flow.body.points for drop in drops]


@pytest.mark.parametrize("run", [settle, follow, swing, merge])
def test_a_broken_off_run_continues_to_the_same_bits(tmp_path, run):
    path = tmp_path / "state"
    with pytest.raises(BrokenOff):
        run(BreakingCheckpoint(path, 5))
    expected, found = run(None), run(BreakingCheckpoint(path, -1))
    assert len(found) == len(expected)
    assert all(np.array_equal(one, other) for one, other in zip(found, expected, strict=True))
