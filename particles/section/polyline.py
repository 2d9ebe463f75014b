"""Free surface in section: a polyline that represents a body of revolution, or a plane drop of some depth along y.

Segments stand for cones or plane strips. Next to the axis a segment is a parabola with its apex there, because the
curvature at a cone's tip is a quarter too small: area over volume gives 1.5 / R instead of 2 / R.

The liquid is on the left of the polyline, which runs counter-clockwise from the right contact point or from the lower
end of the axis. By the divergence theorem, integrals of x^p z^q with weight c x^k over the region between the polyline,
the wall z = 0 and the axis x = 0 are those of x^(p + k + 1) z^q dz along the polyline times c / (p + k + 1); Gauss
quadrature makes them exact. A meridian represents half a body of revolution (k = 1, c = pi), as a plane of symmetry
leaves it.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from reflowshock.arrays import Floats

# Gauss-Legendre rule on a segment, exact for polynomials up to t^7.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = 0.5 + 0.5 * NODES, 0.5 * WEIGHTS


@dataclass(frozen=True, slots=True)
class SegmentQuadrature:
    """Quadrature points on e segments, g per segment, with the parameter t in [0, 1] along each.

    Attributes:
        x: Coordinates x, shape (e, g) [m].
        z: Coordinates z, shape (e, g) [m].
        x_share: Weight of the second vertex in x, shape (g,).
        z_share: Weight of the second vertex in z, shape (e, g).
        x_rise: Derivative dx/dt, shape (e, 1) [m].
        z_rise: Derivative dz/dt, shape (e, g) [m].
        slope: Derivative of ``z_share`` by t, shape (e, g).
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
        """Arc length per parameter, shape (e, g) [m]."""
        return np.hypot(self.x_rise, self.z_rise)

    def by_ends(self, by_x: Floats, by_z: Floats, by_x_rise: Floats | None, by_z_rise: Floats) -> list[Floats]:
        """Return the gradients of a sum over the quadrature points by the first and by the second vertices.

        Args:
            by_x: Derivative by x, shape (e, g).
            by_z: Derivative by z, shape (e, g).
            by_x_rise: Derivative by dx/dt, shape (e, g); None if zero.
            by_z_rise: Derivative by dz/dt, shape (e, g).

        Returns:
            Two gradients, shape (e, 3).
        """
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
    """Geometry of a surface in section, as functions of its s vertices in the plane y = 0, shape (s, 3) [m].

    Attributes:
        power: Exponent k of x in the weight: 1 about an axis, 0 in a plane.
        factor: Factor c of the weight: pi, or the depth along y [m].
        is_closed: Whether the last vertex is joined to the first.
    """

    power: int
    factor: float
    is_closed: bool = False

    @classmethod
    def meridian(cls) -> "Polyline":
        """Return the meridian of half a body of revolution about the z axis."""
        return cls(1, np.pi)

    @classmethod
    def plane(cls, is_closed: bool, depth: float = 1.0) -> "Polyline":
        """Return the section of a plane drop.

        Args:
            is_closed: Whether the surface is closed, without a wall.
            depth: Depth along y [m].
        """
        return cls(0, depth, is_closed)

    def ends(self, line: Floats) -> tuple[Floats, Floats]:
        """Return the first and the second vertices of the segments, shape (e, 3) each [m]."""
        return (line, np.roll(line, -1, axis=0)) if self.is_closed else (line[:-1], line[1:])

    def _sum(self, first: Floats, second: Floats) -> Floats:
        """Sum contributions of segments to their first and second vertices, shape (e, ...) each, by vertex."""
        if self.is_closed:
            return first + np.roll(second, 1, axis=0)
        none = np.zeros((1, *first.shape[1:]))
        return np.concatenate((first, none)) + np.concatenate((none, second))

    def quadrature(self, line: Floats) -> SegmentQuadrature:
        """Return the quadrature points of straight segments and of parabolas with their apex on the axis."""
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
        """Return the weighted integral of x^p z^q over the enclosed region, and its gradient.

        Args:
            line: Vertices, shape (s, 3) [m].
            p: Exponent of x.
            q: Exponent of z.

        Returns:
            Integral [m^(3 + p + q)] and its gradient by the vertices, shape (s, 3).
        """
        points, power = self.quadrature(line), p + self.power + 1
        scale = self.factor / power * WEIGHTS
        values = scale * points.x**power * points.z**q
        by_x = scale * power * points.x ** (power - 1) * points.z**q * points.z_rise
        by_z = scale * points.x**power * (q * points.z ** (q - 1) if q else 0.0) * points.z_rise
        return float((values * points.z_rise).sum()), self._sum(*points.by_ends(by_x, by_z, None, values))

    def area(self, line: Floats) -> tuple[float, Floats]:
        """Return the area of the surface [m^2] and its gradient by the vertices, shape (s, 3) [m]."""
        points = self.quadrature(line)
        length, weight = points.length, self.factor * WEIGHTS * points.x**self.power
        by_x = self.power * self.factor * WEIGHTS * length
        pulls = (weight * points.x_rise / length, weight * points.z_rise / length)
        return float((weight * length).sum()), self._sum(*points.by_ends(by_x, np.zeros_like(length), *pulls))

    def stiffness(self, line: Floats, count: int) -> sparse.csr_matrix:
        """Return the stiffness K of the surface Laplacian with the hoop terms of an axis.

        Args:
            line: Vertices, shape (s, 3) [m].
            count: Number n of particles, of which the vertices are the first.

        Returns:
            Stiffness per unit surface tension by particle, shape (3 n, 3 n).
        """
        points = self.quadrature(line)
        weight = self.factor * WEIGHTS * points.x**self.power / points.length
        weight = np.column_stack((weight.sum(axis=1), (weight * points.slope**2).sum(axis=1))).ravel()
        i = np.arange(len(points.x))
        j = (i + 1) % len(line)
        i, j = ((3 * vertex[:, None] + [0, 2]).ravel() for vertex in (i, j))
        rows, columns = np.concatenate((i, j, i, j)), np.concatenate((j, i, i, j))
        values = np.concatenate((-weight, -weight, weight, weight))
        if self.power:
            length, off_axis = points.length @ WEIGHTS, np.flatnonzero(line[:, 0] > 0.0)
            around = self._sum(0.5 * length, 0.5 * length)[off_axis]
            rows, columns = (np.concatenate((index, 3 * off_axis)) for index in (rows, columns))
            values = np.concatenate((values, self.factor * around / line[off_axis, 0]))
        return sparse.csr_matrix((values, (rows, columns)), shape=(3 * count, 3 * count))

    def wetted(self, line: Floats) -> tuple[float, Floats]:
        """Return the wetted area of the wall z = 0 [m^2] and its gradient by the vertices, shape (s, 3) [m]."""
        power, gradient = self.power + 1, np.zeros_like(line)
        gradient[0, 0] = self.factor * line[0, 0] ** self.power
        area = self.factor / power * line[0, 0] ** power
        if not self.power:
            gradient[-1, 0] = -self.factor
            area -= self.factor * line[-1, 0]
        return float(area), gradient

    def areas(self, line: Floats, heights: Floats) -> Floats:
        """Return the areas of horizontal discs at given heights; in a plane, of the disc of the same width.

        Args:
            line: Vertices, shape (s, 3) [m].
            heights: Heights, all different from the heights of the vertices, shape (k,) [m].

        Returns:
            Areas, shape (k,) [m^2].
        """
        first, second = self.ends(line)
        low, high = (np.broadcast_to(end[:, 2], (len(heights), len(end))) for end in (first, second))
        height = heights[:, None]
        sense = np.sign(high - low) * ((low < height) != (high < height))
        share = np.where(sense == 0.0, 0.0, (height - low) / np.where(sense == 0.0, 1.0, high - low))
        if self.power:  # on a parabola z is proportional to x^2
            share = np.where(first[:, 0] == 0.0, np.sqrt(share), share)
            share = np.where(second[:, 0] == 0.0, 1.0 - np.sqrt(1.0 - share), share)
        x = first[:, 0] + share * (second[:, 0] - first[:, 0])
        if self.power:
            return np.pi * (sense * x**2).sum(axis=1)
        return 0.25 * np.pi * (sense * x).sum(axis=1) ** 2

    def normals(self, line: Floats) -> Floats:
        """Return outward unit normals at the vertices, normal to the chord between their neighbours, shape (s, 3)."""
        first, second = self.ends(line)
        chord = self._sum(second - first, second - first)
        if self.power:  # at the axis the mirrored half follows
            chord[np.abs(line[:, 0]) <= 0.0, 2] = 0.0
        normal = np.column_stack((chord[:, 2], np.zeros(len(line)), -chord[:, 0]))
        return normal / np.linalg.norm(normal, axis=1)[:, None]

    def smoothing_offsets(self, line: Floats, share: float) -> Floats:
        """Return displacements that even the spacing of the vertices; the ends stay in place.

        Vertices move along the parabola through themselves and their neighbours, and so stay on a smooth surface to
        third order.

        Args:
            line: Vertices, shape (s, 3) [m].
            share: Share of the distance to the middle of the neighbours.

        Returns:
            Displacements, shape (s, 3) [m].
        """
        before, after = np.roll(line, 1, axis=0), np.roll(line, -1, axis=0)
        back, ahead = line - before, after - line
        a, b = (np.linalg.norm(edge, axis=1)[:, None] for edge in (back, ahead))
        length = 0.5 * share * (b - a)
        offset = length * (back / a + (length + a) / (a + b) * (ahead / b - back / a))
        if not self.is_closed:
            offset[[0, -1]] = 0.0
        return offset
