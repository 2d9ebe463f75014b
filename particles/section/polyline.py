"""A surface in section: a chain of segments that stands for cones, or for planes of some depth along y.

Next to the axis a segment is a parabola with its apex there: the curvature of a cone's tip is a quarter too small.
The liquid is on its left: counter-clockwise from the right contact point, or from the lower end of the axis. Integrals
of x^p z^q over what it encloses with the wall z = 0 and the axis x = 0, weighed by c x^k, are those over the chain of
x^(p + k + 1) z^q dz, times c / (p + k + 1), by the divergence theorem; the sums here are exact. A meridian stands for
half a body of revolution (k = 1, c = pi), which is what a plane of symmetry leaves of it.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats

# Rule of Gauss over a segment, exact for polynomials up to t^7.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = 0.5 + 0.5 * NODES, 0.5 * WEIGHTS


@dataclass(frozen=True, slots=True)
class SegmentQuadrature:
    """Places on e segments, `(e, g)` at the nodes of the rule.

    Attributes:
        x, z: coordinates [m].
        x_share: `(g,)` share of the second vertex in x; z_share: `(e, g)` in z.
        x_rise: `(e, 1)` dx/dt [m]; z_rise: `(e, g)` dz/dt [m]; slope: `(e, g)` d z_share / dt.
    """

    x: Floats
    z: Floats
    x_share: Floats
    z_share: Floats
    x_rise: Floats
    z_rise: Floats
    slope: Floats

    @property
    def length(self) -> Floats:
        """Length by t, `(e, g)` [m]."""
        return np.hypot(self.x_rise, self.z_rise)

    def by_ends(self, by_x: Floats, by_z: Floats, by_x_rise: Floats | None, by_z_rise: Floats) -> list[Floats]:
        """Gradient by the first and the second vertices `(e, 3)` of sums over the nodes, from derivatives `(e, g)`."""
        gradients = []
        for sign, in_x, in_z in ((-1.0, 1.0 - self.x_share, 1.0 - self.z_share), (1.0, self.x_share, self.z_share)):
            gradient = np.zeros((len(self.x), 3))
            gradient[:, 0] = (by_x * in_x).sum(axis=1)
            if by_x_rise is not None:
                gradient[:, 0] += sign * by_x_rise.sum(axis=1)
            gradient[:, 2] = (by_z * in_z + sign * by_z_rise * self.slope).sum(axis=1)
            gradients.append(gradient)
        return gradients


@dataclass(frozen=True, slots=True)
class Polyline:
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
    def meridian(cls) -> "Polyline":
        """Half a body of revolution about the z axis."""
        return cls(1, np.pi)

    @classmethod
    def plane(cls, is_closed: bool, depth: float = 1.0) -> "Polyline":
        """A piece of a depth along y [m]."""
        return cls(0, depth, is_closed)

    def ends(self, line: Floats) -> tuple[Floats, Floats]:
        """First and second vertices of the segments, `(e, 3)` each."""
        return (line, np.roll(line, -1, axis=0)) if self.is_closed else (line[:-1], line[1:])

    def _sum(self, first: Floats, second: Floats) -> Floats:
        """Sum by vertex of what segments give to their first and second ends, `(e, ...)` each."""
        if self.is_closed:
            return first + np.roll(second, 1, axis=0)
        none = np.zeros((1, *first.shape[1:]))
        return np.concatenate((first, none)) + np.concatenate((none, second))

    def arcs(self, line: Floats) -> SegmentQuadrature:
        """Places on the segments: straight ones, and parabolas with their apex on the axis."""
        first, second = self.ends(line)
        share, slope = np.tile(NODES, (len(first), 1)), np.ones((len(first), len(NODES)))
        if self.power:
            for end, apex in ((0, first), (-1, second)):
                if apex[end, 0] == 0.0:
                    away = NODES if end == 0 else 1.0 - NODES
                    share[end] = away**2 if end == 0 else 1.0 - away**2
                    slope[end] = 2.0 * away
        rise = second - first
        return SegmentQuadrature(
            x=first[:, :1] + NODES * rise[:, :1],
            z=first[:, 2:] + share * rise[:, 2:],
            x_share=NODES,
            z_share=share,
            x_rise=rise[:, :1],
            z_rise=slope * rise[:, 2:],
            slope=slope,
        )

    def integral(self, line: Floats, p: int, q: int) -> tuple[float, Floats]:
        """Integral of x^p z^q over what the chain encloses, and its gradient by the vertices `(s, 3)`."""
        arcs, power = self.arcs(line), p + self.power + 1
        scale = self.factor / power * WEIGHTS
        values = scale * arcs.x**power * arcs.z**q
        by_x = scale * power * arcs.x ** (power - 1) * arcs.z**q * arcs.z_rise
        by_z = scale * arcs.x**power * (q * arcs.z ** (q - 1) if q else 0.0) * arcs.z_rise
        return float((values * arcs.z_rise).sum()), self._sum(*arcs.by_ends(by_x, by_z, None, values))

    def area(self, line: Floats) -> tuple[float, Floats]:
        """Area of the surface and its gradient by the vertices `(s, 3)`."""
        arcs = self.arcs(line)
        length, weight = arcs.length, self.factor * WEIGHTS * arcs.x**self.power
        by_x = self.power * self.factor * WEIGHTS * length
        pulls = (weight * arcs.x_rise / length, weight * arcs.z_rise / length)
        return float((weight * length).sum()), self._sum(*arcs.by_ends(by_x, np.zeros_like(length), *pulls))

    def stiffness(self, line: Floats, count: int) -> sparse.csr_matrix:
        """Stiffness K of the surface Laplacian, velocities of the first s of n particles, `(3 n, 3 n)` by particle.

        About the axis hoops of the surface resist, too: x of each vertex with the length around it over its radius.
        """
        arcs = self.arcs(line)
        weight = self.factor * WEIGHTS * arcs.x**self.power / arcs.length
        weight = np.column_stack((weight.sum(axis=1), (weight * arcs.slope**2).sum(axis=1))).ravel()
        i = np.arange(len(arcs.x))
        j = (i + 1) % len(line)
        i, j = ((3 * one[:, None] + [0, 2]).ravel() for one in (i, j))
        rows, columns = np.concatenate((i, j, i, j)), np.concatenate((j, i, i, j))
        values = np.concatenate((-weight, -weight, weight, weight))
        if self.power:
            length, off_axis = arcs.length @ WEIGHTS, np.flatnonzero(line[:, 0] > 0.0)
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

    def areas(self, line: Floats, heights: Floats) -> Floats:
        """Areas `(k,)` [m^2] of horizontal sections at heights `(k,)` [m], at no vertex: of discs.

        In a plane of the disc that is as wide.
        """
        first, second = self.ends(line)
        low, high = (np.broadcast_to(end[:, 2], (len(heights), len(end))) for end in (first, second))
        height = heights[:, None]
        sense = np.sign(high - low) * ((low < height) != (high < height))
        share = np.where(sense == 0.0, 0.0, (height - low) / np.where(sense == 0.0, 1.0, high - low))
        if self.power:  # on a parabola heights go with the square of x
            share = np.where(first[:, 0] == 0.0, np.sqrt(share), share)
            share = np.where(second[:, 0] == 0.0, 1.0 - np.sqrt(1.0 - share), share)
        x = first[:, 0] + share * (second[:, 0] - first[:, 0])
        if self.power:
            return np.pi * (sense * x**2).sum(axis=1)
        return 0.25 * np.pi * (sense * x).sum(axis=1) ** 2

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
