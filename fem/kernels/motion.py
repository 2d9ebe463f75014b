"""Numba kernels of a substep apart from the internal force: update, damping, tie, packing of messages."""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE

STRIP = 192  # degrees of freedom: whole nodes and whole vectors


@njit(cache=True)
def advance(state, mobility, acceleration, step):
    """Take one step of central differences: v += dt (f / m + g), u += dt v, at free degrees of freedom.

    Args:
        state: ``(3, n, 3)``: displacement [m], velocity half a step back [m/s], force [N].
        mobility: ``(n, 3)`` inverse mass [1/kg], zero where the velocity is prescribed.
        acceleration: ``(3,)`` [m/s^2], of the body force.
        step: dt [s].
    """
    kicks = np.zeros((3, 3))
    for c in range(3):
        kicks[0, c] = step * acceleration[c]
    move(state, mobility, (np.int64(0), len(mobility)), kicks, (step, np.int64(1)))


@njit(cache=True)
def move(state, mobility, nodes, kicks, steps):
    """Take steps of some nodes at once: a nodal force acts in the first step, a body force in all of them.

    The loop runs over strips of all components together, which fill vectors; the contributions of the body force are
    read from separate strips. No operation may be reordered or fused: the remainder of a strip would then round
    differently from its vectors, and copies of a node on several ranks would drift apart.

    Args:
        state: As in ``advance``.
        mobility: As in ``advance``.
        nodes: First node and end of the range.
        kicks: Contributions of the body force: velocity in the first step, velocity in the others [m/s], and
            displacement by the latter [m], shape (3, 3).
        steps: Time step dt [s] and number of steps.
    """
    step, span = steps[0], steps[0] * steps[1]
    strips = np.empty((3, STRIP))
    for k in range(3):
        for i in range(0, STRIP, 3):
            strips[k, i], strips[k, i + 1], strips[k, i + 2] = kicks[k, 0], kicks[k, 1], kicks[k, 2]
    first, others, drift = strips[0], strips[1], strips[2]
    flat, inverse = state.reshape(3, -1), mobility.reshape(-1)
    for begin in range(3 * nodes[0], 3 * nodes[1], STRIP):
        end = min(begin + STRIP, 3 * nodes[1])
        u, v, f, factor = flat[0, begin:end], flat[1, begin:end], flat[2, begin:end], inverse[begin:end]
        for i in range(end - begin):
            free = factor[i] > 0.0
            new = v[i] + (step * factor[i] * f[i] + (first[i] if free else 0.0))
            v[i] = new + (others[i] if free else 0.0)
            u[i] += span * new + (drift[i] if free else 0.0)


@njit(cache=True)
def kicks_of(accelerations, step, kicks):
    """Write the ``kicks (3, 3)`` of ``move`` from the body accelerations ``(k, 3)`` [m/s^2] as each step begins."""
    for c in range(3):
        gained = drift = 0.0
        for k in range(1, len(accelerations)):
            gained += step * accelerations[k, c]
            drift += step * gained
        kicks[0, c], kicks[1, c], kicks[2, c] = step * accelerations[0, c], gained, drift


@njit(cache=True, fastmath=FINITE)
def first_moment(mass, places):
    """Return the sum of masses ``(n,)`` [kg] times positions [m] or velocities [m/s] ``(n, 3)``: three numbers."""
    x = y = z = 0.0
    for i in range(len(mass)):
        x += mass[i] * places[i, 0]
        y += mass[i] * places[i, 1]
        z += mass[i] * places[i, 2]
    return x, y, z


@njit(cache=True)
def work_of_changes(nodes, changes, accelerations, step):
    """Return the work [J] of a part of the body force in steps that ``move`` has taken at once.

    Args:
        nodes: Masses ``(n,)`` [kg] that count, velocities ``(n, 3)`` [m/s] at the end, mobility ``(n, 3)``.
        changes: ``(k, 3)`` [m/s^2] mean of this part in each step.
        accelerations: ``(k, 3)`` [m/s^2] of the whole as each step begins.
        step: dt [s].
    """
    if not np.any(changes):
        return 0.0
    mass, velocity, mobility = nodes
    momentum, work, count = first_moment(mass, velocity), 0.0, len(changes)
    for c in range(3):
        if not np.any(changes[:, c]):
            continue
        moved = 0.0
        for i in range(len(mass) if count > 1 else 0):
            moved += mass[i] if mobility[i, c] > 0.0 else 0.0
        present = momentum[c]
        for k in range(count - 1, -1, -1):
            work += step * changes[k, c] * present
            present -= step * accelerations[k, c] * moved
    return work


@njit(cache=True)
def spread_to_slaves(slave, master, weight, values):
    """Overwrite the slaves' rows with the weighted sum of their masters' rows."""
    for i in range(len(slave)):
        x = y = z = 0.0
        for k in range(4):
            node, share = np.uintp(master[i, k]), weight[i, k]
            x += share * values[node, 0]
            y += share * values[node, 1]
            z += share * values[node, 2]
        row = np.uintp(slave[i])
        values[row, 0], values[row, 1], values[row, 2] = x, y, z


@njit(cache=True)
def gather_from_slaves(slave, master, weight, values):
    """Add the slaves' rows to their masters' rows by the transposed weights, then zero them."""
    for i in range(len(slave)):
        row = np.uintp(slave[i])
        x, y, z = values[row, 0], values[row, 1], values[row, 2]
        for k in range(4):
            node, share = np.uintp(master[i, k]), weight[i, k]
            values[node, 0] += share * x
            values[node, 1] += share * y
            values[node, 2] += share * z
        values[row, 0] = values[row, 1] = values[row, 2] = 0.0


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
        x = y = z = 0.0
        for k in range(pointer[i], pointer[i + 1]):
            part = source[k]
            if part < 0:
                x, y, z = x + values[row, 0], y + values[row, 1], z + values[row, 2]
            else:
                x, y, z = x + buffer[part, 0], y + buffer[part, 1], z + buffer[part, 2]
        values[row, 0], values[row, 1], values[row, 2] = x, y, z


@njit(cache=True)
def add_impulse(rows, force, scale, impulse):
    """Add scale times the force at some nodes to an impulse ``(len(rows), 3)``; rows past the force are left out."""
    for i in range(len(rows)):
        if rows[i] < len(force):
            for c in range(3):
                impulse[i, c] += scale * force[rows[i], c]


@njit(cache=True)
def add_ahead(ahead, force):
    """Add ``ahead (n, 3)`` [N], the force stored for the following steps, to the force, and zero it."""
    total, rest = force.reshape(-1), ahead.reshape(-1)  # flat: loops that fill vectors
    for i in range(len(rest)):
        total[i] += rest[i]
        rest[i] = 0.0


@njit(cache=True)
def add_pushed(pushed, every, force, ahead):
    """Distribute a force ``pushed (n, 3)`` [N] that acts once in ``every`` steps, and zero it.

    One share is added to the force and the ``every - 1`` others to ``ahead``; all to the force if ``ahead`` is empty.
    """
    own, total, rest = pushed.reshape(-1), force.reshape(-1), ahead.reshape(-1)
    share = 1 if len(rest) else every
    for i in range(len(own)):
        total[i] += share * own[i]
    for i in range(len(own) if len(rest) else 0):
        rest[i] += (every - 1) * own[i]
    for i in range(len(own)):
        own[i] = 0.0


@njit(cache=True)
def add_rows(rows, values, total):
    """Add some rows of ``values (n, 3)`` to the same rows of ``total``; each row at most once."""
    for i in range(len(rows)):
        for c in range(3):
            total[rows[i], c] += values[rows[i], c]


@njit(cache=True)
def link_velocities(rows, velocity, force, terms, link):
    """Compute the link forces (Lagrange multipliers) that make interface velocities equal, and add them to the forces.

    v(t) = v(t - dt/2) + dt/2 (f + link) / m equals the target minus the change of the other model by the link.

    Args:
        rows: Nodes of the interface, shape (k,).
        velocity: Velocity half a step back, shape (n, 3) [m/s].
        force: Nodal force, shape (n, 3) [N], added to.
        terms: dt/2 / m [s/kg]; relative velocity of both models under a unit link [s/kg], infinite without a link;
            target velocity [m/s]; weight of the work of the link [s]; shape (4, k, 3).
        link: Link forces of the previous step on entry, of this step on return, shape (n, 3) [N].

    Returns:
        Work of the link over the step, by the mean of both ends [J].
    """
    work = 0.0
    for i in range(len(rows)):
        row = rows[i]
        for c in range(3):
            free = velocity[row, c] + terms[0, i, c] * force[row, c]
            found = (terms[2, i, c] - free) / terms[1, i, c]
            work += terms[3, i, c] * (link[row, c] + found) * velocity[row, c]
            link[row, c] = found
            force[row, c] += found
    return work


@njit(cache=True, error_model="numpy")
def add_damping(velocity, mobility, frame, coefficients, forces):
    """Add the mass-proportional force -c m (v - v0 + dt/2 (f / m + g)) to the damping, and all damping to the force f.

    The loop runs over strips of all components together, as in ``move``; for the same reason no operation may be
    reordered or fused.

    Args:
        velocity: ``(n, 3)`` [m/s], v half a step back.
        mobility: ``(n, 3)`` inverse mass [1/kg], zero where the velocity is prescribed, without drag.
        frame: ``(2, 3)``: g of the body force [m/s^2], and velocity v0 of the frame in which the drag is zero [m/s].
        coefficients: c [1/s] and dt/2 [s].
        forces: ``(n, 3)`` [N] twice: damping, on entry by the stiffness alone, and f without damping.
    """
    own, total = forces[0].reshape(-1), forces[1].reshape(-1)
    moving, inverse = velocity.reshape(-1), mobility.reshape(-1)
    rate, half = coefficients
    fall, base = np.empty(STRIP), np.empty(STRIP)
    for i in range(STRIP):
        fall[i], base[i] = frame[0, i % 3], frame[1, i % 3]
    for begin in range(0, len(moving), STRIP):
        end = min(begin + STRIP, len(moving))
        before, factor = moving[begin:end], inverse[begin:end]
        damping, force = own[begin:end], total[begin:end]
        for i in range(end - begin):
            others = force[i] + damping[i]
            middle = before[i] - base[i] + half * (others * factor[i] + fall[i])
            drag = -rate * (1.0 / (factor[i] if factor[i] > 0.0 else np.inf)) * middle
            damping[i] += drag
            force[i] = others + drag


@njit(cache=True, error_model="numpy")
def brake(velocity, forces, nodes, frame, coefficients):
    """Add the drag of a window to the force f, one share, and to the force ahead, all other shares.

    The drag d = -c m (v - v0 + dt/2 ((f + ahead) / m + g)) acts once in a window.

    Args:
        velocity: ``(n, 3)`` [m/s], v half a step back.
        forces: ``(n, 3)`` [N] twice: f, and the force ahead, which acts in addition in the coming step.
        nodes: ``(n, 3)`` inverse mass [1/kg], zero without drag; and ``(n,)`` whether the work on a node counts.
        frame: ``(2, 3)``: g of the body force [m/s^2], and velocity v0 of the frame in which the drag is zero [m/s].
        coefficients: c [1/s], dt [s], and number of shares, the steps of a window.

    Returns:
        Sums over the nodes that count: power of the drag in the frame before and after the step [W], and drag [N].
    """
    force, ahead, mobility, owned = forces[0], forces[1], nodes[0], nodes[1]
    rate, step, shares = coefficients
    before, after, total = 0.0, 0.0, np.zeros(3)
    for i in range(len(mobility)):
        for c in range(3):
            inverse = mobility[i, c]
            if inverse > 0.0:
                relative = velocity[i, c] - frame[1, c]
                kick = step * ((force[i, c] + ahead[i, c]) * inverse + frame[0, c])
                drag = -rate * (relative + 0.5 * kick) / inverse
                force[i, c] += drag
                ahead[i, c] += (shares - 1.0) * drag
                if owned[i]:
                    before += drag * relative
                    after += drag * (relative + kick + step * shares * drag * inverse)
                    total[c] += drag
    return before, after, total


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
