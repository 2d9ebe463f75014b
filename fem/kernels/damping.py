"""Numba kernels of Rayleigh damping: its force on all nodes, and the power of a force."""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE
from reflowshock.fem.kernels.motion import STRIP


@njit(cache=True, error_model="numpy")
def add_damping(velocity, mobility, acceleration, coefficients, forces):
    """Add -c m (v + dt/2 (f / m + g)) to damping, and damping to the force f, with what it holds on entry.

    The loop runs over strips of all components together, as that of ``motion.advance``; for the same reason no
    operation may be reordered or fused.

    Args:
        velocity: ``(n, 3)`` [m/s], v half a step back.
        mobility: ``(n, 3)`` inverse mass [1/kg], zero where nothing follows from forces: there is no drag.
        acceleration: ``(3,)`` [m/s^2], g of the body force.
        coefficients: c [1/s] and dt/2 [s].
        forces: ``(n, 3)`` [N] twice: damping, on entry by the stiffness alone, and f without damping.
    """
    own, total = forces[0].reshape(-1), forces[1].reshape(-1)
    moving, inverse = velocity.reshape(-1), mobility.reshape(-1)
    rate, half = coefficients
    fall = np.empty(STRIP)
    for i in range(STRIP):
        fall[i] = acceleration[i % 3]
    for begin in range(0, len(moving), STRIP):
        end = min(begin + STRIP, len(moving))
        before, factor = moving[begin:end], inverse[begin:end]
        damping, force = own[begin:end], total[begin:end]
        for i in range(end - begin):
            others = force[i] + damping[i]
            middle = before[i] + half * (others * factor[i] + fall[i])
            drag = -rate * (1.0 / (factor[i] if factor[i] > 0.0 else np.inf)) * middle
            damping[i] += drag
            force[i] = others + drag


@njit(cache=True, fastmath=FINITE)
def power(runs, force, velocity):
    """Return the power [W] of a force ``(n, 3)`` [N] at a velocity ``(n, 3)`` [m/s] of the nodes that count.

    Args:
        runs: ``(k, 2)`` first node of each run of nodes that count, and the one behind its last.
        force: ``(n, 3)`` [N].
        velocity: ``(n, 3)`` [m/s].
    """
    total = 0.0
    for k in range(len(runs)):
        first, end = runs[k]
        acting, moving = force[first:end].reshape(-1), velocity[first:end].reshape(-1)
        for i in range(len(acting)):
            total += acting[i] * moving[i]
    return total
