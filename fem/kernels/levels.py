"""Numba kernels of substeps inside a step; see ``fem.model.step_levels``.

A level has its state in ``(3, n, 3)``: displacement [m], force [N], weighted sum of forces [N].
"""

from numba import njit

from reflowshock.fem.kernels.force import add_block_force


@njit(cache=True)
def begin_substeps(rows, values, state):
    """Take the displacements of a level from rows of ``values``; force and sum are zero between calls."""
    place = state[0]
    for i in range(len(rows)):
        row = rows[i]
        place[i, 0], place[i, 1], place[i, 2] = values[row, 0], values[row, 1], values[row, 2]


@njit(cache=True)  # rounds alike wherever a node stands, see kernels.motion.advance
def take_substep(coefficients, inverse, change, state):
    """Add the weighted force to the sum and zero it; move the free nodes, the first ones.

    Args:
        coefficients: memory, rate, weight, see ``levels.chebyshev.Substeps``.
        inverse: ``(nf, 3)`` DT^2 / m [s^2/kg], zero where a component is held.
        change: ``(nf, 3)`` [m], of the displacement in the substep before, then in this one.
        state: See above.
    """
    memory, rate, weight = coefficients
    factor, step = inverse.reshape(-1), change.reshape(-1)
    displacement, force, total = state[0].reshape(-1), state[1].reshape(-1), state[2].reshape(-1)
    for i in range(len(factor)):
        total[i] += weight * force[i]
    for i in range(len(factor)):
        new = memory * step[i] + rate * factor[i] * force[i]
        step[i] = new
        displacement[i] += new
        force[i] = 0.0
    for i in range(len(factor), len(force)):
        total[i] += weight * force[i]
        force[i] = 0.0


@njit(cache=True)
def end_substeps(rows, foreign, state, values):
    """Add the sum of a level's forces to rows of ``values``, and zero it.

    Args:
        rows: ``(n,)`` of ``values``.
        foreign: Free nodes whose sum another rank adds.
        state: See above.
        values: ``(>= n, 3)`` [N].
    """
    total = state[2]
    for i in range(len(foreign)):
        total[foreign[i]] = 0.0
    for i in range(len(rows)):
        row = rows[i]
        x, y, z = total[i, 0], total[i, 1], total[i, 2]
        values[row, 0] += x
        values[row, 1] += y
        values[row, 2] += z
        total[i, 0] = total[i, 1] = total[i, 2] = 0.0


@njit(cache=True)
def run_levels(levels, first, values, force):
    """Take all substeps of a level, and in each of them those of the levels inside it: add their mean force.

    One call where each level has one assembled matrix and no node of another rank. The operations are those of the
    kernels above, in the same order.

    Args:
        levels: Of each level, outermost first: rows, foreign, ``(p, 3)`` coefficients, inverse, change, state, see
            above; pointer, columns and blocks of ``kernels.force.add_block_force``.
        first: Which of them.
        values: ``(>= n, 3)`` [m], displacements of the level around.
        force: ``(>= n, 3)`` [N], forces there.
    """
    rows, foreign, coefficients, inverse, change, state, pointer, columns, blocks = levels[first]
    begin_substeps(rows, values, state)
    for k in range(len(coefficients)):
        add_block_force(pointer, columns, blocks, state[0], state[1])
        if first + 1 < len(levels):
            run_levels(levels, first + 1, state[0], state[1])
        take_substep((coefficients[k, 0], coefficients[k, 1], coefficients[k, 2]), inverse, change, state)
    end_substeps(rows, foreign, state, force)
