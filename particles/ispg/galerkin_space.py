"""Space of the Galerkin scheme: linear MLS of the velocity, direct nodal integration, walls mirrored.

Velocities of particles are odd across a wall, so that nothing passes it, and along it even with free slip, odd without
slip, between the two with Navier slip (`mirror`). The operators act without being assembled; the transposed of each is
made of the same weights, so that what a force or stress does to the particles is its virtual power, to rounding.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import Cloud
from reflowshock.particles.core.neighbours import find_near, find_neighbours
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.ispg import galerkin_kernels as kernels
from reflowshock.particles.ispg.ghosts import Ghosts, mirror
from reflowshock.particles.ispg.moving_plates import FloatingModes
from reflowshock.particles.ispg.nodal_volumes import body_moments, cell_share, nodal_volumes, with_moments
from reflowshock.particles.ispg.stencils import check_stencils

# Reach of the search for neighbours in spacings, and that of particles with too few of them.
REACH, WIDEST = 2.4, 4.4
# The least that a particle counts of its volume V in V + N^T V: at the rim of a film that is thinner than a spacing
# N^T V may be below -V, where the shape functions continue what is inside, and its mass would be negative.
LEAST_CARRIED = 0.5
AT_REST: Mapping[int, Floats] = MappingProxyType({})  # no plate moves


@dataclass(frozen=True, slots=True)
class GalerkinSpace:
    """Shape functions at n particles and the volumes that stand for integrals.

    Attributes:
        volumes: `(n,)` of the particles as points of integration [m^3].
        carried: `(n,)` volumes whose mass the particles carry [m^3].
        starts, columns, weights: rows of psi and its derivatives [1/m], columns up to n + g.
        ghosts: g images of the particles at the walls.
        order: `(n,)` particles one after the other along the longest side of the body.
        drift: `(g, 3)` velocities of these where walls move as prescribed and particles do not [m/s].
        riders: motions of plates that float.
    """

    volumes: Floats
    carried: Floats
    starts: NDArray[np.int64]
    columns: NDArray[np.int32]
    weights: Floats
    ghosts: Ghosts
    order: NDArray[np.int64]
    drift: Floats
    riders: FloatingModes | None = None

    @classmethod
    def of(cls, body: Body, slip_length: float = np.inf, twists: Mapping[int, Floats] = AT_REST) -> "GalerkinSpace":
        """Fit the shape functions at the particles of a body, on plates with a slip length [m] and some twists `(6,)`.

        Raises:
            DegenerateStencil: a particle has too few neighbours, or they lie in a plane.
            NoNodalVolumes: the particles do not fill the body.
        """
        count, spacing = len(body.points), body.cloud.spacing
        planes = symmetry_planes(body.cloud)
        slips = [slip_length] * len(body.plates) + [np.inf] * len(planes)
        ghosts = mirror(body.points, (*body.plates, *planes), WIDEST * spacing, slips)
        points = np.concatenate((body.points, ghosts.points))
        lists = find_neighbours(points, REACH * spacing, rows=count)
        squares, lengths = kernels.supports(np.arange(count), points, (*lists, REACH * spacing), spacing)
        lacking = np.flatnonzero(squares == 0.0)
        if len(lacking):
            lists = kernels.with_rows(lists, lacking, find_near(points[lacking], points, WIDEST * spacing))
            wider = kernels.supports(lacking, points, (*lists, WIDEST * spacing), spacing)
            squares[lacking], lengths[lacking] = wider
        check_stencils(body, squares > 0.0, "has fewer than 16 neighbours within 4.4 spacings")
        starts = np.concatenate(([0], np.cumsum(lengths)))
        shares = cell_share(body)
        shares = np.concatenate((shares, shares[ghosts.source]))
        columns, weights, density = kernels.shape_rows(points, lists, squares, starts, shares)
        check_stencils(body, density > 0.0, "has all its neighbours in a plane")
        moments = body_moments(body)
        volumes = nodal_volumes(body, density, moments)
        of_shapes = kernels.spread(starts, columns, weights, volumes, ghosts.source)
        carried = with_moments(body, np.maximum(volumes + of_shapes, LEAST_CARRIED * volumes), moments)
        drift = ghosts.drift(body.points, (*body.plates, *planes), twists) if twists else np.zeros_like(ghosts.points)
        order = np.argsort(body.points[:, np.argmax(np.ptp(body.points, axis=0))], kind="stable")
        return cls(volumes, carried, starts, columns, weights, ghosts, order, drift)

    @property
    def rows(self) -> tuple[NDArray[np.int64], NDArray[np.int32], Floats]:
        """Starts, columns and weights of the shape functions, for kernels."""
        return self.starts, self.columns, self.weights

    @property
    def images(self) -> tuple[NDArray[np.int64], Floats]:
        """Sources and reflections of the images, for kernels."""
        return self.ghosts.source, self.ghosts.reflection

    @property
    def shape(self) -> sparse.csr_matrix:
        """Psi alone, `(n, n + g)`."""
        size = len(self.starts) - 1, len(self.volumes) + len(self.ghosts.source)
        return sparse.csr_matrix((self.weights[:, 0].copy(), self.columns, self.starts), shape=size)

    def averages(self, coefficients: Floats) -> Floats:
        """Values at the particles `(n,)` of a scalar that is even at the walls."""
        even = np.concatenate((coefficients, coefficients[self.ghosts.source]))
        return kernels.values(*self.rows, even[:, None])[:, 0]

    def rough(self, field: Floats) -> Floats:
        """What the shape functions do not show of a velocity `(n, 3)`, v - N v."""
        return field - kernels.values(*self.rows, self.with_images(field))

    def gradient(self, field: Floats) -> Floats:
        """Gradient of a velocity `(n, 3, 3)` [1/s], [i, c, d] = d v_c / d x_d, at the particles."""
        return kernels.velocity_gradient(self.starts, self.columns, self.weights, self.with_images(field))

    def resistance(self, field: Floats, factors: Floats) -> Floats:
        """Forces `(n, 3)` [N] that resist a velocity `(n, 3)` [m/s]: of roughness, walls and viscosity.

        Args:
            field: the velocity.
            factors: `(n, 3)` of v - N v [kg/s], of N v [kg/s] and of twice the strain rate [N m s], each with a force
                on what it resists, by the transposed of what finds it.
        """
        images = self.with_images(field)
        return self._folded(kernels.resistance(self.starts, self.columns, self.weights, images, factors))

    def lost_power(self, fields: tuple[Floats, Floats], factors: Floats, walls: Floats) -> tuple[float, float, float]:
        """Power [W] of the forces that resist the first of two velocities `(n, 3)` [m/s] in the second one.

        Args:
            fields: the velocities.
            factors: of `resistance`, `(n, 3)`.
            walls: velocities of walls `(n, 3)` [m/s], against which N v slides.

        Returns:
            By roughness, by walls and by viscosity.
        """
        first, second = (self.with_images(field) for field in fields)
        return kernels.lost_power(self.rows, (first, second), factors, walls)

    def divergence(self, field: Floats) -> Floats:
        """Divergence of a velocity at the particles `(n,)` [1/s]."""
        return kernels.divergence(self.starts, self.columns, self.weights, self.with_images(field))

    def divergence_load(self, factor: Floats) -> Floats:
        """The transposed of `divergence`: forces on the particles `(n, 3)` [N] of factors `(n,)` [N m]."""
        result = self._nothing()
        kernels.divergence_transposed(self.starts, self.columns, self.weights, factor, result)
        return self._folded(result)

    def with_images(self, field: Floats) -> Floats:
        """A velocity `(n, 3)` with that of the images, `(n + g, 3)` [m/s]."""
        images = kernels.reflected(field, self.ghosts.source, self.ghosts.reflection)
        images[len(field) :] += self.driven(field)
        return images

    def driven(self, field: Floats) -> Floats:
        """Velocities that plates which move give the images `(g, 3)` [m/s]: as prescribed, or with a field `(n, 3)`."""
        if self.riders is None:
            return self.drift
        return self.drift + np.tensordot(self.riders.rates(field), self.riders.drifts, 1)

    def shown(self, force: Floats) -> Floats:
        """Forces on particles `(n, 3)` [N] of those on N v."""
        return self._folded(self.shape.T @ force)

    def drift_of(self, body: Body, twists: Mapping[int, Floats]) -> Floats:
        """Velocities of the images `(g, 3)` [m/s] of resting particles of a body whose plates have some twists."""
        return self.ghosts.drift(body.points, (*body.plates, *symmetry_planes(body.cloud)), twists)

    def _folded(self, forces: Floats) -> Floats:
        return kernels.folded(forces, self.ghosts.source, self.ghosts.reflection)

    def _nothing(self) -> Floats:
        return np.zeros((len(self.starts) - 1 + len(self.ghosts.source), 3))


def symmetry_planes(cloud: Cloud) -> list[Plate]:
    """The planes of symmetry as plates, which are mirrored like walls."""
    return [Plate(np.zeros(3), np.roll(np.eye(3), 2 - axis, axis=0)) for axis in cloud.symmetry]
