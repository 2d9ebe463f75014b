"""Mean motion of pads, and its transpose: the solder's wrench on a pad as forces at nodes.

The motion of a pad is the mean displacement over its wetted disc and the rotation that fits best in the mean square,
given at the pad's centre, which lies the copper's thickness off the face. Both are linear in the displacement, rigid
motions come out exactly, and forces from the transpose do the work of the wrench, whatever the mesh:
w . (P u) = (P^T w) . u.
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
OUTSIDE = 1e-6  # of the disc's radius: how far a point of it may be off the faces


@dataclass(frozen=True, slots=True)
class Pads:
    """The pads of the joints, side 0 on the board, 1 on the package.

    Attributes:
        names: Name of each joint.
        centres: ``(joints, 2, 3)`` [m] of the wetted discs, as drawn.
        radii: ``(joints, 2)`` [m].
    """

    names: Sequence[str]
    centres: NDArray[np.float64]
    radii: NDArray[np.float64]


def pad_matrix(mesh: MeshData, pads: Pads) -> scipy.sparse.csr_matrix:
    """Return P ``(12 joints, 3 n)``: motion of the pads (joint, side, displacement and rotation) from displacements.

    Raises:
        MeshError: A wetted disc reaches beyond its side.
    """
    sides = [_side_matrix(mesh, side, pads, number) for number, side in enumerate(SIDES)]
    rows = np.arange(12 * len(pads.names)).reshape(len(pads.names), 2, 6)
    order = np.argsort(np.concatenate([rows[:, 0].ravel(), rows[:, 1].ravel()]))
    return scipy.sparse.vstack(sides, format="csr")[order]


def _side_matrix(mesh: MeshData, side: str, pads: Pads, number: int) -> scipy.sparse.csr_matrix:
    """Return the rows ``(6 joints, 3 n)`` of one side."""
    facets = mesh.facets_of(side)
    if not len(facets):
        raise MeshError(f"the mesh has no facets {side}, on which pads lie")
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
    """Return points ``(q, 3)`` of the unit disc around the z axis and their shares ``(q,)`` in its area.

    Gauss points in the square of the radius times equal angles, symmetric about both axes: exact for polynomials of
    degree 2 rings - 1 in the square of the radius and below ``angles`` in the angle.
    """
    nodes, weights = np.polynomial.legendre.leggauss(rings)
    radius = np.repeat(np.sqrt(0.5 * (1.0 + nodes)), angles)
    angle = np.tile((np.arange(angles) + 0.5) * (2.0 * np.pi / angles), rings)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(len(radius))])
    return points, np.repeat(0.5 * weights / angles, angles)


def _functional(
    radius: NDArray[np.float64], arm: NDArray[np.float64], offsets: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the weights ``(joints, 6, q, 3)`` of displacements at quadrature points in the motion of each pad."""
    axes = np.eye(3)
    mean = np.broadcast_to(shares[None, :, None] * axes[:, None, :], (len(radius), 3, len(shares), 3))
    # The mean of x^2 over a disc is a^2 / 4; a turn about z takes both x and y.
    turning = (
        np.cross(axes[:, None, :], offsets[None]) * shares[None, :, None] * np.array([4.0, 4.0, 2.0])[:, None, None]
    )
    turn = turning[None] / radius[:, None, None, None]
    levers = np.cross(axes[None, :, :], arm[:, None, :])  # (joints, axis of the turn, component)
    shift = mean + np.einsum("jki,jkqc->jiqc", levers, turn)
    return np.concatenate([shift, turn], axis=1)


def _check_inside(distance: NDArray[np.float64], side: str, pads: Pads, number: int) -> None:
    """Raise ``MeshError`` where points ``(joints, q)`` of a disc are off the side by some ``distance`` [m]."""
    worst = distance.max(axis=1) / pads.radii[:, number]
    joint = int(np.argmax(worst))
    if worst[joint] > OUTSIDE:
        raise MeshError(
            f"the wetted disc of {pads.names[joint]}, radius {1e3 * pads.radii[joint, number]:.4g} mm, reaches"
            f" {1e3 * distance[joint].max():.4g} mm beyond {side}"
        )
