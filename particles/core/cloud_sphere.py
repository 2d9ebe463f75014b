"""Body-fitted cloud of a free drop: concentric geodesic spheres."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from reflowshock.arrays import Floats
from reflowshock.particles.core.cloud import Cloud
from reflowshock.particles.core.surface_measure import enclosed_volume


def sphere_cloud(volume: float, shells: int) -> Cloud:
    """Fill a ball with geodesic spheres about a particle at the centre.

    Shell k has 10 k^2 + 2 particles: the k-fold subdivision of the icosahedron's faces. The second mode has the same
    frequency about every axis of this symmetry.

    Args:
        volume: of the polyhedron of the surface [m^3].
        shells: number of spheres, at least 2.
    """
    layers = [geodesic_sphere(k) * (k / shells) for k in range(shells, 0, -1)]
    points = np.concatenate([*layers, np.zeros((1, 3))])
    surface_count = len(layers[0])
    triangles = _outward(layers[0], ConvexHull(layers[0]).simplices.astype(np.int32))
    points *= np.cbrt(volume / enclosed_volume(points, triangles, (), ()))
    return Cloud(
        points=points,
        surface_count=surface_count,
        triangles=triangles,
        rings=(),
        plates=(),
        wall=np.full(len(points), -1, np.int8),
        spacing=float(np.cbrt(volume / len(points))),
    )


def geodesic_sphere(frequency: int) -> Floats:
    """Vertices of the subdivided icosahedron on the unit sphere, `(10 frequency^2 + 2, 3)`."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    corner = np.array([[0.0, one, two * golden] for one in (1, -1) for two in (1, -1)])
    corners = np.concatenate([np.roll(corner, shift, axis=1) for shift in range(3)]) / np.hypot(1.0, golden)
    faces = corners[ConvexHull(corners).simplices]
    arc = np.arctan(2.0)
    weights = np.array(
        [(i, j, frequency - i - j) for i in range(frequency + 1) for j in range(frequency + 1 - i)], dtype=float
    )
    points = (np.sin(arc * weights / frequency) @ faces).reshape(-1, 3)
    points /= np.linalg.norm(points, axis=1)[:, None]
    _, first = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True)
    return points[np.sort(first)]


def _outward(points: Floats, triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """Turn the triangles of a convex surface about the origin outward."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles
