"""Newton's method for the rigid motions of a package that floats: where weight and solder forces are in balance.

The derivative starts from an estimate of the joints' stiffness and learns from each exchange (Broyden 1965). All is
over lengths: turns count with the mean way of the pads, moments over it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEARNED = 1e-8  # motions below tell more of the joints' rounding than of their stiffness [m]
SOFTEST = 1e-6  # of the stiffest motion; softer ones, such as the turn of a single joint about its axis, are let be


@dataclass(slots=True)
class RigidBalance:
    """The search for the balance.

    Attributes:
        levers: `(k,)` 1 for shifts, for turns the mean way of the pads in a unit of it [m].
        largest: longest motion in one exchange [m].
        stiffness: `(k, k)` derivative of the imbalance, over lengths [N/m].
        last: motion [m] and imbalance [N] of the exchange before, over lengths; none before the first.
    """

    levers: Floats
    largest: float
    stiffness: Floats
    last: tuple[Floats, Floats] | None = None

    @classmethod
    def start(cls, names: tuple[str, ...], pad_motion: Floats, joints: Floats, largest: float) -> "RigidBalance":
        """Start from the joints' stiffness.

        Args:
            names: Names of the motions; rotations begin with "turn".
            pad_motion: Motion of the pads per unit of each rigid motion, shape (k, joints, 2, 6).
            joints: Derivative of the wrench on the package's pad by its motion, shape (joints, 6, 6).
            largest: Longest motion in one exchange [m].
        """
        package = pad_motion[:, :, 1]
        arms = np.sqrt((package[..., :3] ** 2).sum(axis=-1).mean(axis=1))  # of turns [m/rad]; of shifts 1
        levers = np.array([arm if name.startswith("turn") else 1.0 for name, arm in zip(names, arms, strict=True)])
        stiffness = np.einsum("kja,jab,mjb->km", package, joints, package) / np.outer(levers, levers)
        return cls(levers, largest, stiffness)

    def next(self, rigid: Floats, imbalance: Floats) -> Floats:
        """Return rigid motions `(k,)` [m, rad] nearer to the balance; learns from those tried last.

        Args:
            rigid: motions that were tried.
            imbalance: `(k,)` [N, N m] that they left.
        """
        place, force = rigid * self.levers, imbalance / self.levers
        if self.last is not None:
            moved, change = place - self.last[0], force - self.last[1]
            if np.linalg.norm(moved) > LEARNED:
                self.stiffness += np.outer(change - self.stiffness @ moved, moved) / (moved @ moved)
        self.last = (place, force)
        step = -np.linalg.lstsq(self.stiffness, force, rcond=SOFTEST)[0]
        longest = float(np.abs(step).max(initial=0.0))
        return (place + step * min(1.0, self.largest / max(longest, self.largest))) / self.levers

    def forget(self) -> None:
        """Another load step begins: what the last exchange left says nothing of this one."""
        self.last = None
