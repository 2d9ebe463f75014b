"""Faults of triangulations from elsewhere, each of which a reader must refuse: functions of points and triangles."""

import numpy as np

from reflowshock.meshing.trials.level_sets import sphere
from reflowshock.meshing.trials.models import MM

Triangulation = tuple[np.ndarray, np.ndarray]


def no_fault(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Leave it as it is."""
    return points, triangles


def hole(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """A triangle is missing."""
    return points, np.delete(triangles, 700, axis=0)


def flipped(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """A triangle faces inwards."""
    triangles = triangles.copy()
    triangles[700] = triangles[700, ::-1]
    return points, triangles


def inside_out(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """All triangles face inwards."""
    return points, triangles[:, ::-1]


def doubled(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """All triangles are there twice."""
    return points, np.vstack([triangles, triangles])


def two_shells(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """A second surface inside the first faces outwards."""
    return np.vstack([points, 0.99 * points]), np.vstack([triangles, triangles + len(points)])


def crossing(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """A dent on one side reaches through the other."""
    points = points.copy()
    near = np.exp(-(((points - [0.28 * MM, 0.0, 0.5 * np.ptp(points[:, 2])]) / (0.06 * MM)) ** 2).sum(axis=1))
    points[:, 0] -= 0.7 * MM * near
    return points, triangles


def void_outside(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """A void lies beside the body."""
    more, shell = sphere((1.0 * MM, 0.0, 0.1 * MM), 0.05 * MM)
    return np.vstack([points, more]), np.vstack([triangles, shell[:, ::-1] + len(points)])


def round_top(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """The upper end is not flat."""
    points = points.copy()
    height = np.ptp(points[:, 2])
    points[:, 2] -= 0.2 * (points[:, 0] ** 2 + points[:, 1] ** 2) / (0.3 * MM) * (points[:, 2] / height)
    return points, triangles


def far_too_high(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """The body does not fit its gap."""
    return points * [1.0, 1.0, 1.3], triangles


FAULTS = {
    fault.__name__: fault
    for fault in (
        no_fault,
        hole,
        flipped,
        inside_out,
        doubled,
        two_shells,
        crossing,
        void_outside,
        round_top,
        far_too_high,
    )
}
