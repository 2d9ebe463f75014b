"""Numba kernels of many steps in one call: all those of a window, and substeps inside a step.

Levels inside a step are those of ``fem.model.step_levels``; a level has its state in ``(3, n, 3)``: displacement [m],
force [N], weighted sum of forces [N].
"""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.experimental import structref
from numpy.typing import NDArray

from reflowshock.fem.kernels.box_rotation import add_turned_block_forces, add_turned_row_forces
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

ALL_FINE = -1  # no element is turned inside out
PACES = 3  # at which force terms may act
NAMES = ("congruent", "assembled", "turning_rows", "turning_boxes", "turning", "one_point", "hexahedron")


class ForceArrays(NamedTuple):
    """The arrays of force terms, at most one of each kind, as their kernels take them; empty where there is none.

    Attributes:
        congruent: Nodes, axes, rows, blocks and lines of ``kernels.box_rows``.
        assembled: Pointer, columns and blocks of ``kernels.force.add_block_force``.
        turning_rows: Nodes, axes, rows, scales, constants and lines of ``box_rotation.add_turned_row_forces``.
        turning_boxes: Cells, filled and constants of ``box_rotation.add_turned_block_forces``.
        turning: The same of ``turned_hexahedron.add_turned_forces``.
        one_point, hexahedron: See ``nonlinear_one_point``, ``nonlinear_hexahedron``.
        path: Of these.
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
    """``ForceArrays`` behind one pointer: by value, each array is seven arguments of each function it goes through."""


class PacedForces(structref.StructRefProxy):
    """Force terms by the steps in which they act.

    Attributes:
        arrays: ``PACES`` times ``Forces``; there is one compiled program for all numbers of paces.
        every: ``(PACES,)`` in how many steps each of them acts once; 0 where there is none.
    """


structref.define_proxy(Forces, ForcesType, list(ForceArrays._fields))
structref.define_proxy(PacedForces, PacedForcesType, ["arrays", "every"])


@njit(cache=True)
def forces_of(arrays):
    """Return the ``Forces`` of ``ForceArrays``: the class itself, called by the interpreter, is compiled every time."""
    return Forces(*arrays)


@njit(cache=True)
def paced_forces_of(arrays, every):
    """Return the ``PacedForces`` with these attributes."""
    return PacedForces(arrays, every)


class StepArrays(NamedTuple):
    """What a motion on one rank steps with, see ``ExplicitMotion``; slaves, masters and weights are those of the tie.

    Attributes:
        state: ``(3, n, 3)`` displacement [m], velocity half a step back [m/s], force [N].
        ahead: ``(n, 3)`` [N], or ``(0, 3)``: see ``ExplicitMotion``.
        mobility: ``(n, 3)`` [1/kg].
        counted_mass: ``(n,)`` [kg].
        slave, master, weight: See ``fem.mesh.tie``; first those of elements that act most often.
        order: ``(ns,)`` their numbers in the tie.
        moved: ``(PACES,)`` how many of them elements of each pace and of smaller ones have.
        ends: ``(PACES,)`` how many of the first nodes have all those of elements of each pace and of smaller ones.
        slave_force: ``(ns, 3)`` [N] of the elements on them when all of these acted last, in the order of the tie.
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
    """An interface that another model moves through some steps, and the impulses that its forces give.

    Attributes:
        rows: ``(k,)`` int32 its nodes on this rank.
        counted: ``(c,)`` int32 those that count on this rank.
        given: ``(k, 3)`` [m/s] their mean velocity, which they have afterwards.
        change: ``(m, 3)`` [m/s] of it in each step.
        weights: ``(m + 1, 2)`` [s], [s^2] of the force before the first step and after each in both impulses.
        impulses: ``(2, c, 3)`` [N s], [N s^2], added to.
    """

    rows: NDArray[np.int32]
    counted: NDArray[np.int32]
    given: NDArray[np.float64]
    change: NDArray[np.float64]
    weights: NDArray[np.float64]
    impulses: NDArray[np.float64]


@njit(inline="always")  # compiled once, inside ``take_steps``
def add_forces(arrays, displacement, force):
    """Subtract the internal force of all terms, as their ``add`` does.

    Returns:
        ``ALL_FINE``, or the place in ``NAMES`` of a term with an element that is turned inside out; and its block.
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
    cells, filled, constants = arrays.turning_boxes
    block = add_turned_block_forces(cells, filled, constants, displacement, force)
    if block >= 0:
        return 3, block
    cells, filled, constants = arrays.turning
    block = add_turned_forces(cells, filled, constants, displacement, force)
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
    """Take steps of central differences as ``ExplicitMotion.advance`` and ``update_force`` do.

    Nodes on which nothing acts for some steps take these at once. A steady body force does its work on what all masses
    have moved; what changes beside it is counted step by step.

    Args:
        motion: ``StepArrays``.
        forces: ``PacedForces``; all of them have just acted, and act again after the last step.
        interface: ``Interface``.
        accelerations: ``(m + 1, 3)`` [m/s^2] of all masses as each step begins, and after the last.
        step: dt [s].

    Returns:
        Work of the accelerations [J]; steps taken; what ``add_forces`` returned last; at which pace that was.
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
    """Add to the impulses of an ``Interface`` what a force of the first nodes ``(k, 3)`` gives after a step."""
    for j in range(2):
        add_impulse(interface.counted, force, interface.weights[substep, j], interface.impulses[j])


@njit(cache=True)
def acts(forces, pace, substep):
    """Return whether terms of a pace act after a step."""
    return forces.every[pace] > 0 and substep % forces.every[pace] == 0


@njit(cache=True)
def move_nodes(motion, block, body, step):
    """Move some nodes by the steps since something acted on them, and zero their force.

    Args:
        motion: As in ``take_steps``.
        block: First node, end, steps to be taken and the number of the last of them.
        body: Accelerations, and what their means over steps have beside the steady part.
        step: dt [s].

    Returns:
        Work of the latter [J].
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
    """Prescribe the mean velocities of an ``Interface`` in some steps; ``block`` as above."""
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
    """Add the forces that act after a step for all steps that they act for; if final, those of later ones to ``ahead``.

    ``pushed (n, 3)`` is zero between calls. Returns what ``add_forces`` returned last, and at which pace.
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
    """Move the forces of the first slaves to their masters; of all, if final, keep them, and move what is ahead."""
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
