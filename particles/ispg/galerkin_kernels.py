"""Sums over the rows of shape functions: values, derivatives, forces and power; kernels of the Galerkin space.

Columns are particles, followed by their ghosts. A row (``shape_function_rows.py``) stores the weights (psi, psi,x psi,y
psi,z) of each pair side by side, so that sums over a row, or over a column for transposes, visit each pair once. The
order of summation does not depend on the number of threads.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def values(starts, columns, weights, field):
    """Return the smoothed values N f of a field f at the particles, shape (n, d).

    Args:
        starts: Start of each particle's row of shape functions N, shape (n + 1,).
        columns: Particles and ghosts (mirror images, numbered from n) in the rows, shape (k,).
        weights: Shape functions and their derivatives by x, y, z, shape (k, 4) [1, 1/m]; the first column is used.
        field: Field with d components on the particles, then on the ghosts, shape (n + g, d).
    """
    result = np.zeros((starts.shape[0] - 1, field.shape[1]))
    for i in range(result.shape[0]):
        for k in range(starts[i], starts[i + 1]):
            for d in range(field.shape[1]):
                result[i, d] += weights[k, 0] * field[columns[k], d]
    return result


@njit(cache=True)
def spread(starts, columns, weights, parts, source):
    """Distribute a scalar of each particle to the particles in its row by shape functions: N^T parts, shape (n,).

    The share of a ghost (mirror image of a particle) goes to its particle, so that the sum is kept.

    Args:
        starts: Start of each particle's row of shape functions N, shape (n + 1,).
        columns: Particles and ghosts (numbered from n) in the rows, shape (k,).
        weights: Shape functions and their derivatives by x, y, z, shape (k, 4) [1, 1/m]; the first column is used.
        parts: Scalar of each particle, e.g. its volume, shape (n,); not changed.
        source: Particle that each ghost mirrors, shape (g,).
    """
    count = starts.shape[0] - 1
    result = np.zeros(count)
    for i in range(count):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            result[source[j - count] if j >= count else j] += weights[k, 0] * parts[i]
    return result


@njit(cache=True, fastmath={"contract"})
def lost_power(rows, fields, factors, walls):
    """Return the power in one velocity field of the forces that resist another one.

    Args:
        rows: Shape functions N, a tuple: start of each row, shape (n + 1,), particles and ghosts in the rows, shape
            (k,), and values and derivatives by x, y, z, shape (k, 4) [1, 1/m].
        fields: Velocity that causes the forces and velocity in which they act, a tuple; both on particles, then ghosts,
            shape (n + g, 3) [m/s].
        factors: Coefficients of each particle, shape (n, 3): of v - N v [kg/s] (smoothing), of N v [kg/s] (wall drag)
            and of twice the strain rate [N m s] (viscosity times volume).
        walls: Wall velocities at the particles, shape (n, 3) [m/s].

    Returns:
        Power of smoothing, of wall drag and of viscosity, three scalars [W].
    """
    (starts, columns, weights), (first, second) = rows, fields
    smoothing = sliding = viscous = 0.0
    a, b = np.empty((4, 3)), np.empty((4, 3))
    for i in range(starts.shape[0] - 1):
        a[:], b[:] = 0.0, 0.0
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            for c in range(4):
                for d in range(3):
                    a[c, d] += weights[k, c] * first[j, d]
                    b[c, d] += weights[k, c] * second[j, d]
        for d in range(3):
            smoothing += factors[i, 0] * (first[i, d] - a[0, d]) * (second[i, d] - b[0, d])
            sliding += factors[i, 1] * (a[0, d] - walls[i, d]) * (b[0, d] - walls[i, d])
            for c in range(3):
                viscous += factors[i, 2] * (a[1 + c, d] + a[1 + d, c]) * b[1 + c, d]
    return smoothing, sliding, viscous


@njit(cache=True)
def velocity_gradient(starts, columns, weights, field):
    """Return the velocity gradient at the particles, shape (n, 3, 3) [1/s]: entry (c, d) is dv_c / dx_d.

    Args:
        starts: Start of each particle's row of shape functions, shape (n + 1,).
        columns: Particles and ghosts (mirror images, numbered from n) in the rows, shape (k,).
        weights: Shape functions and their derivatives by x, y, z, shape (k, 4) [1, 1/m].
        field: Velocity on particles, then on ghosts, shape (n + g, 3) [m/s].
    """
    count = starts.shape[0] - 1
    gradient = np.empty((count, 3, 3))
    for i in range(count):
        g00 = g01 = g02 = g10 = g11 = g12 = g20 = g21 = g22 = 0.0
        for k in range(starts[i], starts[i + 1]):
            j, w = columns[k], weights[k]
            wx, wy, wz = w[1], w[2], w[3]
            x, y, z = field[j, 0], field[j, 1], field[j, 2]
            g00 += wx * x
            g01 += wy * x
            g02 += wz * x
            g10 += wx * y
            g11 += wy * y
            g12 += wz * y
            g20 += wx * z
            g21 += wy * z
            g22 += wz * z
        gradient[i, 0, 0], gradient[i, 0, 1], gradient[i, 0, 2] = g00, g01, g02
        gradient[i, 1, 0], gradient[i, 1, 1], gradient[i, 1, 2] = g10, g11, g12
        gradient[i, 2, 0], gradient[i, 2, 1], gradient[i, 2, 2] = g20, g21, g22
    return gradient


@njit(cache=True, fastmath={"contract"})
def resistance(starts, columns, weights, field, factors):
    """Return the forces of smoothing, wall drag and viscosity that resist a velocity field, in one pass over the rows.

    Args:
        starts: Start of each particle's row of shape functions N, shape (n + 1,).
        columns: Particles and ghosts (mirror images, numbered from n) in the rows, shape (k,).
        weights: Shape functions and their derivatives by x, y, z, shape (k, 4) [1, 1/m].
        field: Velocities v on particles, then on ghosts, shape (n + g, 3) [m/s].
        factors: Coefficients of each particle, shape (n, 3): of v - N v [kg/s] (smoothing), of N v [kg/s] (wall drag)
            and of twice the strain rate [N m s] (viscosity times volume).

    Returns:
        Forces, positive along v (the liquid feels their negatives), on particles and ghosts, shape (n + g, 3) [N].
    """
    result = np.zeros(field.shape)
    for i in range(starts.shape[0] - 1):
        x0 = x1 = x2 = x3 = y0 = y1 = y2 = y3 = z0 = z1 = z2 = z3 = 0.0
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            w0, w1, w2, w3 = weights[k, 0], weights[k, 1], weights[k, 2], weights[k, 3]
            x, y, z = field[j, 0], field[j, 1], field[j, 2]
            x0, x1, x2, x3 = x0 + w0 * x, x1 + w1 * x, x2 + w2 * x, x3 + w3 * x
            y0, y1, y2, y3 = y0 + w0 * y, y1 + w1 * y, y2 + w2 * y, y3 + w3 * y
            z0, z1, z2, z3 = z0 + w0 * z, z1 + w1 * z, z2 + w2 * z, z3 + w3 * z
        smoothing, drag, viscous = factors[i, 0], factors[i, 1], factors[i, 2]
        fx, fy, fz = smoothing * (field[i, 0] - x0), smoothing * (field[i, 1] - y0), smoothing * (field[i, 2] - z0)
        result[i, 0] += fx
        result[i, 1] += fy
        result[i, 2] += fz
        # Distribute the force on N v and the stresses over the columns by the weights of psi and its derivatives.
        x0, y0, z0 = drag * x0 - fx, drag * y0 - fy, drag * z0 - fz
        xy, xz, yz = viscous * (x2 + y1), viscous * (x3 + z1), viscous * (y3 + z2)
        xx, yy, zz = 2.0 * viscous * x1, 2.0 * viscous * y2, 2.0 * viscous * z3
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            w0, w1, w2, w3 = weights[k, 0], weights[k, 1], weights[k, 2], weights[k, 3]
            result[j, 0] += w0 * x0 + w1 * xx + w2 * xy + w3 * xz
            result[j, 1] += w0 * y0 + w1 * xy + w2 * yy + w3 * yz
            result[j, 2] += w0 * z0 + w1 * xz + w2 * yz + w3 * zz
    return result


@njit(cache=True)
def divergence(starts, columns, weights, field):
    """Return the divergence of a velocity field at the particles, shape (n,) [1/s].

    Args:
        starts: Start of each particle's row of shape functions, shape (n + 1,).
        columns: Particles and ghosts (mirror images, numbered from n) in the rows, shape (k,).
        weights: Shape functions and their derivatives by x, y, z, shape (k, 4) [1, 1/m].
        field: Velocity on particles, then on ghosts, shape (n + g, 3) [m/s].
    """
    count = starts.shape[0] - 1
    result = np.empty(count)
    for i in range(count):
        total = 0.0
        for k in range(starts[i], starts[i + 1]):
            j, w = columns[k], weights[k]
            total += w[1] * field[j, 0] + w[2] * field[j, 1] + w[3] * field[j, 2]
        result[i] = total
    return result


@njit(cache=True)
def divergence_transposed(starts, columns, weights, factor, result):
    """Add the transpose of ``divergence``, applied to a scalar of each particle, to forces.

    Args:
        starts: Start of each particle's row of shape functions, shape (n + 1,).
        columns: Particles and ghosts (mirror images, numbered from n) in the rows, shape (k,).
        weights: Shape functions and their derivatives by x, y, z, shape (k, 4) [1, 1/m].
        factor: Scalar of each particle, pressure times volume, shape (n,) [N m].
        result: Forces on particles, then on ghosts, shape (n + g, 3) [N]; changed in place.
    """
    for i in range(starts.shape[0] - 1):
        f = factor[i]
        if f != 0.0:
            for k in range(starts[i], starts[i + 1]):
                j, w = columns[k], weights[k]
                result[j, 0] += f * w[1]
                result[j, 1] += f * w[2]
                result[j, 2] += f * w[3]


@njit(cache=True)
def reflected(field, source, reflection):
    """Return vectors of n particles, followed by their mirror images at g ghosts, shape (n + g, 3).

    Args:
        field: Vectors of the particles, e.g. velocities, shape (n, 3); not changed.
        source: Particle that each ghost mirrors, shape (g,).
        reflection: Matrices that map the vector of the source to the ghost, shape (g, 3, 3).
    """
    count = field.shape[0]
    result = np.empty((count + source.shape[0], 3))
    for i in range(count):
        for c in range(3):
            result[i, c] = field[i, c]
    for g in range(source.shape[0]):
        for c in range(3):
            total = 0.0
            for d in range(3):
                total += reflection[g, c, d] * field[source[g], d]
            result[count + g, c] = total
    return result


@njit(cache=True)
def folded(forces, source, reflection):
    """Return the forces on n particles, with the forces on their g ghosts added; the transpose of ``reflected``.

    Args:
        forces: Forces on particles, then on ghosts, shape (n + g, 3) [N]; not changed.
        source: Particle that each ghost mirrors, shape (g,).
        reflection: Matrices that map a vector of the source to the ghost, shape (g, 3, 3); their transposes are
            applied.

    Returns:
        Forces, shape (n, 3) [N].
    """
    count = forces.shape[0] - source.shape[0]
    result = forces[:count].copy()
    for g in range(source.shape[0]):
        for d in range(3):
            for c in range(3):
                result[source[g], d] += reflection[g, c, d] * forces[count + g, c]
    return result
