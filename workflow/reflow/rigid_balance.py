"""Quasi-Newton method for the rigid motions of a floating package at which weight and solder forces balance.

The stiffness starts from an estimate for the joints and is updated after each exchange (Broyden 1965). Rotations are
scaled to lengths by the mean displacement of the pads, and moments to forces.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SMALLEST_MOTION = 1e-8  # [m] after smaller motions, forces differ by rounding more than by stiffness
SOFTEST = 1e-6  # share of the largest stiffness; softer motions, such as the spin of a single joint, are not corrected


@dataclass(slots=True)
class RigidBalance:
    """State of the quasi-Newton iteration.

    Attributes:
        levers: Scale of each motion, shape (k,): 1 for translations, mean displacement of the pads per radian for
            rotations [m].
        largest: Largest motion in one exchange [m].
        stiffness: Derivative of the scaled imbalance by the scaled motion, shape (k, k) [N/m].
        last: Scaled motion [m] and scaled imbalance [N] of the previous exchange, both of shape (k,); None before the
            first exchange of a load step.
    """

    levers: Floats
    largest: float
    stiffness: Floats
    last: tuple[Floats, Floats] | None = None

    @classmethod
    def start(cls, names: tuple[str, ...], pad_motion: Floats, joints: Floats, largest: float) -> "RigidBalance":
        """Return the initial state, with the estimated stiffness of the joints.

        Args:
            names: Names of the motions; rotations begin with "turn".
            pad_motion: Motion of the pads per unit of each rigid motion, shape (k, joints, 2, 6).
            joints: Derivative of the wrench on the package's pad by its motion, shape (joints, 6, 6).
            largest: Longest motion in one exchange [m].
        """
        package = pad_motion[:, :, 1]
        arms = np.sqrt((package[..., :3] ** 2).sum(axis=-1).mean(axis=1))  # [m/rad] for rotations
        levers = np.array([arm if name.startswith("turn") else 1.0 for name, arm in zip(names, arms, strict=True)])
        stiffness = np.einsum("kja,jab,mjb->km", package, joints, package) / np.outer(levers, levers)
        return cls(levers, largest, stiffness)

    def next(self, rigid: Floats, imbalance: Floats) -> Floats:
        """Return the next rigid motions, shape (k,) [m, rad], and update the stiffness.

        Args:
            rigid: Rigid motions of the last exchange, shape (k,) [m, rad].
            imbalance: Imbalance at these motions, shape (k,) [N, N m].
        """
        motion, force = rigid * self.levers, imbalance / self.levers
        if self.last is not None:
            moved, change = motion - self.last[0], force - self.last[1]
            if np.linalg.norm(moved) > SMALLEST_MOTION:
                self.stiffness += np.outer(change - self.stiffness @ moved, moved) / (moved @ moved)
        self.last = (motion, force)
        step = -np.linalg.lstsq(self.stiffness, force, rcond=SOFTEST)[0]
        longest = float(np.abs(step).max(initial=0.0))
        return (motion + step * min(1.0, self.largest / max(longest, self.largest))) / self.levers

    def forget(self) -> None:
        """Discard the last exchange at the start of a load step, whose loads differ."""
        self.last = None
