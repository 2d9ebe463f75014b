"""Space of the Galerkin scheme in section, as sparse matrices, with the hoop strain about an axis.

Linear MLS in x and z, the wall and the axis mirrored. Around the axis a velocity v_x stretches hoops by N v_x / x; on
the axis that is dv_x/dx.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.neighbours import find_neighbours
from reflowshock.particles.ispg.galerkin_space import symmetry_planes
from reflowshock.particles.ispg.ghosts import mirror
from reflowshock.particles.ispg.nodal_volumes import SOFTNESS, cell_share, fitted_volumes
from reflowshock.particles.ispg.stencils import check_stencils
from reflowshock.particles.section.section import Section

REACHES = (2.6, 3.4, 4.4)  # of the search for neighbours, in spacings
# Support radius in spacings; but the 7th neighbour lies within 1 / 1.2 of it.
SUPPORT, FEWEST, WIDER = 2.0, 7, 1.2
# Mean square of the offsets across a stencil, over its support, below which it is too thin; 0.1 where points are even.
THIN, ROUNDING = 0.005, 1e-10
# Of a spacing: hoops that are smaller stretch by dv_x/dx.
SMALLEST_HOOP = 1e-6
Matrix: TypeAlias = sparse.csr_matrix


@dataclass(frozen=True, slots=True)
class SectionSpace:
    """Operators at n particles; velocities `(n, 3)` have no component along y.

    Attributes:
        volumes: `(n,)` of the particles as points of integration [m^3].
        scalar: `(n, n)` values of what is even at the walls.
        values: `(3 n, 3 n)` velocity N v, by particle; and the transposed.
        slopes: `(9 n, 3 n)` its gradient [1/m]; and the transposed.
        rates: `(n, 3 n)` its divergence [1/m]; and the transposed.
    """

    volumes: Floats
    scalar: Matrix
    values: tuple[Matrix, Matrix]
    slopes: tuple[Matrix, Matrix]
    rates: tuple[Matrix, Matrix]

    @classmethod
    def of(cls, body: Section) -> "SectionSpace":
        """Fit the shape functions at the particles of a body, on walls with free slip.

        Raises:
            DegenerateStencil: a particle has too few neighbours, or they lie on a line.
            NoNodalVolumes: the particles do not fill the body.
        """
        count, spacing = len(body.points), body.cloud.spacing
        least = np.full(count, SUPPORT * spacing)
        for reach in spacing * np.array(REACHES):
            ghosts = mirror(body.points, (*body.plates, *symmetry_planes(body.cloud)), reach)
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
        # Plates are level and the axis is upright: images have each component with a factor of its own.
        reflection = np.concatenate((np.broadcast_to(np.eye(3), (count, 3, 3)), ghosts.reflection))[pairs.columns]
        entries: dict[tuple[int, int], Floats] = {}
        for c in (0, 2):
            for d, weight in zip((0, 2), weights[1:], strict=True):
                entries[c, d] = weight * reflection[:, c, c]
        values = {c: weights[0] * reflection[:, c, c] for c in (0, 2)}
        if body.chain.power:
            entries[1, 1] = _hoops(body, rows, values[0], entries[0, 0])
        moving = {(c, d): 0 if c == 1 else c for c, d in entries}

        def matrix(parts: list[tuple[Floats, NDArray, NDArray]], size: int, width: int) -> Matrix:
            data, at, of = (np.concatenate(part) for part in zip(*parts, strict=True))
            return sparse.csr_matrix((data, (at, of)), shape=(size * count, width * count))

        slopes = matrix([(w, 9 * rows + 3 * c + d, 3 * columns + moving[c, d]) for (c, d), w in entries.items()], 9, 3)
        shown = matrix([(w, 3 * rows + c, 3 * columns + c) for c, w in values.items()], 3, 3)
        traces = [(w, rows, 3 * columns + moving[c, d]) for (c, d), w in entries.items() if c == d]
        rates = matrix(traces, 1, 3)
        scalar = matrix([(weights[0], rows, columns)], 1, 1)
        pairs_of = [(one, one.T.tocsr()) for one in (shown, slopes, rates)]
        return cls(section_volumes(body, density), scalar, *pairs_of)

    @property
    def riders(self) -> None:
        """None: the wall of a section rests."""

    @property
    def carried(self) -> Floats:
        """Volumes whose mass the particles carry: here those that they have."""
        return self.volumes

    def averages(self, coefficients: Floats) -> Floats:
        """Values at the particles `(n,)` of a scalar that is even at the walls."""
        return self.scalar @ coefficients

    def rough(self, field: Floats) -> Floats:
        """What the shape functions do not show of a velocity `(n, 3)`, v - N v."""
        return field - (self.values[0] @ field.ravel()).reshape(-1, 3)

    def gradient(self, field: Floats) -> Floats:
        """Gradient of a velocity `(n, 3, 3)` [1/s], that of hoops in the middle."""
        return (self.slopes[0] @ field.ravel()).reshape(-1, 3, 3)

    def lost_power(self, fields: tuple[Floats, Floats], factors: Floats, _walls: Floats) -> tuple[float, float, float]:
        """Power [W] that roughness, walls, which take none, and viscosity take, as `GalerkinSpace.lost_power`."""
        (first, second), (before, after) = (map(act, fields) for act in (self.gradient, self.rough))
        stress = factors[:, 2, None, None] * (first + first.transpose(0, 2, 1))
        return float((factors[:, :1] * before * after).sum()), 0.0, float((stress * second).sum())

    def resistance(self, field: Floats, factors: Floats) -> Floats:
        """Forces `(n, 3)` [N] that resist a velocity, as `GalerkinSpace.resistance`."""
        smoothing, drag, viscosity = factors.T
        rough, gradient = self.rough(field), self.gradient(field)
        friction = smoothing[:, None] * rough
        stress = viscosity[:, None, None] * (gradient + gradient.transpose(0, 2, 1))
        on_values = drag[:, None] * (field - rough) - friction
        return friction + (self.values[1] @ on_values.ravel() + self.slopes[1] @ stress.ravel()).reshape(-1, 3)

    def divergence(self, field: Floats) -> Floats:
        """Divergence of a velocity at the particles `(n,)` [1/s]."""
        return self.rates[0] @ field.ravel()

    def divergence_load(self, factor: Floats) -> Floats:
        """The transposed of `divergence`: forces on the particles `(n, 3)` [N] of factors `(n,)` [N m]."""
        return (self.rates[1] @ factor).reshape(-1, 3)

    def divergence_rows(self) -> Matrix:
        """Rows of `divergence` as a matrix `(n, 3 n)`, velocities by particle."""
        return self.rates[0]


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Pairs of a particle and a point within its support, itself included, rows one after the other.

    Attributes:
        points: `(n + g, 3)` particles and images [m].
        supports: `(n,)` radius [m], 0 where the search did not reach far enough.
        rows, starts, columns: of the pairs.
    """

    points: Floats
    supports: Floats
    rows: NDArray[np.int64]
    starts: NDArray[np.int64]
    columns: NDArray[np.int64]

    @classmethod
    def within(cls, points: Floats, least: Floats, reach: float) -> "_Pairs":
        """Find them, with supports of at least `(n,)` [m], among the points that a search of some reach [m] finds."""
        count = len(least)
        offsets, found = find_neighbours(points, reach, rows=count)
        rows = np.repeat(np.arange(count), np.diff(offsets))
        distances = np.linalg.norm(points[found] - points[rows], axis=1)
        nearest = np.lexsort((distances, rows))
        enough = np.diff(offsets) >= FEWEST
        last = np.where(enough, offsets[:-1] + FEWEST - 1, 0)
        supports = np.maximum(least, WIDER * distances[nearest][last])
        supports[~enough | (supports > reach)] = 0.0
        kept = distances < supports[rows]
        rows = np.concatenate((np.arange(count), rows[kept]))
        columns = np.concatenate((np.arange(count), found[kept]))
        order = np.argsort(rows, kind="stable")
        starts = np.concatenate(([0], np.cumsum(np.bincount(rows, minlength=count))))
        return cls(points, supports, rows[order], starts, columns[order])

    @property
    def offset(self) -> Floats:
        """From the particles to the points, over the support, `(k, 2)`."""
        support = np.where(self.supports > 0.0, self.supports, 1.0)[self.rows]
        return (self.points[self.columns] - self.points[self.rows])[:, [0, 2]] / support[:, None]

    def across(self) -> Floats:
        """Mean square of the offsets in the direction in which the points of a row spread least `(n,)`."""
        offset = self.offset
        weight = (1.0 - (offset**2).sum(axis=1)) ** 3
        spread = np.add.reduceat(weight[:, None, None] * offset[:, :, None] * offset[:, None, :], self.starts[:-1])
        return np.linalg.eigvalsh(spread)[:, 0] / np.add.reduceat(weight, self.starts[:-1])

    def shape_functions(self, shares: Floats) -> tuple[tuple[Floats, ...], Floats]:
        """Weights of psi, psi,x and psi,z of all pairs, and density of particles [1/m^2]. As in `galerkin_kernels`.

        The density counts each point by its share `(n + g,)`, without a constant factor.
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
        found = np.linalg.solve(moments, np.broadcast_to(unit[:, :1], (len(first), 3, 1)))
        slopes = [np.linalg.solve(moments, unit[:, 1 + c : 2 + c] - by[c] @ found) for c in range(2)]
        values = (basis * found[rows, :, 0]).sum(axis=1)
        along = [
            ((basis * slopes[c][rows, :, 0]).sum(axis=1) * rest + 6.0 * values * offset[:, c]) * rest**2 / support
            for c in range(2)
        ]
        density = np.add.reduceat(shares[self.columns] * weight, first) / self.supports**2
        return (values * weight, *along), density


def _hoops(body: Section, rows: NDArray, values: Floats, slopes: Floats) -> Floats:
    """Weights of the strain rate of hoops about the axis, of pairs with weights of N v_x and of d N v_x / dx."""
    radius = body.points[rows, 0]
    on_axis = radius <= SMALLEST_HOOP * body.cloud.spacing
    return np.where(on_axis, slopes, values / np.where(on_axis, 1.0, radius))


def section_volumes(body: Section, density: Floats) -> Floats:
    """Volumes of the particles `(n,)` [m^3] with the moments of the body: of 1, x and z, and nearly of second order.

    About an axis those of x and x z are zero for the whole body.

    Args:
        body: the liquid body.
        density: `(n,)` of particles around each, walls mirrored, the free surface counted by `cell_share`.

    Raises:
        NoNodalVolumes: there are none.
    """
    chain, volume = body.chain, body.volume()[0]
    areas = cell_share(body) ** 2 / density * np.where(body.cloud.wall >= 0, 0.5, 1.0)
    found = areas * _mean_radius(body) if chain.power else areas
    length = np.sqrt(volume) if not chain.power else np.cbrt(volume)
    exponents = [(0, 1), (2, 0), (0, 2)] if chain.power else [(1, 0), (0, 1), (2, 0), (0, 2), (1, 1)]
    centre = np.array([chain.integral(body.line, *one)[0] / volume for one in ((1, 0), (0, 1))])
    if chain.power:
        centre[0] = 0.0
    line = (body.line - np.array([centre[0], 0.0, centre[1]])) / length
    x, _, z = ((body.points - np.array([centre[0], 0.0, centre[1]])) / length).T
    powers = np.column_stack([np.ones(len(x)), *(x**p * z**q for p, q in exponents)])
    scale = length ** (2 + chain.power)
    wanted = np.array([volume, *(scale * chain.integral(line, p, q)[0] for p, q in exponents)])
    entries = np.array([np.inf, *(np.inf if p + q < 2 else 1.0 + (p == q) for p, q in exponents)])
    softness = SOFTNESS * volume * (body.cloud.spacing / length) ** 4 / entries
    return fitted_volumes(found * (volume / found.sum()), powers, wanted, softness)


def _mean_radius(body: Section) -> Floats:
    """Mean distance from the axis over each particle's cell, a spacing wide, on this side of it `(n,)` [m]."""
    radius, half = body.points[:, 0], 0.5 * body.cloud.spacing
    return np.where(radius < half, (radius + half) ** 2 / (4.0 * half), radius)
