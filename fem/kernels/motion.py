"""Numba kernels of a substep apart from the internal force: update, damping, tie, packing of messages."""

import numpy as np
from numba import njit

from reflowshock.fem.kernels.hexahedron import FINITE

STRIP = 192  # degrees of freedom: whole nodes and whole vectors


@njit(cache=True)
def advance(state, mobility, acceleration, step):
    """Take one step of central differences in place: v += dt (f / m + g), u += dt v, at free degrees of freedom.

    Args:
        state: Displacement u [m], velocity v half a step back [m/s] and nodal force f [N], shape (3, n, 3); u and v are
            updated.
        mobility: Inverse mass 1 / m, zero where the velocity is prescribed, shape (n, 3) [1/kg].
        acceleration: Acceleration g of the body force, shape (3,) [m/s^2].
        step: Time step dt, scalar [s].
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
        state: Displacement [m], velocity half a step back [m/s] and force [N], shape (3, n, 3); the first two are
            updated.
        mobility: Inverse mass, zero where the velocity is prescribed, shape (n, 3) [1/kg].
        nodes: Tuple of integers: first node of the range and the node after its last.
        kicks: Contributions of the body force: velocity in the first step, velocity in the others [m/s], and
            displacement by the latter [m], one row each with components x, y, z, shape (3, 3).
        steps: Tuple: time step dt, scalar [s], and number of steps, integer.
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
    """Compute what a body force adds to velocity and displacement in k steps that are taken at once.

    Args:
        accelerations: Body acceleration as each step begins, shape (k, 3) [m/s^2].
        step: Time step dt, scalar [s].
        kicks: Written: velocity in the first step, velocity in the others [m/s], and displacement by the latter [m],
            one row each with components x, y, z, shape (3, 3).
    """
    for c in range(3):
        gained = drift = 0.0
        for k in range(1, len(accelerations)):
            gained += step * accelerations[k, c]
            drift += step * gained
        kicks[0, c], kicks[1, c], kicks[2, c] = step * accelerations[0, c], gained, drift


@njit(cache=True, fastmath=FINITE)
def first_moment(mass, places):
    """Return the sum of masses times vectors as three scalars: first moment [kg m] or momentum [kg m/s].

    Args:
        mass: Nodal masses, shape (n,) [kg].
        places: Positions [m] or velocities [m/s], shape (n, 3).
    """
    x = y = z = 0.0
    for i in range(len(mass)):
        x += mass[i] * places[i, 0]
        y += mass[i] * places[i, 1]
        z += mass[i] * places[i, 2]
    return x, y, z


@njit(cache=True)
def work_of_changes(nodes, changes, accelerations, step):
    """Return the work of the varying part of a body force in k steps taken at once, scalar [J].

    Args:
        nodes: Tuple: nodal masses in the energy balance (n,) [kg], velocities after the steps (n, 3) [m/s], inverse
            masses, zero where the velocity is prescribed, (n, 3) [1/kg].
        changes: Mean of the varying part of the acceleration in each step, shape (k, 3) [m/s^2].
        accelerations: Whole body acceleration as each step begins, shape (k, 3) [m/s^2].
        step: Time step dt, scalar [s].
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
    """Overwrite the rows of slave nodes with the weighted sum of the rows of their masters.

    Args:
        slave: Slave nodes, shape (ns,).
        master: Four masters of each slave, shape (ns, 4).
        weight: Weights of the masters, shape (ns, 4).
        values: Nodal vectors, such as displacements or velocities, shape (n, 3); the rows of slaves are overwritten.
    """
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
    """Add the rows of slave nodes to the rows of their masters by the weights, then zero the slaves' rows.

    Args:
        slave: Slave nodes, shape (ns,).
        master: Four masters of each slave, shape (ns, 4).
        weight: Weights of the masters, shape (ns, 4).
        values: Nodal vectors, such as forces, shape (n, 3); rows of slaves and masters change.
    """
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
    """Copy the rows ``rows (m,)`` of nodal values ``values (n, 3)``, any unit, into a message ``buffer (m, 3)``."""
    for i in range(len(rows)):
        for c in range(3):
            buffer[i, c] = values[rows[i], c]


@njit(cache=True)
def unpack(buffer, rows, values):
    """Copy a message ``buffer (m, 3)``, any unit, into the rows ``rows (m,)`` of nodal values ``values (n, 3)``."""
    for i in range(len(rows)):
        for c in range(3):
            values[rows[i], c] = buffer[i, c]


@njit(cache=True)
def sum_in_rank_order(rows, pointer, source, buffer, values):
    """Replace each shared row by the sum over all ranks that have it, in the order of the ranks; not collective.

    The order makes the sums, and with them all copies of a node, equal to the last bit on all ranks.

    Args:
        rows: Local numbers of shared nodes, shape (m,).
        pointer: First entry of each shared node in ``source``, and the number of entries, shape (m + 1,).
        source: Row of ``buffer`` to add, -1 for this rank's part in ``values``, shape (entries,).
        buffer: Parts received from other ranks, shape (k, 3).
        values: Nodal vectors of this rank, shape (n, 3); the rows of shared nodes are replaced.
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
    """Add a scalar times the force at some nodes to their impulses.

    Args:
        rows: Nodes, shape (k,); nodes with numbers of at least ``len(force)`` are skipped.
        force: Force of the leading nodes, shape (n, 3) [N].
        scale: Weight of the force, a scalar: [s] for an impulse, [s^2] for its first moment in time.
        impulse: Impulse [N s], or first moment [N s^2], of each node in ``rows``, shape (k, 3), added to.
    """
    for i in range(len(rows)):
        if rows[i] < len(force):
            for c in range(3):
                impulse[i, c] += scale * force[rows[i], c]


@njit(cache=True)
def add_ahead(ahead, force):
    """Add ``ahead``, the force stored for the following steps, to the force, and zero it.

    Args:
        ahead: Stored force, shape (n, 3) [N], zeroed; or (0, 3) if no force acts at intervals, which leaves all as it
            is.
        force: Nodal force of this step, shape (n, 3) [N], added to.
    """
    total, rest = force.reshape(-1), ahead.reshape(-1)  # flat: loops that fill vectors
    for i in range(len(rest)):
        total[i] += rest[i]
        rest[i] = 0.0


@njit(cache=True)
def add_pushed(pushed, every, force, ahead):
    """Distribute a force that acts once in several steps over these steps, and zero it.

    Args:
        pushed: Force for one step, shape (n, 3) [N], zeroed.
        every: Number of steps for which it acts, integer.
        force: Force of this step, shape (>= n, 3) [N]; receives one share, or all ``every`` shares if ``ahead`` is
            empty.
        ahead: Force for the following steps, shape (>= n, 3) [N], receives ``every - 1`` shares; or empty, shape (0,
            3).
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
    """Add the rows ``rows (k,)`` of ``values (n, 3)`` to the same rows of ``total (n, 3)``; each row at most once."""
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
        terms: Rows: half time step over mass, dt/2 / m [s/kg]; relative velocity of both models under a unit link
            [s/kg], infinite where no link acts; target velocity [m/s]; weight of the work of the link [s]. Shape (4, k,
            3).
        link: Link forces at all nodes, of the previous step on entry, of this step on return, shape (n, 3) [N].

    Returns:
        Work of the link over the step, by the mean of both ends, scalar [J].
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

    The loop runs over strips of all components together; reordered or fused operations would let copies of a node on
    several ranks drift apart.

    Args:
        velocity: Velocity v half a step back, shape (n, 3) [m/s].
        mobility: Inverse mass, zero where the velocity is prescribed and no drag acts, shape (n, 3) [1/kg].
        frame: Acceleration g of the body force [m/s^2], and velocity v0 of the frame in which the drag is zero [m/s],
            shape (2, 3).
        coefficients: Damping coefficient c [1/s] and half time step dt/2 [s], a tuple of two scalars.
        forces: Damping (stiffness-proportional on entry, total on return) and nodal force f (without damping on entry,
            with it on return), two arrays of shape (n, 3) [N].
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

    A window is several steps in which the drag d = -c m (v - v0 + dt/2 ((f + ahead) / m + g)) acts once.

    Args:
        velocity: Velocity v half a step back, shape (n, 3) [m/s].
        forces: Tuple of two arrays (n, 3) [N], both added to: f, and the force ahead, which acts in addition in the
            coming step.
        nodes: Tuple: inverse mass (n, 3) [1/kg], zero without drag; and whether the work on a node counts, (n,).
        frame: Acceleration g of the body force [m/s^2] and velocity v0 of the frame in which the drag is zero [m/s],
            (2, 3).
        coefficients: Tuple of scalars: c [1/s], dt [s], and number of shares, the steps of a window.

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
    """Return the power [W], a scalar, of nodal forces at nodal velocities, summed over ranges of nodes.

    Args:
        runs: First node of each range, and the node after its last, shape (k, 2).
        force: Nodal force, shape (n, 3) [N].
        velocity: Nodal velocity, shape (n, 3) [m/s].
    """
    total = 0.0
    for k in range(len(runs)):
        first, end = runs[k]
        acting, moving = force[first:end].reshape(-1), velocity[first:end].reshape(-1)
        for i in range(len(acting)):
            total += acting[i] * moving[i]
    return total
