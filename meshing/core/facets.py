"""Sets of facets: connected pieces, outlines, horizontal sections, nearest points."""

import numpy as np


def pieces(facets: np.ndarray) -> list[np.ndarray]:
    """Return the row numbers of each piece of facets that is connected by edges.

    Args:
        facets: Node numbers of triangles or quadrilaterals, shape (f, m).

    Returns:
        Row numbers of the facets of each piece, shape (k,), the piece with most facets first.
    """
    ends = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges = np.unique(ends, axis=0, return_inverse=True)[1].reshape(facets.shape)
    label = np.arange(int(edges.max()) + 1)
    while True:
        previous = label.copy()
        np.minimum.at(label, edges, label[edges].min(axis=1)[:, None])
        label = label[label]
        if np.array_equal(label, previous):
            break
    piece = label[edges[:, 0]]
    return sorted((np.flatnonzero(piece == value) for value in np.unique(piece)), key=len, reverse=True)


def outlines(facets: np.ndarray) -> list[np.ndarray]:
    """Return the closed outlines of facets: the loops of edges that belong to one facet only.

    Args:
        facets: Node numbers of consistently oriented triangles or quadrilaterals, shape (f, m).

    Returns:
        Node numbers of each outline in the direction of the facets, shape (k,), the first node not repeated; the
        outline with most nodes first.
    """
    first, second = facets.ravel(), np.roll(facets, -1, axis=1).ravel()
    count = int(facets.max()) + 1
    forward, backward = first * np.int64(count) + second, second * np.int64(count) + first
    unpaired = ~np.isin(forward, backward)
    following = dict(zip(first[unpaired].tolist(), second[unpaired].tolist(), strict=True))
    lines = []
    while following:
        line = [next(iter(following))]
        while line[-1] in following:
            line.append(following.pop(line[-1]))
        lines.append(np.array(line[:-1]))
    return sorted(lines, key=len, reverse=True)


def cut_segments(points: np.ndarray, triangles: np.ndarray, height: float) -> np.ndarray:
    """Return the line segments in which the plane z = height cuts triangles.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, outward oriented, shape (t, 3).
        height: Height of the plane [m]; vertices exactly on the plane count as above it.

    Returns:
        Start and end (x, y) of each segment, shape (s, 2, 2) [m], with the body to its left, thus counter-clockwise.
    """
    above = points[:, 2] >= height
    count = above[triangles].sum(axis=1)
    segments = []
    for lone_above, selected in ((True, count == 1), (False, count == 2)):
        chosen = triangles[selected]
        lone = np.argmax(above[chosen] == lone_above, axis=1)
        apex, following, preceding = (chosen[np.arange(len(chosen)), (lone + k) % 3] for k in range(3))
        first, second = _crossing(points, apex, following, height), _crossing(points, apex, preceding, height)
        segments.append(np.stack((first, second) if lone_above else (second, first), axis=1))
    return np.concatenate(segments)


def section_area(segments: np.ndarray) -> float:
    """Return the area enclosed by the segments of a plane section [m^2].

    Args:
        segments: Start and end (x, y) of each segment, in any order, counter-clockwise, shape (s, 2, 2) [m].
    """
    start, end = segments[:, 0], segments[:, 1]
    return 0.5 * float(np.sum(start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]))


def section_centroid(segments: np.ndarray) -> np.ndarray:
    """Return the centroid (x, y) of the area enclosed by the segments of a plane section, shape (2,) [m].

    Args:
        segments: Start and end (x, y) of each segment, in any order, counter-clockwise, shape (s, 2, 2) [m].
    """
    start, end = segments[:, 0], segments[:, 1]
    cross = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    return ((start + end) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())


def radius_by_angle(segments: np.ndarray, centre: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return the distance from a centre to the outline of a section along each angle.

    Args:
        segments: Start and end (x, y) of each segment of the outline, shape (s, 2, 2) [m].
        centre: Start of the rays, shape (2,) [m].
        angles: Directions of the rays, shape (a,) [rad].

    Returns:
        Distances, shape (a,) [m].

    Raises:
        ValueError: The section is not star-shaped about the centre: a ray does not meet its outline exactly once.
    """
    start, along = segments[:, 0] - centre, segments[:, 1] - segments[:, 0]
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    determinant = rays[:, :1] * along[:, 1] - rays[:, 1:] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / determinant
        position = (start[:, 0] * rays[:, 1:] - start[:, 1] * rays[:, :1]) / determinant
    hit = (distance > 0.0) & (position >= -1e-9) & (position <= 1.0 + 1e-9)
    nearest = np.where(hit, distance, np.inf).min(axis=1)
    farthest = np.where(hit, distance, -np.inf).max(axis=1)
    if not hit.any(axis=1).all() or np.any(farthest - nearest > 1e-6 * farthest):
        raise ValueError("section is not star-shaped about its centroid: a ray does not meet its outline exactly once")
    return nearest


def _crossing(points: np.ndarray, first: np.ndarray, second: np.ndarray, height: float) -> np.ndarray:
    """Return the points where the edges first-second cross the plane, (e, 2) [m], independent of their direction."""
    low, high = np.minimum(first, second), np.maximum(first, second)
    share = (height - points[low, 2]) / (points[high, 2] - points[low, 2])
    return points[low, :2] + share[:, None] * (points[high, :2] - points[low, :2])


def nearest_on_triangles(points: np.ndarray, triangles: np.ndarray, queries: np.ndarray) -> np.ndarray:
    """Return the nearest point on triangles to each query point.

    Args:
        points: Vertices, shape (n, 3) [m].
        triangles: Triangles, shape (t, 3).
        queries: Query points, shape (q, 3) [m].

    Returns:
        Nearest points, shape (q, 3) [m].
    """
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(points, triangles)
    return np.asarray(surface.find_closest_cell(queries, return_closest_point=True)[1])


def nearest_on_line(line: np.ndarray, queries: np.ndarray) -> np.ndarray:
    """Return the nearest point on a closed polygon to each query point.

    Args:
        line: Vertices of the polygon in order, the first not repeated, shape (k, 3) [m].
        queries: Query points, shape (q, 3) [m].

    Returns:
        Nearest points, shape (q, 3) [m].
    """
    along = np.roll(line, -1, axis=0) - line
    share = np.einsum("qki,ki->qk", queries[:, None] - line, along) / np.einsum("ki,ki->k", along, along)
    candidates = line + np.clip(share, 0.0, 1.0)[..., None] * along
    nearest = np.linalg.norm(candidates - queries[:, None], axis=2).argmin(axis=1)
    return candidates[np.arange(len(queries)), nearest]
