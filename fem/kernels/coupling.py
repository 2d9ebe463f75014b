"""Numba kernel of a velocity constraint at the interface: forces that make two models move alike."""

from numba import njit


@njit(cache=True)
def link_velocities(rows, velocity, force, terms, link):
    """Find the forces at the interface that give it a wanted velocity at the motion's time, and add them to its forces.

    v(t) = v(t - dt/2) + dt/2 (f + link) / m must be the target less what the link takes from the other model.

    Args:
        rows: ``(k,)`` nodes of the interface.
        velocity: ``(n, 3)`` [m/s] half a step back.
        force: ``(n, 3)`` [N].
        terms: ``(4, k, 3)``: dt/2 / m [s/kg]; velocity by which both models part under a unit link [s/kg], infinite
            where there is none; target [m/s]; weight of the link's work [s].
        link: ``(n, 3)`` [N], of the step before on entry.

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
