"""Nearest points on triangles and on closed lines."""

import numpy as np


def nearest_on_triangles(points: np.ndarray, triangles: np.ndarray, queries: np.ndarray) -> np.ndarray:
    """Return the point nearest to each query (q, 3) on triangles (t, 3): (q, 3) [m]."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(points, triangles)
    return np.asarray(surface.find_closest_cell(queries, return_closest_point=True)[1])


def nearest_on_line(line: np.ndarray, queries: np.ndarray) -> np.ndarray:
    """Return the point nearest to each query (q, 3) on a closed polygon (k, 3): (q, 3) [m]."""
    along = np.roll(line, -1, axis=0) - line
    share = np.einsum("qki,ki->qk", queries[:, None] - line, along) / np.einsum("ki,ki->k", along, along)
    found = line + np.clip(share, 0.0, 1.0)[..., None] * along
    nearest = np.linalg.norm(found - queries[:, None], axis=2).argmin(axis=1)
    return found[np.arange(len(queries)), nearest]
