"""Rigid motions of a body, and its momenta along them: what walls admit of them must not change without a force."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.ispg.step_kernels import projected

# Of the largest velocity of a rigid motion: more than this across a wall is none that it admits.
ROUNDING = 1e-9


def admitted_motions(points: Floats, projections: Floats) -> NDArray[np.bool_]:
    """Which rigid motions of points `(n, 3)` [m] walls admit, `(6,)`, by the projections of velocities `(n, 3, 3)`."""
    motions = rigid_motions(points)
    changes = [np.abs(projected(projections, motion) - motion).max() for motion in motions]
    return np.array(changes) <= ROUNDING * np.abs(motions).max(axis=(1, 2))


def rigid_motions(points: Floats) -> Floats:
    """Translations along and rotations about the axes through the origin at points `(n, 3)` [m], `(6, n, 3)`."""
    motions = np.zeros((6, *points.shape))
    for axis in range(3):
        motions[axis, :, axis] = 1.0
        motions[3 + axis, :, axis - 2], motions[3 + axis, :, axis - 1] = -points[:, axis - 1], points[:, axis - 2]
    return motions


def rigid_momenta(motions: Floats, masses: Floats, velocity: Floats) -> Floats:
    """Momenta `(k,)` of a velocity `(n, 3)` [m/s] along rigid motions `(k, n, 3)`; masses `(n,)` [kg]."""
    return motions.reshape(len(motions), velocity.size) @ (masses[:, None] * velocity).ravel()


def orthonormal(motions: Floats, masses: Floats) -> Floats:
    """A basis of rigid motions `(k, n, 3)`, orthonormal by the masses `(n,)` [kg]."""
    flat = motions.reshape(len(motions), 3 * len(masses))
    basis = np.linalg.inv(np.linalg.cholesky(flat @ (np.repeat(masses, 3) * flat).T)) @ flat
    return basis.reshape(motions.shape)
