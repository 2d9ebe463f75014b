"""Loops of a step's equations: operators that touch each pair once, and the rows of the pressure equation.

Arguments that several take: rows of the shape functions (starts, columns, weights), images (source, reflection), both
as in `galerkin_kernels`.
"""

import numpy as np
from numba import njit

from reflowshock.particles.ispg.galerkin_kernels import (
    divergence,
    divergence_transposed,
    folded,
    reflected,
    resistance,
)


@njit(cache=True)
def projected(frames, field):
    """Vectors `(n, 3)` times a matrix of each particle `(n, 3, 3)`."""
    result = np.empty_like(field)
    for i in range(field.shape[0]):
        x, y, z = field[i, 0], field[i, 1], field[i, 2]
        for c in range(3):
            result[i, c] = frames[i, c, 0] * x + frames[i, c, 1] * y + frames[i, c, 2] * z
    return result


@njit(cache=True)
def projected_blocks(starts, columns, blocks, frames):
    """Blocks `(k, 3, 3)` of a matrix between a matrix of each row's and of each column's particle `(n, 3, 3)`."""
    result, half = np.empty_like(blocks), np.empty((3, 3))
    for i in range(starts.shape[0] - 1):
        own = frames[i]
        for k in range(starts[i], starts[i + 1]):
            block, other = blocks[k], frames[columns[k]]
            for c in range(3):
                for d in range(3):
                    half[c, d] = own[c, 0] * block[0, d] + own[c, 1] * block[1, d] + own[c, 2] * block[2, d]
            for c in range(3):
                for d in range(3):
                    result[k, c, d] = half[c, 0] * other[0, d] + half[c, 1] * other[1, d] + half[c, 2] * other[2, d]
    return result


@njit(cache=True)
def rates_of_volume(rows, images, parts, field):
    """Rates of volume `(n,)` [m^3/s] of velocities `(n, 3)`, those of `parts`: volumes `(n,)`, unbalanced `(n, 3)`."""
    volumes, unbalanced = parts
    missed, total = 0.0, 0.0
    for i in range(volumes.shape[0]):
        total += volumes[i]
        for c in range(3):
            missed += unbalanced[i, c] * field[i, c]
    return volumes * (divergence(*rows, reflected(field, *images)) + missed / total)


@njit(cache=True)
def pressure_forces(rows, images, parts, pressure):
    """The transposed: forces `(n, 3)` [N] of pressures `(n,)`."""
    volumes, unbalanced = parts
    forces = np.zeros((volumes.shape[0] + images[0].shape[0], 3))
    divergence_transposed(*rows, volumes * pressure, forces)
    return folded(forces, *images) + (volumes * pressure).sum() / volumes.sum() * unbalanced


@njit(cache=True)
def friction_operator(rows, images, resisted, field):
    """Forces `(n, 3)` that walls admit of velocities `(n, 3)`: of inertia and friction.

    ``resisted``: masses over the time step `(n,)` [kg/s], factors of `resistance`, projections of the particles
    `(n, 3, 3)`.
    """
    inertia, factors, admitted = resisted
    force = folded(resistance(*rows, reflected(field, *images), factors), *images)
    for i in range(field.shape[0]):
        for c in range(3):
            force[i, c] += inertia[i] * field[i, c]
    return projected(admitted, force)


@njit(cache=True)
def admitted_rates(rows, images, volumes, admitted):
    """Rows of rates of volume by particle, as `VolumeRateRows`, of velocities that projections `(n, 3, 3)` admit.

    Without what is unbalanced. A particle and its images make one entry.
    """
    (starts, columns, weights), (source, reflection) = rows, images
    count = starts.shape[0] - 1
    place, ends = np.full(count, -1), np.zeros_like(starts)
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
            if place[j] < first:
                place[j], particle[at] = at, j
                entries[at, 0] = entries[at, 1] = entries[at, 2] = 0.0
                at += 1
            p = admitted[j]
            for c in range(3):
                entries[place[j], c] += volumes[i] * (p[c, 0] * x + p[c, 1] * y + p[c, 2] * z)
        ends[i + 1] = at
    return ends, particle[:at], entries[:at]
