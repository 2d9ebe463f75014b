"""Loops of a step's equations: operators that touch each pair once, and the matrix of the pressure equation.

Arguments that several take: rows of the shape functions (starts, columns, weights), images (source, reflection), both
as in `galerkin_kernels`.
"""

import numpy as np
from numba import njit, prange

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


@njit(cache=True, parallel=True)
def _divergences(rows, images, roots):
    """Entries of the divergence by row: particle of each, its weights times a root `(k, 3)`, over the row's length.

    The lengths, too, `(n,)`.
    """
    (starts, columns, weights), (source, reflection) = rows, images
    count = starts.shape[0] - 1
    particle, entries = np.empty(columns.shape[0], np.int32), np.empty((columns.shape[0], 3), np.float32)
    lengths, pieces = np.zeros(count), np.empty((columns.shape[0], 3))
    for i in prange(count):
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
            particle[k] = j
            for c in range(3):
                pieces[k, c] = roots[j, c, 0] * x + roots[j, c, 1] * y + roots[j, c, 2] * z
                lengths[i] += pieces[k, c] * pieces[k, c]
        lengths[i] = np.sqrt(lengths[i])
        for k in range(starts[i], starts[i + 1]):
            for c in range(3):
                entries[k, c] = pieces[k, c] / lengths[i]
    return particle, entries, lengths


@njit(cache=True)
def _by_particle(starts, particle, entries, order):
    """Entries by the particle of their column, those of each in an order of the rows.

    Firsts `(n + 1,)`, ranks of the rows, entries; where what follows the row of each of the given ones begins, `(k,)`;
    how far apart the ranks of one particle are at most.
    """
    count = starts.shape[0] - 1
    firsts = np.zeros(count + 1, np.int64)
    for j in particle:
        firsts[j + 1] += 1
    firsts = np.cumsum(firsts)
    fill, rank, ends = firsts.copy(), np.empty(particle.shape[0], np.int32), np.empty(particle.shape[0], np.int64)
    result, width = np.empty_like(entries), 0
    for r in range(count):
        for k in range(starts[order[r]], starts[order[r] + 1]):
            j = particle[k]
            rank[fill[j]], ends[k] = r, fill[j]
            for c in range(3):
                result[fill[j], c] = entries[k, c]
            fill[j] += 1
    for k in range(particle.shape[0]):
        own, last = rank[ends[k]], firsts[particle[k] + 1]
        width = max(width, own - rank[firsts[particle[k]]])
        while ends[k] < last and rank[ends[k]] == own:  # a particle and its images
            ends[k] += 1
    return firsts, rank, result, ends, width


@njit(cache=True, parallel=True)
def pressure_matrix(rows, images, volumes, roots, order):
    """Band, in single precision, of the matrix A of rates of volume under pressures, particles in an order `(n,)`.

    Without what is unbalanced. ``roots``: of the mobilities of the particles, `(n, 3, 3)`. Returns S A S by rows from
    b places before the diagonal, which is about one, to it, `(n, b + 1)`; and S `(n,)`, by particle.
    """
    starts, count = rows[0], order.shape[0]
    particle, entries, lengths = _divergences(rows, images, roots)
    firsts, rank, others, ends, width = _by_particle(starts, particle, entries, order)
    band = np.zeros((count, width + 1), np.float32)
    for r in prange(count):
        line, shift = band[r], width - r
        for k in range(starts[order[r]], starts[order[r] + 1]):
            x, y, z = entries[k, 0], entries[k, 1], entries[k, 2]
            for a in range(firsts[particle[k]], ends[k]):
                line[rank[a] + shift] += x * others[a, 0] + y * others[a, 1] + z * others[a, 2]
    return band, 1.0 / (volumes * lengths)
