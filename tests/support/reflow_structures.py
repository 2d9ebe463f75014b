"""Board and package as formulas, and joints computed in this process, for tests of the coupled reflow."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from reflowshock.workflow.reflow.array import JointArray


class HerePool:
    """Pool that computes in this process, counts its jobs, and may fail on request."""

    def __init__(self, fail=None):
        self.asked, self.fail = [], fail

    def run(self, work, jobs, progress):
        results = {}
        for name, job in jobs.items():
            self.asked.append((name, job.now.number))
            if self.fail == len(self.asked):
                raise KeyboardInterrupt
            results[name] = work(job, lambda share: None)
        return results


def joints_here(solder, folder, fail=None):
    """Return an array of joints that is reflowed in this process.

    Args:
        solder: Solder of each joint.
        folder: Folder of the checkpoints.
        fail: Name of the joint that fails; None for none.
    """
    return JointArray(solder, folder, HerePool(fail), lambda shares: None)


@dataclass(frozen=True, slots=True)
class Modes:
    names: tuple
    pad_motion: np.ndarray
    weight: np.ndarray

    def imbalance(self, wrenches):
        return self.weight + np.tensordot(self.pad_motion, wrenches, 3)


NAMES = ("x", "y", "z", "turn_x", "turn_y", "turn_z")


def rigid_modes(centres, names, weight, at=(0.0, 0.0)):
    """Return rigid-body modes of a package: the motions of its pads and the work of its weight.

    Args:
        centres: Centres of the pads, shape (joints, 3) [m].
        names: Names of the modes, among ``NAMES``: translations, then rotations about the origin.
        weight: Weight of the package [N].
        at: Coordinates x and y at which the weight acts [m].
    """
    motions, weights, load = [], [], np.array([0.0, 0.0, -weight])
    for name in names:
        number = NAMES.index(name)
        axis = np.eye(3)[number % 3]
        field = np.zeros((len(centres), 2, 6))
        if number < 3:
            field[:, 1, :3] = axis
            weights.append(load @ axis)
        else:
            field[:, 1, :3], field[:, 1, 3:] = np.cross(axis, centres), axis
            weights.append(np.cross([*at, 0.0], load) @ axis)
        motions.append(field)
    return Modes(tuple(names), np.array(motions).reshape(len(names), len(centres), 2, 6), np.array(weights))


class Bow:
    """Package that bows with temperature, w = bow (T - 300 K) (x^2 + y^2), with compliant pads.

    Each pad lies on its own spring: ``compliance`` [m/N] and [rad/(N m)] / radius^2.
    """

    def __init__(self, centres, modes, bow=0.0, compliance=0.0):
        self.centres, self.rigid_modes, self.bow, self.compliance = centres, modes, bow, compliance
        self.solved = 0

    def solve(self, temperature, corner, wrenches, rigid):
        self.solved += 1
        motion = np.zeros((len(self.centres), 2, 6))
        x, y = self.centres[:, :2].T
        curved = self.bow * (temperature - 300.0)
        motion[:, 1, 2] = curved * (x**2 + y**2) + corner
        motion[:, 1, 3], motion[:, 1, 4] = 2.0 * curved * y, -2.0 * curved * x
        motion += self.compliance * wrenches * np.repeat((1.0, 1e7), 3)
        motion += np.tensordot(rigid, self.rigid_modes.pad_motion, 1)
        return SimpleNamespace(displacement=np.zeros((0, 3)), pad_motion=motion)
