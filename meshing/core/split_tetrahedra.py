"""Conforming split of tetrahedra into four hexahedra each, with new nodes at midpoints of edges, faces and cells."""

from dataclasses import dataclass

import numpy as np

# Even permutations that bring each vertex to the front: (a, b, c, d) stays positively oriented.
ROTATIONS = ((0, 1, 2, 3), (1, 2, 0, 3), (2, 0, 1, 3), (3, 1, 0, 2))
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
FACES = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])  # opposite to each vertex
EDGE_OF = np.array([[-1, 0, 1, 2], [0, -1, 3, 4], [1, 3, -1, 5], [2, 4, 5, -1]])


@dataclass(frozen=True, slots=True)
class SplitTetrahedra:
    """Hexahedra into which a mesh of tetrahedra was split.

    Attributes:
        points: Vertices, then midpoints of edges, faces and cells, shape (n, 3) [m].
        cells: Nodes of the hexahedra in VTK's order, shape (4 c, 8).
        vertices: Number of vertices.
        edges: Keys of the edges, ascending, shape (e,).
        faces: Keys of the faces, ascending, shape (f,).
    """

    points: np.ndarray
    cells: np.ndarray
    vertices: int
    edges: np.ndarray
    faces: np.ndarray

    def middles(self, pairs: np.ndarray) -> np.ndarray:
        """Return the nodes at the midpoints of edges (..., 2)."""
        return self.vertices + np.searchsorted(self.edges, _keys(pairs, self.vertices))

    def quads_of(self, triangles: np.ndarray) -> np.ndarray:
        """Return the three quadrilaterals of each face (t, 3) of the tetrahedra, equally oriented, shape (3 t, 4)."""
        middle = self.vertices + len(self.edges) + np.searchsorted(self.faces, _keys(triangles, self.vertices))
        following, preceding = np.roll(triangles, -1, axis=1), np.roll(triangles, 1, axis=1)
        ahead, behind = (self.middles(np.stack([triangles, other], axis=2)) for other in (following, preceding))
        centre = np.broadcast_to(middle[:, None], triangles.shape)
        return np.stack([triangles, ahead, centre, behind], axis=2).reshape(-1, 4)


def split_tetrahedra(points: np.ndarray, tetrahedra: np.ndarray) -> SplitTetrahedra:
    """Split positively oriented tetrahedra into four hexahedra each, one at each vertex.

    Args:
        points: Vertices, shape (n, 3) [m].
        tetrahedra: Vertices of the tetrahedra, shape (c, 4).

    Returns:
        Nodes, the n vertices first, then midpoints of edges, faces and cells; hexahedra, shape (4 c, 8); sorted keys by
        which the midpoints of edges and faces are found.
    """
    count = len(points)
    edges, edge = np.unique(_keys(tetrahedra[:, EDGES], count), return_inverse=True)
    faces, face = np.unique(_keys(tetrahedra[:, FACES], count), return_inverse=True)
    edge = count + edge.reshape(-1, 6)
    face = count + len(edges) + face.reshape(-1, 4)
    cell = count + len(edges) + len(faces) + np.arange(len(tetrahedra))
    nodes = np.empty((cell[-1] + 1, 3))
    nodes[:count] = points
    nodes[edge] = points[tetrahedra[:, EDGES]].mean(axis=2)
    nodes[face] = points[tetrahedra[:, FACES]].mean(axis=2)
    nodes[cell] = points[tetrahedra].mean(axis=1)
    cells = [
        np.column_stack(
            [
                *(tetrahedra[:, a], edge[:, EDGE_OF[a, b]], face[:, d], edge[:, EDGE_OF[a, c]]),
                *(edge[:, EDGE_OF[a, d]], face[:, c], cell, face[:, b]),
            ]
        )
        for a, b, c, d in ROTATIONS
    ]
    return SplitTetrahedra(nodes, np.stack(cells, axis=1).reshape(-1, 8), count, edges, faces)


def _keys(nodes: np.ndarray, count: int) -> np.ndarray:
    """Return an integer key for each set of nodes along the last axis, independent of their order."""
    ordered = np.sort(nodes, axis=-1).astype(np.int64)
    key = ordered[..., 0]
    for k in range(1, ordered.shape[-1]):
        key = key * count + ordered[..., k]
    return key
