"""Failure criteria of joints: objects in a list, each judging the histories of a shock.

The measures are peel stress and plastic work density, with limits of the user's (``[shock.failure]``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.problem.shock import Failure

Verdicts = Mapping[str, Mapping[str, dict[str, Any]]]  # criterion -> joint -> value, limit, ok


@dataclass(frozen=True, slots=True)
class Criterion:
    """A limit of what the solder at a pad may bear, at any time and at either end of a joint.

    Attributes:
        name: As in the case file.
        limit: Largest value allowed.
        histories: Names of the histories ``(times, joints)`` at the board's and the package's pads.
    """

    name: str
    limit: float
    histories: tuple[str, str]

    def values(self, arrays: Mapping[str, NDArray]) -> NDArray[np.float64]:
        """Return the largest value of each joint ``(joints,)``."""
        return np.maximum(*(arrays[name].max(axis=0) for name in self.histories))

    def verdicts(self, arrays: Mapping[str, NDArray]) -> dict[str, dict[str, Any]]:
        """Return joint -> value, limit, ok."""
        return {
            str(joint): {"value": float(value), "limit": self.limit, "ok": bool(value <= self.limit)}
            for joint, value in zip(arrays["joints"], self.values(arrays), strict=True)
        }


def failure_criteria(failure: Failure) -> list[Criterion]:
    """Return the criteria that have a limit.

    Peel stress is the normal stress averaged over a pad, plastic work density that of the layer of elements at the pad,
    averaged over its volume, so that neither follows a singular corner (Darveaux, ECTC 2000, for the latter).
    """
    ends = ("board", "package")
    known = {
        "peel_stress": (failure.peel_stress, "peel"),
        "plastic_work_density": (failure.plastic_work_density, "plastic_work"),
    }
    return [
        Criterion(name, limit, (f"{history}_{ends[0]}", f"{history}_{ends[1]}"))
        for name, (limit, history) in known.items()
        if limit is not None
    ]


def judge(criteria: Sequence[Criterion], arrays: Mapping[str, NDArray]) -> Verdicts:
    """Return criterion -> joint -> value, limit, ok; empty where there are no joints."""
    return {item.name: item.verdicts(arrays) for item in criteria if len(arrays["joints"])}


def worst(verdicts: Verdicts) -> dict[str, dict[str, Any]]:
    """Return the verdict on the worst joint of each criterion."""
    return {name: max(joints.values(), key=lambda verdict: verdict["value"]) for name, joints in verdicts.items()}


def failed_joints(verdicts: Verdicts) -> list[str]:
    """Return the joints that fail by one of the criteria."""
    joints = {joint: True for found in verdicts.values() for joint, verdict in found.items() if not verdict["ok"]}
    return list(joints)
