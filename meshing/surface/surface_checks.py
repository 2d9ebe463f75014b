"""Checks that a triangulation encloses a body: open, doubled or flipped edges, shells, self-intersections."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.meshing.core.facets import pieces
from reflowshock.meshing.surface.closed_surface import SurfaceError, edge_numbers, volume_of

STEP = 1.5  # ratio of successive size classes of triangles
SMALLEST = 1.0e-6  # of the largest radius: smaller triangles share one size class
PERTURBATION = 1.0e-7  # of vertices, over the extent: below the distance at which vertices are merged
INSIDE = 1.0e-9  # of an edge: least distance of an intersection from the edges of the other triangle


def check_triangulation(points: np.ndarray, triangles: np.ndarray, unit: float) -> None:
    """Check that triangles enclose one body, possibly with voids.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, oriented outwards from the solder, so that shells around voids face into these, (t, 3).
        unit: Unit of the coordinates in the error message [m].

    Raises:
        SurfaceError: The first fault: an open, doubled or flipped edge, a second body, or a self-intersection.
    """
    fault = next(_faults(points, triangles), None)
    if fault is not None:
        message, position = fault
        raise SurfaceError(f"{message} at ({', '.join(f'{value / unit:.4g}' for value in position)})")


def _faults(points: np.ndarray, triangles: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    yield from _edge_faults(points, triangles)
    yield from _shell_faults(points, triangles)
    yield from _crossings(points, triangles)


def _edge_faults(points: np.ndarray, triangles: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield edges that do not belong to two triangles of opposite direction."""
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    _, label, count = np.unique(edge_numbers(np.sort(edges, axis=1)), return_inverse=True, return_counts=True)
    triangle_count = count[label]
    for wrong, message in (
        (triangle_count == 1, "open edge: a hole"),
        (triangle_count > 2, "edge of more than two triangles: a double shell"),
    ):
        if wrong.any():
            where = points[edges[np.argmax(wrong)]].mean(axis=0)
            yield f"{message} ({len(np.unique(label[wrong]))} such edges, allowed 0), first", where
    _, first, twice = np.unique(edge_numbers(edges), return_index=True, return_counts=True)
    if (twice > 1).any():
        where = points[edges[first[np.argmax(twice > 1)]]].mean(axis=0)
        yield f"triangle that faces another way than its neighbour ({int((twice > 1).sum())} edges, allowed 0),", where


def _shell_faults(points: np.ndarray, triangles: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield shells that are neither the outer one, which faces outwards, nor a void inside it, which faces inwards."""
    shells = sorted((triangles[rows] for rows in pieces(triangles)), key=lambda shell: -abs(volume_of(points, shell)))
    corners = points[np.unique(shells[0])]
    if volume_of(points, shells[0]) < 0.0:
        yield "surface is oriented inwards: its volume is negative, allowed > 0; a point of it is", corners[0]
    for shell in shells[1:]:
        vertices = points[np.unique(shell)]
        if volume_of(points, shell) > 0.0:
            yield (
                "second shell that faces outwards, allowed are voids, which face inwards; a point of it is",
                vertices[0],
            )
        if (vertices.min(axis=0) < corners.min(axis=0)).any() or (vertices.max(axis=0) > corners.max(axis=0)).any():
            yield "void that lies outside the body; a point of it is", vertices[0]


def _crossings(points: np.ndarray, triangles: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield intersections of edges with triangles that share no vertex with them.

    Vertices are perturbed slightly first, because a ring that is turned inside out intersects itself in one point,
    where edges only touch.
    """
    extent = float(np.ptp(points, axis=0).max())
    points = points + np.random.default_rng(0).uniform(-PERTURBATION * extent, PERTURBATION * extent, points.shape)
    for first, second in _near_pairs(points, triangles):
        apart = (triangles[first][:, :, None] != triangles[second][:, None, :]).all(axis=(1, 2))
        for edge_owner, other in ((first[apart], second[apart]), (second[apart], first[apart])):
            for k in range(3):
                ends = points[triangles[edge_owner][:, [k, (k + 1) % 3]]]
                hit, where = _pierced(ends, points[triangles[other]])
                if hit.any():
                    yield "surface crosses itself", where[np.argmax(hit)]


def _near_pairs(points: np.ndarray, triangles: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield pairs of triangles whose bounding boxes intersect, by a tree for each size class of triangles."""
    corners = points[triangles]
    low, high, centre = corners.min(axis=1), corners.max(axis=1), corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    size = np.floor(np.log(np.maximum(radius, SMALLEST * radius.max())) / np.log(STEP)).astype(int)
    of_size = [np.flatnonzero(size == number) for number in np.unique(size)]
    groups = [(cKDTree(centre[rows]), rows, radius[rows].max()) for rows in of_size]
    for index, (tree, rows, reach) in enumerate(groups):
        near = tree.query_pairs(2.0 * reach, output_type="ndarray")
        pairs = [(rows[near[:, 0]], rows[near[:, 1]])]
        for other, others, further in groups[:index]:
            distances = tree.sparse_distance_matrix(other, reach + further, output_type="ndarray")
            pairs.append((rows[distances["i"]], others[distances["j"]]))
        for first, second in pairs:
            meet = (low[first] <= high[second]).all(axis=1) & (low[second] <= high[first]).all(axis=1)
            yield first[meet], second[meet]


def _pierced(ends: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return whether segments (k, 2, 3) pierce triangles (k, 3, 3), and where, (k, 3) (Moeller and Trumbore 1997)."""
    along, first, second = ends[:, 1] - ends[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(along, second)
    determinant = np.einsum("ki,ki->k", first, across)
    start = ends[:, 0] - corners[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("ki,ki->k", start, across) / determinant
        turned = np.cross(start, first)
        v = np.einsum("ki,ki->k", along, turned) / determinant
        share = np.einsum("ki,ki->k", second, turned) / determinant
        hit = (u > INSIDE) & (v > INSIDE) & (u + v < 1.0 - INSIDE) & (share > INSIDE) & (share < 1.0 - INSIDE)
        return hit, ends[:, 0] + share[:, None] * along
