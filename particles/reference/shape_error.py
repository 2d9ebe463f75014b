"""Distance of a triangulated surface from an exact surface of revolution."""

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.reference.young_laplace import Meridian

# Barycentric points and weights of a quadrature exact for cubic polynomials on a triangle: corners, midpoints of edges,
# centroid (Zienkiewicz, The Finite Element Method, table of triangles).
RULE = (
    ((1.0, 0.0, 0.0), 0.05), ((0.0, 1.0, 0.0), 0.05), ((0.0, 0.0, 1.0), 0.05),
    ((0.5, 0.5, 0.0), 2.0 / 15.0), ((0.0, 0.5, 0.5), 2.0 / 15.0), ((0.5, 0.0, 0.5), 2.0 / 15.0),
    ((1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0), 0.45),
)  # fmt: skip


def shape_error(points: Floats, triangles: Indices, meridian: Meridian) -> float:
    """Return the root mean square distance of a triangulated surface from a surface of revolution about the z axis [m].

    The mean is over the area of the flat triangles, whose corners may lie outside the exact surface and whose middles
    inside. A surface that minimises a discrete area has an error of second order in the size of its triangles.

    Args:
        points: Positions, shape (n, 3) [m].
        triangles: Triangles of the surface, shape (t, 3); a part cut by planes of symmetry is sufficient.
        meridian: Exact meridian: radii and heights of the curve that revolves about z.
    """
    corners = points[triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    square = np.zeros(len(triangles))
    for barycentric, weight in RULE:
        square += weight * distance(np.einsum("k,tkd->td", np.array(barycentric), corners), meridian) ** 2
    return float(np.sqrt(area @ square / area.sum()))


def distance(points: Floats, meridian: Meridian) -> Floats:
    """Return the unsigned distances of points from the surface of revolution of a meridian about z, shape (n,) [m].

    Args:
        points: Points, shape (n, 3) [m].
        meridian: Exact meridian, r and z.
    """
    line = np.column_stack((meridian.r, meridian.z))
    projected = np.column_stack((np.hypot(points[:, 0], points[:, 1]), points[:, 2]))
    nearest = cKDTree(line).query(projected)[1]
    before, after = np.maximum(nearest - 1, 0), np.minimum(nearest + 1, len(line) - 1)
    return np.minimum(*(_from_segment(projected, line[nearest], line[other]) for other in (before, after)))


def _from_segment(points: Floats, start: Floats, end: Floats) -> Floats:
    """Return the distance of each point in a plane from its segment, which may be a single point."""
    along = end - start
    length = np.einsum("nd,nd->n", along, along)
    share = np.einsum("nd,nd->n", points - start, along) / np.where(length > 0.0, length, 1.0)
    return np.linalg.norm(points - start - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)
