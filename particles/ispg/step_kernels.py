"""Kernels of the equations of a step: operators that visit each pair once, and the rows of the pressure equation.

``rows`` are the starts, columns and weights of the shape functions, ``images`` the sources and reflections of the ghost
particles, as in ``galerkin_kernels.py``.
"""

import numpy as np
from numba import njit
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.ispg.galerkin_kernels import (
    divergence,
    divergence_transposed,
    folded,
    reflected,
    resistance,
)


@njit(cache=True)
def projected(frames, field):
    """Multiply the vector of each particle by the matrix of that particle.

    Args:
        frames: Matrices, e.g. projections onto velocities that walls admit, shape (n, 3, 3).
        field: Vectors, shape (n, 3); not changed.

    Returns:
        Products, in the unit of the vectors, shape (n, 3).
    """
    result = np.empty_like(field)
    for i in range(field.shape[0]):
        x, y, z = field[i, 0], field[i, 1], field[i, 2]
        for c in range(3):
            result[i, c] = frames[i, c, 0] * x + frames[i, c, 1] * y + frames[i, c, 2] * z
    return result


@njit(cache=True)
def projected_blocks(starts, columns, blocks, frames):
    """Multiply the blocks of a sparse matrix by symmetric matrices of their row and column: F_i A_ij F_j.

    Args:
        starts: Start of each block row in ``columns`` and ``blocks``, shape (n + 1,).
        columns: Block column of each block, shape (k,).
        blocks: Blocks A_ij, e.g. of a stiffness matrix [N/m], shape (k, 3, 3); not changed.
        frames: Symmetric matrix F_i of each particle, shape (n, 3, 3).

    Returns:
        Blocks in the same order and unit, shape (k, 3, 3).
    """
    result, half = np.empty_like(blocks), np.empty((3, 3))
    for i in range(starts.shape[0] - 1):
        frame = frames[i]
        for k in range(starts[i], starts[i + 1]):
            block, other = blocks[k], frames[columns[k]]
            for c in range(3):
                for d in range(3):
                    half[c, d] = frame[c, 0] * block[0, d] + frame[c, 1] * block[1, d] + frame[c, 2] * block[2, d]
            for c in range(3):
                for d in range(3):
                    result[k, c, d] = half[c, 0] * other[0, d] + half[c, 1] * other[1, d] + half[c, 2] * other[2, d]
    return result


@njit(cache=True)
def rates_of_volume(rows, images, parts, field):
    """Return B v, the rates at which a velocity field v changes the nodal volumes, shape (n,) [m^3/s].

    Args:
        rows: Shape functions, a tuple: start of each particle's row, shape (n + 1,), particles and ghosts in the rows,
            shape (k,), and values and derivatives by x, y, z, shape (k, 4) [1, 1/m].
        images: Ghosts, mirror images at walls, a tuple: particle that each mirrors, shape (g,), and matrix that maps
            its vectors to the ghost, shape (g, 3, 3).
        parts: Tuple of two: nodal volumes, shape (n,) [m^3]; gradient of the enclosed volume minus the gradient of the
            sum of nodal volumes, shape (n, 3) [m^2].
        field: Velocity v of the particles, shape (n, 3) [m/s].
    """
    volumes, unbalanced = parts
    missed, total = 0.0, 0.0
    for i in range(volumes.shape[0]):
        total += volumes[i]
        for c in range(3):
            missed += unbalanced[i, c] * field[i, c]
    return volumes * (divergence(*rows, reflected(field, *images)) + missed / total)


@njit(cache=True)
def pressure_forces(rows, images, parts, pressure):
    """Return the forces B^T p of pressures p on the particles, shape (n, 3) [N]; B is the matrix of volume rates.

    B times a velocity field is the result of ``rates_of_volume``.

    Args:
        rows: Shape functions, a tuple: start of each particle's row, shape (n + 1,), particles and ghosts in the rows,
            shape (k,), and values and derivatives by x, y, z, shape (k, 4) [1, 1/m].
        images: Ghosts, mirror images at walls, a tuple: particle that each mirrors, shape (g,), and matrix that maps
            its vectors to the ghost, shape (g, 3, 3).
        parts: Tuple of two: nodal volumes, shape (n,) [m^3]; gradient of the enclosed volume minus the gradient of the
            sum of nodal volumes, shape (n, 3) [m^2].
        pressure: Pressures at the particles, shape (n,) [Pa].
    """
    volumes, unbalanced = parts
    forces = np.zeros((volumes.shape[0] + images[0].shape[0], 3))
    divergence_transposed(*rows, volumes * pressure, forces)
    return folded(forces, *images) + (volumes * pressure).sum() / volumes.sum() * unbalanced


@njit(cache=True)
def friction_operator(rows, images, resisted, field):
    """Apply m/dt + V + S to a velocity field and project the force onto admissible directions, shape (n, 3) [N].

    m are the particle masses and dt is the time step; V are the viscous and wall forces, S the smoothing of the
    velocity. No argument is changed.

    Args:
        rows: Shape functions N, a tuple: start of each particle's row, shape (n + 1,), particles and ghosts in the
            rows, shape (k,), and values and derivatives by x, y, z, shape (k, 4) [1, 1/m].
        images: Ghosts, mirror images at walls, a tuple: particle that each mirrors, shape (g,), and matrix that maps
            its vectors to the ghost, shape (g, 3, 3).
        resisted: Tuple of three: masses over the time step, shape (n,) [kg/s]; coefficients of v - N v [kg/s]
            (smoothing), of N v [kg/s] (wall drag) and of twice the strain rate [N m s], shape (n, 3); projections of
            the particles onto the velocities that walls admit, shape (n, 3, 3).
        field: Velocity, shape (n, 3) [m/s].
    """
    inertia, factors, admitted = resisted
    force = folded(resistance(*rows, reflected(field, *images), factors), *images)
    for i in range(field.shape[0]):
        for c in range(3):
            force[i, c] += inertia[i] * field[i, c]
    return projected(admitted, force)


@njit(cache=True)
def admitted_rates(rows, images, volumes, admitted):
    """Return the rates of nodal volumes by admissible velocities as sparse rows, one for each particle.

    They are the rows of the matrix B of ``rates_of_volume``, without its correction of nodal integration, in the form
    of ``VolumeRateRows``. A particle and its ghosts make one entry.

    Args:
        rows: Shape functions, a tuple: start of each particle's row, shape (n + 1,), particles and ghosts in the rows,
            shape (k,), and values and derivatives by x, y, z, shape (k, 4) [1, 1/m].
        images: Ghosts, mirror images at walls, a tuple: particle that each mirrors, shape (g,), and matrix that maps
            its vectors to the ghost, shape (g, 3, 3).
        volumes: Nodal volumes, shape (n,) [m^3].
        admitted: Projections onto the velocities that walls admit, shape (n, 3, 3).

    Returns:
        Start of each row, shape (n + 1,), particle of each entry, shape (e,), and entries, the rate of the row's volume
        by the velocity of that particle, shape (e, 3) [m^2].
    """
    (starts, columns, weights), (source, reflection) = rows, images
    count = starts.shape[0] - 1
    slot, ends = np.full(count, -1), np.zeros_like(starts)
    particle, entries, at = np.empty_like(columns), np.empty((columns.shape[0], 3)), 0
    for i in range(count):
        first = at
        for k in range(starts[i], starts[i + 1]):
            j, x, y, z = columns[k], weights[k, 1], weights[k, 2], weights[k, 3]
            if j >= count:
                r = reflection[j - count]
                j, x, y, z = (
                    source[j - count],
                    r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
                    r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
                    r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
                )
            if slot[j] < first:
                slot[j], particle[at] = at, j
                entries[at, 0] = entries[at, 1] = entries[at, 2] = 0.0
                at += 1
            p = admitted[j]
            for c in range(3):
                entries[slot[j], c] += volumes[i] * (p[c, 0] * x + p[c, 1] * y + p[c, 2] * z)
        ends[i + 1] = at
    return ends, particle[:at], entries[:at]


def admitted_stiffness(stiffness: sparse.bsr_matrix, admitted: Floats) -> sparse.bsr_matrix:
    """Project a stiffness matrix onto the velocities that walls admit; return the matrix, shape (3 s, 3 s) [N/m].

    Args:
        stiffness: Stiffness of s surface particles, ordered by particle in 3 x 3 blocks, shape (3 s, 3 s) [N/m]; not
            changed.
        admitted: Projection of each particle onto the velocities that walls admit, shape (n, 3, 3); the first s are
            used.
    """
    blocks = projected_blocks(stiffness.indptr, stiffness.indices, stiffness.data, admitted)
    return sparse.bsr_matrix((blocks, stiffness.indices, stiffness.indptr), shape=stiffness.shape)
