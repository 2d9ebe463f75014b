"""A surface in section: a chain of straight segments that stands for cones, or for planes of a unit depth.

The liquid is on its left: counter-clockwise from the right contact point, or from the lower end of the axis. What it
encloses with the wall z = 0 and the axis x = 0 are integrals over the chain, exact as the sums here:
of x^p z^q over the section, weighed by c x^k, by the divergence theorem c / (p + k + 1) times that of x^(p + k + 1) z^q dz.
A meridian stands for half a body of revolution (k = 1, c = pi), which is what a plane of symmetry leaves of it.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats

# Rule of Gauss for each segment, exact for polynomials up to x^7.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
ENDS = np.column_stack((0.5 - 0.5 * NODES, 0.5 + 0.5 * NODES))


@dataclass(frozen=True, slots=True)
class Chain:
    """What the segments between s vertices stand for; vertices `(s, 3)` [m] lie in the plane y = 0.

    Attributes:
        power: k, 1 about an axis and 0 in a plane.
        factor: c.
        is_closed: whether the last vertex is followed by the first.
    """

    power: int
    factor: float
    is_closed: bool = False

    @classmethod
    def meridian(cls) -> "Chain":
        """Half a body of revolution about the z axis."""
        return cls(1, np.pi)

    @classmethod
    def plane(cls, is_closed: bool) -> "Chain":
        """A unit length along y [m]."""
        return cls(0, 1.0, is_closed)

    def ends(self, line: Floats) -> tuple[Floats, Floats]:
        """First and second vertices of the segments, `(e, 3)` each."""
        return (line, np.roll(line, -1, axis=0)) if self.is_closed else (line[:-1], line[1:])

    def _sum(self, first: Floats, second: Floats) -> Floats:
        """Sum by vertex of what segments give to their first and second ends, `(e, ...)` each."""
        if self.is_closed:
            return first + np.roll(second, 1, axis=0)
        none = np.zeros((1, *first.shape[1:]))
        return np.concatenate((first, none)) + np.concatenate((none, second))

    def integral(self, line: Floats, p: int, q: int) -> tuple[float, Floats]:
        """Integral of x^p z^q over what the chain encloses, and its gradient by the vertices `(s, 3)`."""
        first, second = self.ends(line)
        rise, power = second[:, 2] - first[:, 2], p + self.power + 1
        x, z = (np.outer(first[:, d], ENDS[:, 0]) + np.outer(second[:, d], ENDS[:, 1]) for d in (0, 2))
        scale = self.factor / power * 0.5 * WEIGHTS
        values = (x**power * z**q) @ scale
        by_x = power * x ** (power - 1) * z**q * scale * rise[:, None]
        by_z = x**power * (q * z ** (q - 1) if q else np.zeros_like(z)) * scale * rise[:, None]
        gradients = []
        for end, sign in ((0, -1.0), (1, 1.0)):
            gradient = np.zeros((len(rise), 3))
            gradient[:, 0], gradient[:, 2] = by_x @ ENDS[:, end], by_z @ ENDS[:, end] + sign * values
            gradients.append(gradient)
        return float(values @ rise), self._sum(*gradients)

    def area(self, line: Floats) -> tuple[float, Floats]:
        """Area of the surface and its gradient by the vertices `(s, 3)`."""
        first, second = self.ends(line)
        along = second - first
        length = np.linalg.norm(along, axis=1)
        mean = self._mean(first, second)
        pull = (mean / length)[:, None] * along
        wider = np.zeros_like(along)
        wider[:, 0] = 0.5 * self.power * self.factor * length
        return float(mean @ length), self._sum(wider - pull, wider + pull)

    def stiffness(self, line: Floats, count: int) -> sparse.csr_matrix:
        """Stiffness K of the surface Laplacian, velocities of the first s of n particles, `(3 n, 3 n)` by particle.

        About the axis hoops of the surface resist, too: x of each vertex with the length around it over its radius.
        """
        first, second = self.ends(line)
        length = np.linalg.norm(second - first, axis=1)
        weight = np.repeat(self._mean(first, second) / length, 2)
        i = np.arange(len(length))
        j = (i + 1) % len(line)
        i, j = ((3 * one[:, None] + [0, 2]).ravel() for one in (i, j))
        rows, columns = np.concatenate((i, j, i, j)), np.concatenate((j, i, i, j))
        values = np.concatenate((-weight, -weight, weight, weight))
        if self.power:
            off_axis = np.flatnonzero(line[:, 0] > 0.0)
            around = self._sum(0.5 * length, 0.5 * length)[off_axis]
            rows, columns = (np.concatenate((one, 3 * off_axis)) for one in (rows, columns))
            values = np.concatenate((values, self.factor * around / line[off_axis, 0]))
        return sparse.csr_matrix((values, (rows, columns)), shape=(3 * count, 3 * count))

    def wetted(self, line: Floats) -> tuple[float, Floats]:
        """Area of the wall z = 0 under the liquid, and its gradient by the vertices `(s, 3)`."""
        power, gradient = self.power + 1, np.zeros_like(line)
        gradient[0, 0] = self.factor * line[0, 0] ** self.power
        area = self.factor / power * line[0, 0] ** power
        if not self.power:
            gradient[-1, 0] = -self.factor
            area -= self.factor * line[-1, 0]
        return float(area), gradient

    def _mean(self, first: Floats, second: Floats) -> Floats:
        """Mean of c x^k over each segment, `(e,)`."""
        return self.factor * (0.5 * (first[:, 0] + second[:, 0])) ** self.power

    def normals(self, line: Floats) -> Floats:
        """Unit normals out of the liquid at the vertices `(s, 3)`, of the chord between their neighbours."""
        first, second = self.ends(line)
        along = self._sum(second - first, second - first)
        if self.power:  # at the axis the other half follows
            along[np.abs(line[:, 0]) <= 0.0, 2] = 0.0
        normal = np.column_stack((along[:, 2], np.zeros(len(line)), -along[:, 0]))
        return normal / np.linalg.norm(normal, axis=1)[:, None]

    def evening(self, line: Floats, share: float) -> Floats:
        """Displacements `(s, 3)` of vertices by a share of the way to the middle of their neighbours; ends stay.

        Along the parabola through the three: they stay on a smooth surface to third order.
        """
        before, after = np.roll(line, 1, axis=0), np.roll(line, -1, axis=0)
        back, ahead = line - before, after - line
        a, b = (np.linalg.norm(one, axis=1)[:, None] for one in (back, ahead))
        way = 0.5 * share * (b - a)
        offset = way * (back / a + (way + a) / (a + b) * (ahead / b - back / a))
        if not self.is_closed:
            offset[[0, -1]] = 0.0
        return offset
