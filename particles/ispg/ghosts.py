"""Mirror images of particles behind plates: a stencil next to a wall then sees both sides.

A field that is even has no slope along the normal of the wall. A velocity is mirrored as a vector: its component
along the wall is even, the other one odd, as free slip wants it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.plate import Plate

# Particles nearer to a plate than this share of the reach lie on it: they are their own image.
ON_PLATE = 1e-6


@dataclass(frozen=True, slots=True)
class Ghosts:
    """Images of n particles.

    Attributes:
        points: `(g, 3)` [m].
        source: `(g,)` the particle that each is the image of.
        reflection: `(g, 3, 3)` orthogonal matrices that map the source's vectors to the image's.
    """

    points: Floats
    source: NDArray[np.int64]
    reflection: Floats

    def even(self, count: int) -> sparse.csr_matrix:
        """Extension of a scalar from n particles to them and their images, `(n + g, n)`."""
        columns = np.concatenate((np.arange(count), self.source))
        return sparse.csr_matrix((np.ones(len(columns)), columns, np.arange(len(columns) + 1)), (len(columns), count))

    def vector(self, count: int) -> sparse.csr_matrix:
        """Extension of a vector field, `(3 (n + g), 3 n)`, components one after the other."""
        frames = np.concatenate((np.broadcast_to(np.eye(3), (count, 3, 3)), self.reflection))
        columns = np.concatenate((np.arange(count), self.source))
        total = len(columns)
        blocks = [
            [
                sparse.csr_matrix((frames[:, i, j], columns, np.arange(total + 1)), shape=(total, count))
                for j in range(3)
            ]
            for i in range(3)
        ]
        result = sparse.bmat(blocks, format="csr")
        result.eliminate_zeros()
        return result


def mirror(points: Floats, plates: Sequence[Plate], reach: float) -> Ghosts:
    """Mirror the particles `(n, 3)` [m] that are nearer to a plate than the reach [m], plate by plate.

    What the plates before have added is mirrored, too: an edge between two plates at right angles has images of both.
    """
    all_points, source = points, np.arange(len(points))
    reflection = np.broadcast_to(np.eye(3), (len(points), 3, 3))
    for plate in plates:
        height = -plate.side * plate.local(all_points)[:, 2]
        near = np.flatnonzero((height > ON_PLATE * reach) & (height < reach))
        flip = np.eye(3) - 2.0 * np.outer(plate.normal, plate.normal)
        images = all_points[near] - 2.0 * np.outer(plate.local(all_points[near])[:, 2], plate.normal)
        all_points = np.concatenate((all_points, images))
        source = np.concatenate((source, source[near]))
        reflection = np.concatenate((reflection, flip @ reflection[near]))
    count = len(points)
    return Ghosts(all_points[count:], source[count:], reflection[count:])
