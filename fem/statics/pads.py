"""Mean motion P u of pads, and its transpose P^T w: the solder's wrench on a pad as nodal forces.

The motion of a pad is the mean displacement over its wetted disc and the least-squares rotation, both at the pad's
centre, which is the copper thickness away from the face. They are linear in the displacement and exact for rigid-body
motions, and the transpose conserves work on any mesh: w . (P u) = (P^T w) . u.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.tie import bilinear, closest_facets

SIDES = ("board_side", "package_side")
RINGS, ANGLES = 4, 12  # quadrature points on a disc
OUTSIDE = 1e-6  # largest distance of a quadrature point from the faces, relative to the radius of the disc


@dataclass(frozen=True, slots=True)
class Pads:
    """Pads of the joints; side 0 is the board, side 1 the package.

    Attributes:
        names: Name of each joint.
        centres: Centres of the wetted discs in the undeformed state, shape (joints, 2, 3) [m].
        radii: Radii of the wetted discs, shape (joints, 2) [m].
    """

    names: Sequence[str]
    centres: NDArray[np.float64]
    radii: NDArray[np.float64]


def pad_matrix(mesh: MeshData, pads: Pads) -> scipy.sparse.csr_matrix:
    """Return the sparse matrix P from nodal displacements to pad motions, shape (12 joints, 3 n).

    The six motions of a pad are the mean displacement [m] and rotation [rad] of its wetted disc along x, y, z. Rows are
    ordered by joint, side (board, package), displacement and rotation; columns by node and component.

    Args:
        mesh: Mesh of board and package, n nodes.
        pads: Names, centres and radii of the wetted discs of all joints.

    Raises:
        MeshError: A wetted disc extends beyond the face of its side.
    """
    sides = [_side_matrix(mesh, side, pads, number) for number, side in enumerate(SIDES)]
    rows = np.arange(12 * len(pads.names)).reshape(len(pads.names), 2, 6)
    order = np.argsort(np.concatenate([rows[:, 0].ravel(), rows[:, 1].ravel()]))
    return scipy.sparse.vstack(sides, format="csr")[order]


def _side_matrix(mesh: MeshData, side: str, pads: Pads, number: int) -> scipy.sparse.csr_matrix:
    """Return the rows of one side, shape (6 joints, 3 n)."""
    facets = mesh.facets_of(side)
    if not len(facets):
        raise MeshError(f"the mesh has no facet set {side!r} for the pads")
    offsets, shares = disc_rule(RINGS, ANGLES)
    plane, flat = np.array([1.0, 1.0, 0.0]), mesh.points * [1.0, 1.0, 0.0]
    centre, radius = pads.centres[:, number], pads.radii[:, number]
    points = centre[:, None, :] * plane + radius[:, None, None] * offsets
    facet, xi, distance = closest_facets(points.reshape(-1, 3), flat[facets])
    _check_inside(distance.reshape(points.shape[:2]), side, pads, number)
    nodes, weight = facets[facet].reshape(*points.shape[:2], 4), bilinear(xi).reshape(*points.shape[:2], 4)
    arm = centre - np.einsum("q,jqa,jqai->ji", shares, weight, mesh.points[nodes])
    functional = _functional(radius, arm, offsets, shares)
    values = functional[..., None] * weight[:, None, :, None, :]
    columns = 3 * nodes[:, None, :, None, :] + np.arange(3)[None, None, None, :, None]
    rows = np.arange(6 * len(centre)).reshape(-1, 6)[:, :, None, None, None]
    columns, rows = (np.broadcast_to(array, values.shape).ravel() for array in (columns, rows))
    shape = (6 * len(centre), mesh.points.size)
    return scipy.sparse.csr_matrix((values.ravel(), (rows, columns)), shape=shape)


def disc_rule(rings: int, angles: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a quadrature rule on the unit disc: points, shape (q, 3), with z = 0, and area fractions, shape (q,).

    The rule is a product of Gauss points in the squared radius and equally spaced angles, symmetric about both axes. It
    is exact for polynomials of degree 2 rings - 1 in the squared radius and below ``angles`` in the angle.

    Args:
        rings: Number of radii.
        angles: Number of angles on each radius; q = rings * angles.
    """
    nodes, weights = np.polynomial.legendre.leggauss(rings)
    radius = np.repeat(np.sqrt(0.5 * (1.0 + nodes)), angles)
    angle = np.tile((np.arange(angles) + 0.5) * (2.0 * np.pi / angles), rings)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(len(radius))])
    return points, np.repeat(0.5 * weights / angles, angles)


def _functional(
    radius: NDArray[np.float64], arm: NDArray[np.float64], offsets: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the weights of quadrature-point displacements in the pad motions, shape (joints, 6, q, 3)."""
    axes = np.eye(3)
    mean = np.broadcast_to(shares[None, :, None] * axes[:, None, :], (len(radius), 3, len(shares), 3))
    # The mean of x^2 over a disc is a^2 / 4; a rotation about z involves both x and y.
    rotation = (
        np.cross(axes[:, None, :], offsets[None]) * shares[None, :, None] * np.array([4.0, 4.0, 2.0])[:, None, None]
    )
    turn = rotation[None] / radius[:, None, None, None]
    levers = np.cross(axes[None, :, :], arm[:, None, :])  # (joints, rotation axis, component)
    shift = mean + np.einsum("jki,jkqc->jiqc", levers, turn)
    return np.concatenate([shift, turn], axis=1)


def _check_inside(distance: NDArray[np.float64], side: str, pads: Pads, number: int) -> None:
    """Raise ``MeshError`` if a quadrature point is off the face, by its distance, shape (joints, q) [m]."""
    worst = distance.max(axis=1) / pads.radii[:, number]
    joint = int(np.argmax(worst))
    if worst[joint] > OUTSIDE:
        raise MeshError(
            f"the wetted disc of {pads.names[joint]}, radius {1e3 * pads.radii[joint, number]:.4g} mm, extends"
            f" {1e3 * distance[joint].max():.4g} mm beyond {side}"
        )
