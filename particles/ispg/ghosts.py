"""Ghost particles: mirror images of the particles behind walls and planes of symmetry."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.plate import Plate

# Particles nearer to a plate than this share of the reach lie on it and have no ghost.
ON_PLATE = 1e-6


@dataclass(frozen=True, slots=True)
class Ghosts:
    """Mirror images of n particles at walls.

    Attributes:
        points: Positions, shape (g, 3) [m].
        source: Particle that each ghost is an image of, shape (g,).
        reflection: Matrices that map vectors at the source to vectors at the ghost, shape (g, 3, 3); orthogonal without
            wall friction.
        parent: Particle, or from n on ghost of an earlier plate, that each ghost mirrors, shape (g,).
        wall: Plate that mirrors it, shape (g,).
        flip: Reflection matrices of that plate alone, shape (g, 3, 3).
    """

    points: Floats
    source: NDArray[np.int64]
    reflection: Floats
    parent: NDArray[np.int64]
    wall: NDArray[np.int64]
    flip: Floats

    def drift(self, points: Floats, plates: Sequence[Plate], twists: Mapping[int, Floats]) -> Floats:
        """Return the ghost velocities that moving plates cause with particles at rest, shape (g, 3) [m/s].

        A ghost moves relative to the plate as its particle does: v_ghost = w' + R (v - w), with the plate velocities w
        at the particle and w' at the ghost.

        Args:
            points: Particle positions, shape (n, 3) [m].
            plates: Walls, as passed to ``mirror_particles``.
            twists: Twist of each moving plate by its index, shape (6,) [m/s, rad/s].
        """
        count, everything = len(points), np.concatenate((points, self.points))
        result = np.zeros_like(everything)
        for wall, plate in enumerate(plates):
            mirrored = np.flatnonzero(self.wall == wall)
            parent, image = self.parent[mirrored], count + mirrored
            carried = plate.rigid_velocity(twists.get(wall, np.zeros(6)), everything)
            result[image] = carried[image] + np.einsum(
                "gcd,gd->gc", self.flip[mirrored], result[parent] - carried[parent]
            )
        return result[count:]

    def even(self, count: int) -> sparse.csr_matrix:
        """Return the even extension of a scalar from n particles to particles and ghosts, shape (n + g, n)."""
        columns = np.concatenate((np.arange(count), self.source))
        return sparse.csr_matrix((np.ones(len(columns)), columns, np.arange(len(columns) + 1)), (len(columns), count))

    def vector(self, count: int) -> sparse.csr_matrix:
        """Return the reflecting extension of a vector field stored by component, shape (3 (n + g), 3 n)."""
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


def mirror_particles(
    points: Floats, plates: Sequence[Plate], reach: float, slip_lengths: Sequence[float] | None = None
) -> Ghosts:
    """Create ghost particles: the mirror images of the particles near each plate, plate by plate.

    Ghosts of earlier plates are mirrored, too, so that an edge between two plates at right angles has images of both.
    The tangential velocity of a ghost is (b - z) / (b + z) times that velocity of its particle, with the slip length b
    and the height z above the plate: a linear shear flow at rest at a depth b is continued exactly.

    Args:
        points: Particle positions, shape (n, 3) [m].
        plates: Walls; an empty sequence gives no ghosts.
        reach: Distance from a plate up to which particles are mirrored [m].
        slip_lengths: Slip length of each plate [m], 0 without slip; None for free slip on all plates.

    Returns:
        Positions of the g ghosts, shape (g, 3) [m], the particle that each mirrors, shape (g,), and the matrix that
        maps its vectors to the ghost, shape (g, 3, 3); plate by plate, with the steps of repeated reflections.
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
