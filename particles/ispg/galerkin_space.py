"""Galerkin space of the particles: linear moving least squares, direct nodal integration, mirrored walls.

The velocity of the ghost particles is odd across a wall, so that nothing passes it. Along the wall it is even with free
slip, odd without slip, and in between with Navier slip (``ghosts.py``). Operators act without being assembled. The
transpose of each uses the same weights, so that forces and stresses do exactly their virtual power on the particles.
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
from reflowshock.particles.ispg.ghosts import Ghosts, mirror_particles
from reflowshock.particles.ispg.moving_plates import FloatingModes
from reflowshock.particles.ispg.nodal_volumes import body_moments, cell_share, fit_to_moments, nodal_volumes
from reflowshock.particles.ispg.shape_function_rows import shape_rows, supports, with_rows
from reflowshock.particles.ispg.stencils import check_stencils

# Search radius for neighbours in spacings, and the larger one of particles with too few of them.
REACH, WIDEST = 2.4, 4.4
# Lower bound of V + N^T V as a share of the volume V: at the rim of a film thinner than a spacing the shape functions
# extrapolate, N^T V may be below -V, and the mass would be negative.
LEAST_CARRIED = 0.5
AT_REST: Mapping[int, Floats] = MappingProxyType({})  # twists without a moving plate


@dataclass(frozen=True, slots=True)
class GalerkinSpace:
    """Shape functions at n particles with g ghost particles, and the weights of nodal integration.

    Attributes:
        volumes: Nodal volumes, the weights of integration, shape (n,) [m^3].
        carried: Volumes whose mass the particles carry, shape (n,) [m^3].
        starts: Start of the row of each particle, shape (n + 1,).
        columns: Particle or ghost of each entry, shape (k,).
        weights: Shape function and its derivatives [1/m] of each entry, shape (k, 4).
        ghosts: Ghost particles at walls and planes of symmetry.
        order: Particles sorted along the longest side of the body, shape (n,).
        drift: Velocities of the ghosts that prescribed plate motion gives with particles at rest, shape (g, 3) [m/s].
        floating: Rigid-body modes of the floating plates; None without such plates.
    """

    volumes: Floats
    carried: Floats
    starts: NDArray[np.int64]
    columns: NDArray[np.int32]
    weights: Floats
    ghosts: Ghosts
    order: NDArray[np.int64]
    drift: Floats
    floating: FloatingModes | None = None

    @classmethod
    def of(cls, body: Body, slip_length: float = np.inf, twists: Mapping[int, Floats] = AT_REST) -> "GalerkinSpace":
        """Fit the shape functions at the particles of a body.

        Args:
            body: Liquid body.
            slip_length: Slip length of the plates [m]; 0 without slip.
            twists: Twist of each plate on a prescribed path by its index, shape (6,) [m/s, rad/s].

        Raises:
            DegenerateStencil: A particle has too few neighbours, or they lie in a plane.
            NoNodalVolumes: No positive nodal volumes match the volume and the centre of the body.
        """
        count, spacing = len(body.points), body.cloud.spacing
        planes = symmetry_planes(body.cloud)
        slips = [slip_length] * len(body.plates) + [np.inf] * len(planes)
        ghosts = mirror_particles(body.points, (*body.plates, *planes), WIDEST * spacing, slips)
        points = np.concatenate((body.points, ghosts.points))
        lists = find_neighbours(points, REACH * spacing, rows=count)
        squares, lengths = supports(np.arange(count), points, (*lists, REACH * spacing), spacing)
        sparse_rows = np.flatnonzero(squares == 0.0)
        if len(sparse_rows):
            near = find_near(points[sparse_rows], points, WIDEST * spacing)
            lists = with_rows(lists, sparse_rows, near)
            wider = supports(sparse_rows, points, (*lists, WIDEST * spacing), spacing)
            squares[sparse_rows], lengths[sparse_rows] = wider
        check_stencils(body, squares > 0.0, "has fewer than 16 neighbours within 4.4 spacings")
        starts = np.concatenate(([0], np.cumsum(lengths)))
        shares = cell_share(body)
        shares = np.concatenate((shares, shares[ghosts.source]))
        columns, weights, density = shape_rows(points, lists, squares, starts, shares)
        check_stencils(body, density > 0.0, "has all its neighbours in a plane")
        moments = body_moments(body)
        volumes = nodal_volumes(body, density, moments)
        spread = kernels.spread(starts, columns, weights, volumes, ghosts.source)
        carried = fit_to_moments(body, np.maximum(volumes + spread, LEAST_CARRIED * volumes), moments)
        drift = ghosts.drift(body.points, (*body.plates, *planes), twists) if twists else np.zeros_like(ghosts.points)
        order = np.argsort(body.points[:, np.argmax(np.ptp(body.points, axis=0))], kind="stable")
        return cls(volumes, carried, starts, columns, weights, ghosts, order, drift)

    @property
    def rows(self) -> tuple[NDArray[np.int64], NDArray[np.int32], Floats]:
        """Starts, columns and weights of the shape functions, for kernels."""
        return self.starts, self.columns, self.weights

    @property
    def images(self) -> tuple[NDArray[np.int64], Floats]:
        """Source particles and reflection matrices of the ghosts, for kernels."""
        return self.ghosts.source, self.ghosts.reflection

    @property
    def shape(self) -> sparse.csr_matrix:
        """Shape functions without derivatives, shape (n, n + g)."""
        size = len(self.starts) - 1, len(self.volumes) + len(self.ghosts.source)
        return sparse.csr_matrix((self.weights[:, 0].copy(), self.columns, self.starts), shape=size)

    def averages(self, coefficients: Floats) -> Floats:
        """Return the approximated values N c at the particles of a scalar that is even at the walls, shape (n,)."""
        even = np.concatenate((coefficients, coefficients[self.ghosts.source]))
        return kernels.values(*self.rows, even[:, None])[:, 0]

    def unresolved(self, field: Floats) -> Floats:
        """Return v - N v, the part of a velocity field that the shape functions do not resolve, shape (n, 3)."""
        return field - kernels.values(*self.rows, self.with_images(field))

    def gradient(self, field: Floats) -> Floats:
        """Return the velocity gradient d v_c / d x_d at the particles, shape (n, 3, 3) [1/s]."""
        return kernels.velocity_gradient(self.starts, self.columns, self.weights, self.with_images(field))

    def resistance(self, field: Floats, factors: Floats) -> Floats:
        """Return the forces of smoothing, wall drag and viscosity that resist a velocity field, shape (n, 3) [N].

        Args:
            field: Velocity, shape (n, 3) [m/s].
            factors: Coefficients of v - N v [kg/s], of N v [kg/s] and of twice the strain rate [N m s], shape (n, 3).
        """
        images = self.with_images(field)
        return self._folded(kernels.resistance(self.starts, self.columns, self.weights, images, factors))

    def lost_power(self, first: Floats, second: Floats, factors: Floats, walls: Floats) -> tuple[float, float, float]:
        """Return the power in one velocity field of the forces that resist another one.

        Args:
            first: Velocity that causes the forces, shape (n, 3) [m/s].
            second: Velocity in which their power is taken, shape (n, 3) [m/s].
            factors: Coefficients as in ``resistance``, shape (n, 3).
            walls: Wall velocities, relative to which N v slips, shape (n, 3) [m/s].

        Returns:
            Power of smoothing, of wall drag and of viscosity [W].
        """
        fields = self.with_images(first), self.with_images(second)
        return kernels.lost_power(self.rows, fields, factors, walls)

    def divergence(self, field: Floats) -> Floats:
        """Return the divergence of a velocity field at the particles, shape (n,) [1/s]."""
        return kernels.divergence(self.starts, self.columns, self.weights, self.with_images(field))

    def divergence_load(self, factor: Floats) -> Floats:
        """Apply the transpose of ``divergence`` to factors of shape (n,) [N m]: forces, shape (n, 3) [N]."""
        result = self._no_forces()
        kernels.divergence_transposed(self.starts, self.columns, self.weights, factor, result)
        return self._folded(result)

    def with_images(self, field: Floats) -> Floats:
        """Append the velocities of the ghosts to a velocity field of shape (n, 3): shape (n + g, 3) [m/s]."""
        images = kernels.reflected(field, self.ghosts.source, self.ghosts.reflection)
        images[len(field) :] += self.ghost_drift(field)
        return images

    def ghost_drift(self, field: Floats) -> Floats:
        """Return the ghost velocities due to moving plates, shape (g, 3) [m/s].

        Args:
            field: Velocity, which contains the motion of the floating plates, shape (n, 3) [m/s].
        """
        if self.floating is None:
            return self.drift
        return self.drift + np.tensordot(self.floating.amplitudes(field), self.floating.drifts, 1)

    def distribute(self, force: Floats) -> Floats:
        """Return N^T f, the forces on particles that correspond to forces f on N v, shape (n, 3) [N]."""
        return self._folded(self.shape.T @ force)

    def drift_of(self, body: Body, twists: Mapping[int, Floats]) -> Floats:
        """Return the ghost velocities with particles at rest and moving plates, shape (g, 3) [m/s].

        Args:
            body: Liquid body with its plates.
            twists: Twist of each moving plate by its index, shape (6,) [m/s, rad/s].
        """
        return self.ghosts.drift(body.points, (*body.plates, *symmetry_planes(body.cloud)), twists)

    def _folded(self, forces: Floats) -> Floats:
        return kernels.folded(forces, self.ghosts.source, self.ghosts.reflection)

    def _no_forces(self) -> Floats:
        return np.zeros((len(self.starts) - 1 + len(self.ghosts.source), 3))


def symmetry_planes(cloud: Cloud) -> list[Plate]:
    """Return the planes of symmetry of a cloud as plates, so that particles can be mirrored at them as at walls.

    Args:
        cloud: Particles of the computed part of a body; its ``symmetry`` lists the axes, 0 for the plane x = 0 and 1
            for y = 0.

    Returns:
        One plate for each plane, in the order of the axes; empty without symmetry.
    """
    return [Plate(np.zeros(3), np.roll(np.eye(3), 2 - axis, axis=0)) for axis in cloud.symmetry]
