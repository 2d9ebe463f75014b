"""Ghost particles: mirror images of the particles behind walls and planes of symmetry."""

from collections.abc import Mapping, Sequence
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
        reflection: `(g, 3, 3)` matrices that map the source's vectors to the image's; orthogonal without friction.
        parent: `(g,)` what each is mirrored from: a particle or, from n on, an image of another plate.
        wall: `(g,)` the plate that mirrors it.
        flip: `(g, 3, 3)` the matrices of that plate alone.
    """

    points: Floats
    source: NDArray[np.int64]
    reflection: Floats
    parent: NDArray[np.int64]
    wall: NDArray[np.int64]
    flip: Floats

    def drift(self, points: Floats, plates: Sequence[Plate], twists: Mapping[int, Floats]) -> Floats:
        """Velocities `(g, 3)` [m/s] that plates which move give the images of particles `(n, 3)` [m] at rest.

        An image moves as its particle does, seen from the plate: w' + R (v - w), w and w' the plate's velocity at the
        particle and at its image.

        Args:
            points: the particles.
            plates: walls, as `mirror` had them.
            twists: `(6,)` of plates that move, by their index.
        """
        count, everything = len(points), np.concatenate((points, self.points))
        result = np.zeros_like(everything)
        for wall, plate in enumerate(plates):
            own = np.flatnonzero(self.wall == wall)
            parent, image = self.parent[own], count + own
            carried = plate.rigid_velocity(twists.get(wall, np.zeros(6)), everything)
            result[image] = carried[image] + np.einsum("gcd,gd->gc", self.flip[own], result[parent] - carried[parent])
        return result[count:]

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


def mirror(
    points: Floats, plates: Sequence[Plate], reach: float, slip_lengths: Sequence[float] | None = None
) -> Ghosts:
    """Mirror the particles `(n, 3)` [m] that are nearer to a plate than the reach [m], plate by plate.

    What the plates before have added is mirrored, too: an edge between two plates at right angles has images of both.
    Velocities along a plate become (b - z) / (b + z) of theirs, b the slip length and z the height of the particle: a
    flow that is linear and would rest at a depth b stays so. They are even with free slip and odd without slip.

    Args:
        points: particles.
        plates: walls.
        reach: of the images [m].
        slip_lengths: of the plates [m], 0 without slip; free slip where none are given.
    """
    all_points, source, nothing = points, np.arange(len(points)), np.zeros(0, np.int64)
    reflection = np.tile(np.eye(3), (len(points), 1, 1))
    parents, walls, flips = [nothing], [nothing], [np.zeros((0, 3, 3))]
    for wall, (plate, slip) in enumerate(zip(plates, slip_lengths or [np.inf] * len(plates), strict=True)):
        height = -plate.side * plate.local(all_points)[:, 2]
        near = np.flatnonzero((height > ON_PLATE * reach) & (height < reach))
        along, across = 1.0 - 2.0 * height[near] / (slip + height[near]), np.outer(plate.normal, plate.normal)
        flip = along[:, None, None] * (np.eye(3) - across) - across
        images = all_points[near] - 2.0 * np.outer(plate.local(all_points[near])[:, 2], plate.normal)
        all_points = np.concatenate((all_points, images))
        source = np.concatenate((source, source[near]))
        reflection = np.concatenate((reflection, flip @ reflection[near]))
        parents.append(near)
        walls.append(np.full(len(near), wall))
        flips.append(flip)
    count = len(points)
    return Ghosts(
        points=all_points[count:],
        source=source[count:],
        reflection=reflection[count:],
        parent=np.concatenate(parents),
        wall=np.concatenate(walls),
        flip=np.concatenate(flips),
    )
