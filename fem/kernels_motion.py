"""Numba kernels of a substep apart from the internal force: update, tie, packing of messages."""

from numba import njit

from fem.kernels_hexahedron import FINITE


@njit(cache=True, fastmath=FINITE)
def advance(state, masses, acceleration, step):
    """Take one step of central differences: v += dt (f / m + g), u += dt v, at free degrees of freedom.

    Args:
        state: ``(3, n, 3)``: displacement [m], velocity half a step back [m/s], force [N].
        masses: ``(n, 4)``: inverse mass per direction [1/kg], zero where the velocity is prescribed; mass that counts
            in the energy ledger of this rank [kg].
        acceleration: ``(3,)`` [m/s^2], of the body force.
        step: dt [s].

    Returns:
        Momentum of the ledger's mass at the new velocity, 3 floats [kg m/s].
    """
    displacement, velocity, force = state[0], state[1], state[2]
    gx, gy, gz = acceleration[0], acceleration[1], acceleration[2]
    px = py = pz = 0.0
    for i in range(len(masses)):
        ix, iy, iz, mass = masses[i, 0], masses[i, 1], masses[i, 2], masses[i, 3]
        vx = velocity[i, 0] + step * (force[i, 0] * ix + (gx if ix > 0.0 else 0.0))
        vy = velocity[i, 1] + step * (force[i, 1] * iy + (gy if iy > 0.0 else 0.0))
        vz = velocity[i, 2] + step * (force[i, 2] * iz + (gz if iz > 0.0 else 0.0))
        velocity[i, 0], velocity[i, 1], velocity[i, 2] = vx, vy, vz
        displacement[i, 0] += step * vx
        displacement[i, 1] += step * vy
        displacement[i, 2] += step * vz
        px += mass * vx
        py += mass * vy
        pz += mass * vz
    return px, py, pz


@njit(cache=True)
def spread_to_slaves(slave, master, weight, values):
    """Overwrite the slaves' rows with the weighted sum of their masters' rows."""
    for i in range(len(slave)):
        for c in range(3):
            total = 0.0
            for k in range(4):
                total += weight[i, k] * values[master[i, k], c]
            values[slave[i], c] = total


@njit(cache=True)
def gather_from_slaves(slave, master, weight, values):
    """Add the slaves' rows to their masters' rows by the transposed weights, then zero them."""
    for i in range(len(slave)):
        row = slave[i]
        for c in range(3):
            for k in range(4):
                values[master[i, k], c] += weight[i, k] * values[row, c]
            values[row, c] = 0.0


@njit(cache=True)
def pack(values, rows, buffer):
    """Copy rows of ``values (n, 3)`` into a message ``(m, 3)``."""
    for i in range(len(rows)):
        for c in range(3):
            buffer[i, c] = values[rows[i], c]


@njit(cache=True)
def unpack(buffer, rows, values):
    """Copy a message ``(m, 3)`` into rows of ``values (n, 3)``."""
    for i in range(len(rows)):
        for c in range(3):
            values[rows[i], c] = buffer[i, c]


@njit(cache=True)
def sum_in_rank_order(rows, pointer, source, buffer, values):
    """Replace each shared row by the sum over all its holders, in the order of their ranks.

    The order makes the sums, and with them all copies of a node, equal to the last bit on all ranks.

    Args:
        rows: ``(m,)`` shared nodes.
        pointer: ``(m + 1,)`` first entry of each row in ``source``.
        source: Row of ``buffer`` to add, -1 for this rank's own part.
        buffer: ``(k, 3)`` received parts.
        values: ``(n, 3)``.
    """
    for i in range(len(rows)):
        row = rows[i]
        for c in range(3):
            total = 0.0
            for k in range(pointer[i], pointer[i + 1]):
                total += values[row, c] if source[k] < 0 else buffer[source[k], c]
            values[row, c] = total


@njit(cache=True)
def add_impulse(rows, force, scale, impulse):
    """Add scale times the force at some nodes to an impulse ``(len(rows), 3)``."""
    for i in range(len(rows)):
        for c in range(3):
            impulse[i, c] += scale * force[rows[i], c]
