"""Numba kernels of substeps inside a step; see ``fem.levels.force``.

A level has its state in ``(3, n, 3)``: displacement [m], force [N], weighted sum of forces [N]; and its tie as a tuple
of slaves, masters and weights.
"""

from numba import njit

from fem.kernels.hexahedron import FINITE
from fem.kernels.motion import gather_from_slaves, spread_to_slaves


@njit(cache=True)
def begin_substeps(rows, values, state):
    """Take the displacements of a level from rows of ``values``; force and sum are zero."""
    state[1:] = 0.0
    for i in range(len(rows)):
        for c in range(3):
            state[0, i, c] = values[rows[i], c]


@njit(cache=True)
def end_substeps(rows, state, values):
    """Add the sum of a level's forces to rows of ``values``."""
    for i in range(len(rows)):
        for c in range(3):
            values[rows[i], c] += state[2, i, c]


@njit(cache=True, fastmath=FINITE)
def add_weighted(weight, force, total):
    """Add ``weight`` times a force ``(n, 3)`` to a sum."""
    part, whole = force.reshape(-1), total.reshape(-1)
    for i in range(len(part)):
        whole[i] += weight * part[i]


@njit(cache=True)
def collect_force(weight, tie, state):
    """Add the weighted force to the sum as it is, then move the slaves' part of it to their masters."""
    add_weighted(weight, state[1], state[2])
    gather_from_slaves(tie[0], tie[1], tie[2], state[1])


@njit(cache=True, fastmath=FINITE)
def move_free(coefficients, inverse, change, state):
    """Change the displacement of the free nodes, the first ones, by d = memory d + rate DT^2 f / m.

    Args:
        coefficients: memory and rate, see ``levels.chebyshev.Substeps``.
        inverse: ``(nf, 3)`` DT^2 / m [s^2/kg], zero where a component is held.
        change: ``(nf, 3)`` [m], d.
        state: See above.
    """
    memory, rate = coefficients
    factor, step = inverse.reshape(-1), change.reshape(-1)
    displacement, force = state[0].reshape(-1), state[1].reshape(-1)
    for i in range(len(factor)):
        new = memory * step[i] + rate * factor[i] * force[i]
        step[i] = new
        displacement[i] += new


@njit(cache=True)
def take_substep(coefficients, tie, inverse, change, state):
    """Move the free nodes, and the slaves with them; the force is then zero. Arguments as ``move_free``."""
    move_free(coefficients, inverse, change, state)
    spread_to_slaves(tie[0], tie[1], tie[2], state[0])
    state[1] = 0.0
