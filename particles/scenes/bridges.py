"""Joints of an array that touch: at rest by themselves they are wider than their distance, so they flow into one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree


@dataclass(frozen=True, slots=True)
class Contact:
    """Two joints that touch.

    Attributes:
        first, second: their names, in the order of the array; equal where a joint touches its own mirror image.
        distance: of their axes [m].
        overlap: mean of their widths, less the distance [m].
    """

    first: str
    second: str
    distance: float
    overlap: float


def contacts(places: Mapping[str, tuple[float, float]], widths: Mapping[str, float], mirrored: bool) -> list[Contact]:
    """Find the joints that touch each other, the largest overlap first.

    Args:
        places: name of a joint to x and y of its axis [m].
        widths: name of a joint to its largest width at rest, alone [m].
        mirrored: whether x = 0 and y = 0 are planes of symmetry, beyond which the images of the joints are.
    """
    names = list(places)
    points = np.array([places[name] for name in names])
    images = [points * sign for sign in ((1, 1), (-1, 1), (1, -1), (-1, -1))] if mirrored else [points]
    width = np.array([widths[name] for name in names])
    found: dict[tuple[int, int], Contact] = {}
    for image in images:
        for i, near in enumerate(cKDTree(image).query_ball_point(points, width.max())):
            for j in near:
                distance = float(np.linalg.norm(points[i] - image[j]))
                overlap = float(0.5 * (width[i] + width[j])) - distance
                known = found.get((i, j))
                if i <= j and distance > 0.0 and overlap >= 0.0 and (known is None or known.overlap < overlap):
                    found[i, j] = Contact(names[i], names[j], distance, overlap)
    return sorted(found.values(), key=lambda contact: -contact.overlap)


def neighbours(found: Sequence[Contact]) -> dict[str, list[str]]:
    """Name of each joint that touches another, to the names of those that it touches, in order."""
    result: dict[str, set[str]] = {}
    for contact in found:
        result.setdefault(contact.first, set()).add(contact.second)
        result.setdefault(contact.second, set()).add(contact.first)
    return {name: sorted(others) for name, others in sorted(result.items())}
