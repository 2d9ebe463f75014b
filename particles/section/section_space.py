"""Galerkin space in section: linear MLS in x and z as sparse matrices, with the hoop strain about an axis.

The wall and the axis are mirrored as in space (``ispg/galerkin_space.py``). About the axis a velocity v_x stretches
hoops at the rate N v_x / x, which tends to dv_x/dx on the axis.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import find_neighbours
from reflowshock.particles.ispg.galerkin_space import symmetry_planes
from reflowshock.particles.ispg.ghosts import mirror_particles
from reflowshock.particles.ispg.nodal_volumes import SOFTNESS, cell_share, fit_volumes
from reflowshock.particles.ispg.stencils import check_stencils
from reflowshock.particles.section.section import Section

REACHES = (2.6, 3.4, 4.4)  # successive search radii for neighbours, in spacings
# Support radius in spacings; it is extended until the 7th neighbour lies within 1 / 1.2 of it.
SUPPORT, FEWEST, WIDER = 2.0, 7, 1.2
# Mean square width of a stencil over its squared support below which it is too thin; 0.1 for evenly spread points.
THIN, ROUNDING = 0.005, 1e-10
# Radius, in spacings, below which hoops stretch at the rate dv_x/dx.
SMALLEST_HOOP = 1e-6
Matrix: TypeAlias = sparse.csr_matrix


@dataclass(frozen=True, slots=True)
class SectionSpace:
    """Operators at n particles; velocities, shape (n, 3), have no component along y.

    Attributes:
        volumes: Nodal volumes, the weights of integration, shape (n,) [m^3].
        scalar: Values N of a scalar that is even at the walls, shape (n, n).
        values: Velocity N v by particle, shape (3 n, 3 n), and the transpose.
        slopes: Velocity gradient, shape (9 n, 3 n) [1/m], and the transpose.
        rates: Divergence, shape (n, 3 n) [1/m], and the transpose.
    """

    volumes: Floats
    scalar: Matrix
    values: tuple[Matrix, Matrix]
    slopes: tuple[Matrix, Matrix]
    rates: tuple[Matrix, Matrix]

    @classmethod
    def of(cls, body: Section) -> "SectionSpace":
        """Fit the shape functions at the particles of a body on walls with free slip.

        Raises:
            DegenerateStencil: A particle has too few neighbours, or they lie on a line.
            NoNodalVolumes: No positive nodal volumes match the volume and the centre of the body.
        """
        count, spacing = len(body.points), body.cloud.spacing
        least = np.full(count, SUPPORT * spacing)
        for reach in spacing * np.array(REACHES):
            ghosts = mirror_particles(body.points, (*body.plates, *symmetry_planes(body.cloud)), reach)
            pairs = _Pairs.within(np.concatenate((body.points, ghosts.points)), least, reach)
            has_enough, across = pairs.supports > 0.0, pairs.across()
            is_thin = has_enough & (across < THIN)
            if (has_enough & ~is_thin).all():
                break
            least[is_thin] = reach
        check_stencils(body, has_enough, f"has fewer than {FEWEST} neighbours within {REACHES[-1]} spacings")
        check_stencils(body, across > ROUNDING, "has all its neighbours on a line")
        source = np.concatenate((np.arange(count), ghosts.source))
        weights, density = pairs.shape_functions(cell_share(body)[source])
        rows, columns = pairs.rows, source[pairs.columns]
        # Plates are level and the axis is vertical: reflections are diagonal.
        reflection = np.concatenate((np.broadcast_to(np.eye(3), (count, 3, 3)), ghosts.reflection))[pairs.columns]
        entries: dict[tuple[int, int], Floats] = {}
        for c in (0, 2):
            for d, weight in zip((0, 2), weights[1:], strict=True):
                entries[c, d] = weight * reflection[:, c, c]
        values = {c: weights[0] * reflection[:, c, c] for c in (0, 2)}
        if body.polyline.power:
            entries[1, 1] = _hoops(body, rows, values[0], entries[0, 0])
        moving = {(c, d): 0 if c == 1 else c for c, d in entries}

        def matrix(parts: list[tuple[Floats, NDArray, NDArray]], size: int, width: int) -> Matrix:
            data, row, column = (np.concatenate(part) for part in zip(*parts, strict=True))
            return sparse.csr_matrix((data, (row, column)), shape=(size * count, width * count))

        slopes = matrix([(w, 9 * rows + 3 * c + d, 3 * columns + moving[c, d]) for (c, d), w in entries.items()], 9, 3)
        velocities = matrix([(w, 3 * rows + c, 3 * columns + c) for c, w in values.items()], 3, 3)
        traces = [(w, rows, 3 * columns + moving[c, d]) for (c, d), w in entries.items() if c == d]
        rates = matrix(traces, 1, 3)
        scalar = matrix([(weights[0], rows, columns)], 1, 1)
        with_transposes = [(operator, operator.T.tocsr()) for operator in (velocities, slopes, rates)]
        return cls(section_volumes(body, density), scalar, *with_transposes)

    @property
    def floating(self) -> None:
        """Modes of floating plates: None, because the wall of a section is at rest."""

    @property
    def carried(self) -> Floats:
        """Volumes whose mass the particles carry: here the nodal volumes, shape (n,) [m^3]."""
        return self.volumes

    def averages(self, coefficients: Floats) -> Floats:
        """Return the approximated values N c at the particles of a scalar that is even at the walls, shape (n,)."""
        return self.scalar @ coefficients

    def unresolved(self, field: Floats) -> Floats:
        """Return v - N v, the part of a velocity field that the shape functions do not resolve, shape (n, 3)."""
        return field - (self.values[0] @ field.ravel()).reshape(-1, 3)

    def gradient(self, field: Floats) -> Floats:
        """Return the velocity gradient, with the hoop strain rate as its yy entry, shape (n, 3, 3) [1/s]."""
        return (self.slopes[0] @ field.ravel()).reshape(-1, 3, 3)

    def lost_power(self, first: Floats, second: Floats, factors: Floats, _walls: Floats) -> tuple[float, float, float]:
        """Return the power [W] of smoothing, wall drag (zero) and viscosity, as ``GalerkinSpace.lost_power``."""
        before, after = self.unresolved(first), self.unresolved(second)
        first, second = self.gradient(first), self.gradient(second)
        stress = factors[:, 2, None, None] * (first + first.transpose(0, 2, 1))
        return float((factors[:, :1] * before * after).sum()), 0.0, float((stress * second).sum())

    def resistance(self, field: Floats, factors: Floats) -> Floats:
        """Return the forces that resist a velocity field, as ``GalerkinSpace.resistance``, shape (n, 3) [N]."""
        smoothing, drag, viscosity = factors.T
        unresolved, gradient = self.unresolved(field), self.gradient(field)
        friction = smoothing[:, None] * unresolved
        stress = viscosity[:, None, None] * (gradient + gradient.transpose(0, 2, 1))
        on_values = drag[:, None] * (field - unresolved) - friction
        return friction + (self.values[1] @ on_values.ravel() + self.slopes[1] @ stress.ravel()).reshape(-1, 3)

    def divergence(self, field: Floats) -> Floats:
        """Return the divergence of a velocity field at the particles, shape (n,) [1/s]."""
        return self.rates[0] @ field.ravel()

    def divergence_load(self, factor: Floats) -> Floats:
        """Apply the transpose of ``divergence`` to factors of shape (n,) [N m]: forces, shape (n, 3) [N]."""
        return (self.rates[1] @ factor).reshape(-1, 3)

    def divergence_rows(self) -> Matrix:
        """Return the divergence as a matrix on velocities by particle, shape (n, 3 n) [1/m]."""
        return self.rates[0]


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Pairs of a particle and a point within its support, the particle itself included, in row order.

    Attributes:
        points: Particles and ghosts, shape (n + g, 3) [m].
        supports: Support radius of each particle, 0 if the search radius was too small, shape (n,) [m].
        rows: Particle of each pair, shape (k,).
        starts: First pair of each particle, shape (n + 1,).
        columns: Point of each pair, shape (k,).
    """

    points: Floats
    supports: Floats
    rows: NDArray[np.int64]
    starts: NDArray[np.int64]
    columns: NDArray[np.int64]

    @classmethod
    def within(cls, points: Floats, least: Floats, reach: float) -> "_Pairs":
        """Find the pairs.

        Args:
            points: Particles and ghosts, shape (n + g, 3) [m].
            least: Lower bounds of the support radii, shape (n,) [m].
            reach: Search radius [m].
        """
        count = len(least)
        offsets, neighbours = find_neighbours(points, reach, rows=count)
        rows = np.repeat(np.arange(count), np.diff(offsets))
        distances = np.linalg.norm(points[neighbours] - points[rows], axis=1)
        nearest = np.lexsort((distances, rows))
        enough = np.diff(offsets) >= FEWEST
        last = np.where(enough, offsets[:-1] + FEWEST - 1, 0)
        supports = np.maximum(least, WIDER * distances[nearest][last])
        supports[~enough | (supports > reach)] = 0.0
        within = distances < supports[rows]
        rows = np.concatenate((np.arange(count), rows[within]))
        columns = np.concatenate((np.arange(count), neighbours[within]))
        order = np.argsort(rows, kind="stable")
        starts = np.concatenate(([0], np.cumsum(np.bincount(rows, minlength=count))))
        return cls(points, supports, rows[order], starts, columns[order])

    @property
    def offset(self) -> Floats:
        """Offset of each point from its particle over the support radius, shape (k, 2)."""
        support = np.where(self.supports > 0.0, self.supports, 1.0)[self.rows]
        return (self.points[self.columns] - self.points[self.rows])[:, [0, 2]] / support[:, None]

    def across(self) -> Floats:
        """Return the mean square of the offsets in the direction of their least spread, shape (n,)."""
        offset = self.offset
        weight = (1.0 - (offset**2).sum(axis=1)) ** 3
        spread = np.add.reduceat(weight[:, None, None] * offset[:, :, None] * offset[:, None, :], self.starts[:-1])
        return np.linalg.eigvalsh(spread)[:, 0] / np.add.reduceat(weight, self.starts[:-1])

    def shape_functions(self, shares: Floats) -> tuple[tuple[Floats, ...], Floats]:
        """Return the weights of psi, psi,x and psi,z of all pairs, and the particle density at each particle.

        Args:
            shares: Share with which each point counts in the density, shape (n + g,).

        Returns:
            Weights, shape (k,) each, and densities up to a constant factor, shape (n,) [1/m^2].
        """
        rows, support, first = self.rows, self.supports[self.rows], self.starts[:-1]
        offset = self.offset
        basis = np.column_stack((np.ones(len(rows)), offset))
        rest = 1.0 - (offset**2).sum(axis=1)
        weight, slope = rest**3, 6.0 * rest[:, None] ** 2 * offset
        products = basis[:, :, None] * basis[:, None, :]
        moments = np.add.reduceat(weight[:, None, None] * products, first)
        by = [np.add.reduceat(slope[:, c, None, None] * products, first) for c in range(2)]
        unit = np.eye(3)
        coefficients = np.linalg.solve(moments, np.broadcast_to(unit[:, :1], (len(first), 3, 1)))
        slopes = [np.linalg.solve(moments, unit[:, 1 + c : 2 + c] - by[c] @ coefficients) for c in range(2)]
        values = (basis * coefficients[rows, :, 0]).sum(axis=1)
        derivatives = [
            ((basis * slopes[c][rows, :, 0]).sum(axis=1) * rest + 6.0 * values * offset[:, c]) * rest**2 / support
            for c in range(2)
        ]
        density = np.add.reduceat(shares[self.columns] * weight, first) / self.supports**2
        return (values * weight, *derivatives), density


def _hoops(body: Section, rows: NDArray, values: Floats, slopes: Floats) -> Floats:
    """Return the weights of the hoop strain rate from those of N v_x and of d(N v_x)/dx, shape (k,) each."""
    radius = body.points[rows, 0]
    on_axis = radius <= SMALLEST_HOOP * body.cloud.spacing
    return np.where(on_axis, slopes, values / np.where(on_axis, 1.0, radius))


def section_volumes(body: Section, density: Floats) -> Floats:
    """Return nodal volumes with the moments of the body: exact for 1, x and z, approximate for second moments.

    About an axis the moments of x and x z vanish for the whole body.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        density: Particle density at each particle, with walls mirrored and the free surface counted by ``cell_share``,
            shape (n,).

    Returns:
        Volumes, shape (n,) [m^3].

    Raises:
        NoNodalVolumes: No positive volumes match the volume and the centre of the body.
    """
    polyline, volume = body.polyline, body.volume()[0]
    areas = cell_share(body) ** 2 / density * np.where(body.cloud.wall >= 0, 0.5, 1.0)
    cells = areas * _mean_radius(body) if polyline.power else areas
    length = np.sqrt(volume) if not polyline.power else np.cbrt(volume)
    exponents = [(0, 1), (2, 0), (0, 2)] if polyline.power else [(1, 0), (0, 1), (2, 0), (0, 2), (1, 1)]
    centre = np.array([polyline.integral(body.line, *first)[0] / volume for first in ((1, 0), (0, 1))])
    if polyline.power:
        centre[0] = 0.0
    line = (body.line - np.array([centre[0], 0.0, centre[1]])) / length
    x, _, z = ((body.points - np.array([centre[0], 0.0, centre[1]])) / length).T
    powers = np.column_stack([np.ones(len(x)), *(x**p * z**q for p, q in exponents)])
    scale = length ** (2 + polyline.power)
    moments = np.array([volume, *(scale * polyline.integral(line, p, q)[0] for p, q in exponents)])
    entries = np.array([np.inf, *(np.inf if p + q < 2 else 1.0 + (p == q) for p, q in exponents)])
    softness = SOFTNESS * volume * (body.cloud.spacing / length) ** 4 / entries
    return fit_volumes(cells * (volume / cells.sum()), powers, moments, softness)


def _mean_radius(body: Section) -> Floats:
    """Return the mean distance from the axis over each particle's cell, one spacing wide, shape (n,) [m]."""
    radius, half = body.points[:, 0], 0.5 * body.cloud.spacing
    return np.where(radius < half, (radius + half) ** 2 / (4.0 * half), radius)
