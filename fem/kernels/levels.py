"""Numba kernels that take all steps of a window, or all substeps of step levels inside a step, in one call.

Step levels are described in ``fem.model.step_levels``.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.experimental import structref
from numpy.typing import NDArray

from reflowshock.fem.kernels.box_rotation import add_turned_row_forces
from reflowshock.fem.kernels.box_rows import add_row_forces, read_lines, subtract_lines
from reflowshock.fem.kernels.force import add_block_force
from reflowshock.fem.kernels.motion import (
    add_ahead,
    add_impulse,
    add_pushed,
    first_moment,
    gather_from_slaves,
    kicks_of,
    move,
    spread_to_slaves,
    work_of_changes,
)
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.kernels.nonlinear_hexahedron import HexahedronBlocks, add_hexahedron_force
from reflowshock.fem.kernels.nonlinear_one_point import OnePointBlocks, add_one_point_force
from reflowshock.fem.kernels.turned_hexahedron import add_turned_forces
from reflowshock.fem.kernels.vectors.box import add_turned_block_forces

ALL_FINE = -1  # no element is turned inside out
PACES = 3  # number of different intervals, in steps, at which force terms may act
NAMES = ("congruent", "assembled", "turning_rows", "turning_boxes", "turning", "one_point", "hexahedron")


class ForceArrays(NamedTuple):
    """Kernel arguments of force terms, at most one of each kind; arrays of absent kinds are empty.

    Attributes:
        congruent: Nodes, axes, rows, blocks and lines of ``kernels.box_rows``.
        assembled: Pointer, columns and blocks of ``kernels.force.add_block_force``.
        turning_rows: Nodes, axes, rows, scales, constants and lines of ``box_rotation.add_turned_row_forces``.
        turning_boxes, turning: Nodes, filled, pattern and constants of ``vectors.box`` and ``turned_hexahedron``.
        one_point, hexahedron, path: Blocks of ``nonlinear_one_point`` and ``nonlinear_hexahedron``, and their ``Path``.
    """

    congruent: tuple[NDArray, ...]
    assembled: tuple[NDArray, ...]
    turning_rows: tuple[NDArray, ...]
    turning_boxes: tuple[NDArray, ...]
    turning: tuple[NDArray, ...]
    one_point: OnePointBlocks
    hexahedron: HexahedronBlocks
    path: Path


@structref.register
class ForcesType(types.StructRef):
    """Type of ``Forces``."""


@structref.register
class PacedForcesType(types.StructRef):
    """Type of ``PacedForces``."""


class Forces(structref.StructRefProxy):
    """``ForceArrays`` behind one pointer; passed by value, each array would be seven arguments of every function."""


class PacedForces(structref.StructRefProxy):
    """Force terms by the steps in which they act.

    Attributes:
        arrays: ``Forces`` of each pace; always ``PACES`` entries, so that one compiled program serves all cases.
        every: Interval in steps at which the terms of each pace act, shape (PACES,); 0 for an unused pace.
    """


structref.define_proxy(Forces, ForcesType, list(ForceArrays._fields))
structref.define_proxy(PacedForces, PacedForcesType, ["arrays", "every"])


@njit(cache=True)
def forces_of(arrays):
    """Return a ``Forces``, passed by pointer, with the kernel arguments of all force terms, a ``ForceArrays``."""
    return Forces(*arrays)


@njit(cache=True)
def paced_forces_of(arrays, every):
    """Return ``PacedForces`` of three ``Forces``, a tuple; ``every (3,)``: steps between actions of each, 0: unused."""
    return PacedForces(arrays, every)


class StepArrays(NamedTuple):
    """Arrays of a motion on one rank, see ``ExplicitMotion``.

    Attributes:
        state: Displacement [m], velocity half a step back [m/s] and force [N], shape (3, n, 3).
        ahead: Force for the following steps, see ``ExplicitMotion``, shape (n, 3) or (0, 3) [N].
        mobility: Inverse mass, zero where the velocity is prescribed, shape (n, 3) [1/kg].
        counted_mass: Nodal mass in the energy balance, shape (n,) [kg].
        slave, master, weight: Tie, see ``fem.mesh.tie``; slaves of elements that act most often come first.
        order: Number of each slave in the tie, shape (ns,).
        moved: Number of slaves of elements up to each pace, shape (PACES,).
        ends: Number of leading nodes that contains all nodes of elements up to each pace, shape (PACES,).
        slave_force: Latest force of the elements on the slaves, in the order of the tie, shape (ns, 3) [N].
    """

    state: NDArray[np.float64]
    ahead: NDArray[np.float64]
    mobility: NDArray[np.float64]
    counted_mass: NDArray[np.float64]
    slave: NDArray[np.int32]
    master: NDArray[np.int32]
    weight: NDArray[np.float64]
    order: NDArray[np.int64]
    moved: NDArray[np.int64]
    ends: NDArray[np.int64]
    slave_force: NDArray[np.float64]


class Interface(NamedTuple):
    """Coupling interface with velocities prescribed by another model, and the impulses of its forces.

    Attributes:
        rows: Interface nodes on this rank, shape (k,) int32.
        counted: Interface nodes whose impulse this rank counts, shape (c,) int32.
        given: Prescribed mean velocity of the nodes, which they keep at the end, shape (k, 3) [m/s].
        change: Deviation from the mean velocity in each step, shape (m, 3) [m/s].
        weights: Weights of the force before the first and after each step in both impulses, shape (m + 1, 2) [s, s^2].
        impulses: Impulse and its first moment in time, shape (2, c, 3) [N s, N s^2], added to.
    """

    rows: NDArray[np.int32]
    counted: NDArray[np.int32]
    given: NDArray[np.float64]
    change: NDArray[np.float64]
    weights: NDArray[np.float64]
    impulses: NDArray[np.float64]


@njit(inline="always")  # compiled once, inside ``take_steps``
def add_forces(arrays, displacement, force):
    """Subtract the internal force of ``arrays``, ``Forces``, at ``displacement (n, 3)`` [m] from ``force (n, 3)`` [N].

    Returns:
        ``ALL_FINE`` (-1) and 0, or, with an inverted element, index of its term into ``NAMES`` and its block or row.
    """
    nodes, axes, rows, blocks, lines = arrays.congruent
    if len(rows):
        read_lines(nodes, axes, displacement, lines[0])
        add_row_forces(rows, blocks, lines[0], lines[1])
        subtract_lines(nodes, axes, lines[1], force)
    pointer, columns, assembled = arrays.assembled
    add_block_force(pointer, columns, assembled, displacement, force)
    nodes, axes, rows, scales, constants, lines = arrays.turning_rows
    if len(rows):
        read_lines(nodes, axes, displacement, lines[0])
        block = add_turned_row_forces(rows, scales, constants, lines[0], lines[1])
        if block >= 0:
            return 2, block
        subtract_lines(nodes, axes, lines[1], force)
    block = add_turned_block_forces(arrays.turning_boxes, displacement, force)
    if block >= 0:
        return 3, block
    block = add_turned_forces(arrays.turning, displacement, force)
    if block >= 0:
        return 4, block
    block = add_one_point_force(arrays.one_point, arrays.path, displacement, force)
    if block >= 0:
        return 5, block
    if len(arrays.hexahedron.cells):  # or it would make room to work in
        block = add_hexahedron_force(arrays.hexahedron, arrays.path, displacement, force)
        if block >= 0:
            return 6, block
    return ALL_FINE, 0


@njit(cache=True)
def take_steps(motion, forces, interface, accelerations, step):
    """Take m steps of central differences, v += dt (f / m + g) and u += dt v, with the forces of a model, in one call.

    Args:
        motion: ``StepArrays`` (state, masses and tie of this rank), updated.
        forces: ``PacedForces``; all of them have just acted, and act again after the last step.
        interface: ``Interface`` to another model, without rows if uncoupled; its impulses are added to.
        accelerations: Body acceleration as each step begins, and after the last, shape (m + 1, 3) [m/s^2].
        step: Time step dt, scalar [s].

    Returns:
        Work of the accelerations [J], for their steady part by the displacement of all masses; steps taken, m or up to
        an inverted element; then its term (index into ``NAMES``), block or row, and pace (0 to 2), else -1, 0, 0.
    """
    displacement, velocity, force = motion.state[0], motion.state[1], motion.state[2]
    last, pushed, every = len(accelerations) - 1, np.zeros_like(motion.ahead), forces.every
    none = np.int64(0)  # of this type: Numba would compile what is called once more for a literal
    means = 0.5 * (accelerations[:-1] + accelerations[1:])
    steady = means[last // 2].copy()
    body, work = (accelerations, means - steady), 0.0
    start = first_moment(motion.counted_mass, displacement)
    add_ahead(motion.ahead, force)
    count_impulses(interface, none, force)
    held = interface.rows.min() if len(interface.rows) else len(velocity)
    for k in range(1, last + 1):
        reach = moved = begin = none
        for pace in range(PACES):
            if acts(forces, pace, k):
                reach, moved, block = motion.ends[pace], motion.moved[pace], (begin, motion.ends[pace], every[pace], k)
                if reach > held:
                    move_interface(interface, block, velocity)
                work += move_nodes(motion, block, body, step)
            begin = motion.ends[pace]
        spread_to_slaves(motion.slave[:moved], motion.master[:moved], motion.weight[:moved], displacement)
        which, place, pace = add_paced_forces(motion, forces, k, pushed, k == last)
        if which != ALL_FINE:
            return work, k, which, place, pace
        gather_forces(motion, moved, k == last)
        if reach > held:
            count_impulses(interface, k, force[:reach])
    count_impulses(interface, last, motion.ahead)
    for i in range(len(interface.rows)):
        for c in range(3):
            velocity[interface.rows[i], c] = interface.given[i, c]
    end = first_moment(motion.counted_mass, displacement)
    for c in range(3):
        work += steady[c] * (end[c] - start[c])
    return work, last, ALL_FINE, 0, 0


@njit(cache=True)
def count_impulses(interface, substep, force):
    """Add ``force (n, 3)`` [N] after step ``substep`` (0: start), weighted, to both impulses of an ``Interface``."""
    for j in range(2):
        add_impulse(interface.counted, force, interface.weights[substep, j], interface.impulses[j])


@njit(cache=True)
def acts(forces, pace, substep):
    """Return whether the terms of pace 0 to 2 of ``PacedForces`` act after step number ``substep`` (from 1)."""
    return forces.every[pace] > 0 and substep % forces.every[pace] == 0


@njit(cache=True)
def move_nodes(motion, block, body, step):
    """Move a range of nodes by the steps since a force acted on them, and zero their force.

    Args:
        motion: ``StepArrays``, its state is updated.
        block: Tuple: first node, end, number of steps to take and number of the last of them (from 1).
        body: Tuple: accelerations (m + 1, 3) as steps begin, mean deviations from the steady part (m, 3) [m/s^2].
        step: Time step dt, scalar [s].

    Returns:
        Work of the deviation [J].
    """
    begin, end, count, substep = block
    velocity, kicks = motion.state[1], np.empty((3, 3))
    accelerations, changes = body[0][substep - count : substep], body[1][substep - count : substep]
    kicks_of(accelerations, step, kicks)
    move(motion.state, motion.mobility, (begin, end), kicks, (step, count))
    motion.state[2, begin:end] = 0.0
    nodes = motion.counted_mass[begin:end], velocity[begin:end], motion.mobility[begin:end]
    return work_of_changes(nodes, changes, accelerations, step)


@njit(cache=True)
def move_interface(interface, block, velocity):
    """Set ``velocity (n, 3)`` [m/s] at nodes of an ``Interface`` to their prescribed mean velocity over some steps.

    ``block``, a tuple: first node, end of the range of nodes, number of steps and number of the last of them (from 1).
    """
    begin, end, count, substep = block
    x = y = z = 0.0
    for k in range(substep - count, substep):
        x, y, z = x + interface.change[k, 0], y + interface.change[k, 1], z + interface.change[k, 2]
    x, y, z = x / count, y / count, z / count
    for i in range(len(interface.rows)):
        row = interface.rows[i]
        if begin <= row < end:
            velocity[row, 0] = interface.given[i, 0] + x
            velocity[row, 1] = interface.given[i, 1] + y
            velocity[row, 2] = interface.given[i, 2] + z


@njit(inline="always")
def add_paced_forces(motion, forces, substep, pushed, final):
    """Add the forces of ``PacedForces`` that act after step ``substep`` to ``StepArrays``, each for its interval.

    If ``final``, later steps' shares go to ``ahead``; workspace ``pushed (n, 3)`` stays 0. Returns three scalars: those
    of ``add_forces`` (-1 and 0, or term and block of an inverted element) and pace (0 to 2).
    """
    force = motion.state[2]
    for pace in range(PACES):
        if acts(forces, pace, substep):
            every, nodes = forces.every[pace], motion.ends[pace]
            which, block = add_forces(forces.arrays[pace], motion.state[0], force if every == 1 else pushed)
            if which != ALL_FINE:
                return which, block, pace
            if every > 1:
                add_pushed(pushed[:nodes], every, force, motion.ahead if final else motion.ahead[:0])
    return ALL_FINE, 0, 0


@njit(cache=True)
def gather_forces(motion, moved, final):
    """Move forces of the first ``moved`` slaves of ``StepArrays`` to masters; ``final``: store them, move ``ahead``."""
    slave, master, weight = motion.slave[:moved], motion.master[:moved], motion.weight[:moved]
    force = motion.state[2]
    for i in range(moved if final else 0):
        for c in range(3):
            motion.slave_force[motion.order[i], c] = force[slave[i], c]
    gather_from_slaves(slave, master, weight, force)
    if final and len(motion.ahead):
        gather_from_slaves(slave, master, weight, motion.ahead)


@njit(cache=True)
def begin_substeps(rows, values, state):
    """Copy rows ``rows (n,)`` of displacements ``values (>= n, 3)`` [m] into row 0 of a level's ``state (3, n, 3)``."""
    place = state[0]
    for i in range(len(rows)):
        row = rows[i]
        place[i, 0], place[i, 1], place[i, 2] = values[row, 0], values[row, 1], values[row, 2]


@njit(cache=True)  # rounding must not depend on the position of a node, see kernels.motion.move
def take_substep(coefficients, inverse, change, state):
    """Add the weighted force to the sum and zero it; move the free nodes, the first nf of n.

    Args:
        coefficients: Three scalars: factors on the previous change and on DT^2 f / m, weight of the force in the sum.
        inverse: DT^2 / m of free nodes, zero for fixed components, shape (nf, 3) [s^2/kg].
        change: Displacement change of the substep before, then of this one, shape (nf, 3) [m].
        state: Displacement [m], force [N] and weighted sum of forces [N] of the level, shape (3, n, 3).
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
    """Add the sum of a level's forces to the force of the surrounding level, and zero it.

    Args:
        rows: Rows of the level's nodes in ``values``, shape (n,).
        foreign: Free nodes whose sum another rank adds (zeroed without adding), shape (k,).
        state: Displacement [m], force [N] and weighted sum of forces [N] of the level, shape (3, n, 3).
        values: Force of the surrounding level, shape (>= n, 3) [N], added to.
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
    """Take all substeps of a level, each with the substeps of the levels inside it, and add their mean force.

    For levels with one assembled matrix and no node of another rank; same operations and order as the kernels above.

    Args:
        levels: Tuples, outermost first: rows of its n nodes in ``values``; nodes that another rank adds; coefficients
            of ``take_substep`` (p, 3); DT^2 / m (nf, 3) [s^2/kg] and last displacement change (nf, 3) [m] of free
            nodes; state (3, n, 3): displacement [m], force, sum of forces [N]; row pointers (n + 1,), columns (nb,),
            blocks (nb, 3, 3) of its stiffness [N/m]. Change and state are updated.
        first: Index of the level, scalar.
        values: Displacement of the surrounding level, shape (>= n, 3) [m].
        force: Force of the surrounding level, shape (>= n, 3) [N], added to.
    """
    rows, foreign, coefficients, inverse, change, state, pointer, columns, blocks = levels[first]
    begin_substeps(rows, values, state)
    for k in range(len(coefficients)):
        add_block_force(pointer, columns, blocks, state[0], state[1])
        if first + 1 < len(levels):
            run_levels(levels, first + 1, state[0], state[1])
        take_substep((coefficients[k, 0], coefficients[k, 1], coefficients[k, 2]), inverse, change, state)
    end_substeps(rows, foreign, state, force)
