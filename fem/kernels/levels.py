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
from reflowshock.fem.kernels.hexahedron import FINITE
from reflowshock.fem.kernels.motion import add_impulse, advance, gather_from_slaves, spread_to_slaves
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
        moved: ``(PACES,)`` how many of them elements of each pace and of smaller ones have.
        slave_force: ``(ns, 3)`` [N] of the elements on them, when they acted last.
    """

    state: NDArray[np.float64]
    ahead: NDArray[np.float64]
    mobility: NDArray[np.float64]
    counted_mass: NDArray[np.float64]
    slave: NDArray[np.int32]
    master: NDArray[np.int32]
    weight: NDArray[np.float64]
    moved: NDArray[np.int64]
    slave_force: NDArray[np.float64]


class Interface(NamedTuple):
    """An interface that another model moves through some steps, and the impulses that its forces give.

    Attributes:
        rows: ``(k,)`` int32 its nodes on this rank.
        counted: ``(c,)`` int32 those that count on this rank.
        given: ``(k, 3)`` [m/s] their mean velocity.
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
    block = add_hexahedron_force(arrays.hexahedron, arrays.path, displacement, force)
    if block >= 0:
        return 6, block
    return ALL_FINE, 0


@njit(cache=True)
def take_steps(motion, forces, interface, accelerations, step):
    """Take steps of central differences as ``ExplicitMotion.advance`` and ``update_force`` do, in the same order.

    Args:
        motion: ``StepArrays``.
        forces: ``PacedForces``; all of them have just acted.
        interface: ``Interface``.
        accelerations: ``(m + 1, 3)`` [m/s^2] of all masses as each step begins, and after the last.
        step: dt [s].

    Returns:
        Work of the accelerations [J]; steps taken; what ``add_forces`` returned last; at which pace that was.
    """
    displacement, velocity, force = motion.state[0], motion.state[1], motion.state[2]
    pushed, due = np.zeros_like(motion.ahead), len(motion.ahead) > 0
    work, last = 0.0, len(accelerations) - 2
    place = first_moment(motion.counted_mass, displacement)
    for k in range(last + 1):
        move_interface(interface, k, velocity)
        if due:
            add_ahead(motion.ahead, force)
        advance(motion.state, motion.mobility, accelerations[k], step)
        moved = slaves_moved(motion, forces, k + 1)
        spread_to_slaves(motion.slave[:moved], motion.master[:moved], motion.weight[:moved], displacement)
        mean = accelerations[k] + accelerations[k + 1]
        if k == last or np.any(mean != accelerations[k + 1] + accelerations[k + 2]):
            before, place = place, first_moment(motion.counted_mass, displacement)
            for c in range(3):  # of all steps since the mean changed: the sum of dt v is what the nodes have moved
                work += 0.5 * mean[c] * (place[c] - before[c])
        which, block, pace, due = add_paced_forces(motion, forces, k + 1, pushed)
        if which != ALL_FINE:
            return work, k + 1, which, block, pace
        gather_forces(motion, moved, due)
        for j in range(2):
            add_impulse(interface.counted, force, interface.weights[k + 1, j], interface.impulses[j])
            if due:
                add_impulse(interface.counted, motion.ahead, interface.weights[k + 1, j], interface.impulses[j])
    return work, last + 1, ALL_FINE, 0, 0


@njit(cache=True)
def move_interface(interface, substep, velocity):
    """Prescribe the velocities of an ``Interface`` in a step."""
    for i in range(len(interface.rows)):
        for c in range(3):
            velocity[interface.rows[i], c] = interface.given[i, c] + interface.change[substep, c]


@njit(cache=True)
def add_ahead(ahead, force):
    """Add to the force ``(n, 3)`` [N] what has acted for the steps that follow, and zero it."""
    total, rest = force.reshape(-1), ahead.reshape(-1)  # flat: loops that fill vectors
    for i in range(len(total)):
        total[i] += rest[i]
        rest[i] = 0.0


@njit(cache=True)
def slaves_moved(motion, forces, substep):
    """Return how many of the slaves elements have that act after a step."""
    moved = 0
    for pace in range(PACES):
        if forces.every[pace] and substep % forces.every[pace] == 0:
            moved = max(moved, motion.moved[pace])
    return moved


@njit(inline="always")
def add_paced_forces(motion, forces, substep, pushed):
    """Put the forces that act after a step into those of a motion; ``pushed (n, 3)`` is zero between calls.

    Returns:
        What ``add_forces`` returned last, at which pace, and whether something acts for steps that follow.
    """
    force, due = motion.state[2], False
    force[:] = 0.0
    for pace in range(PACES):
        every = forces.every[pace]
        if every and substep % every == 0:
            which, block = add_forces(forces.arrays[pace], motion.state[0], force if every == 1 else pushed)
            if which != ALL_FINE:
                return which, block, pace, due
            if every > 1:
                due = True
                add_pushed(pushed, every, force, motion.ahead)
    return ALL_FINE, 0, 0, due


@njit(cache=True)
def add_pushed(pushed, every, force, ahead):
    """Add to the force ``(n, 3)`` [N] what acts once in some steps, to ``ahead`` its share of the others; zero it."""
    own, total, rest = pushed.reshape(-1), force.reshape(-1), ahead.reshape(-1)
    for i in range(len(own)):
        total[i] += own[i]
        rest[i] += (every - 1) * own[i]
        own[i] = 0.0


@njit(cache=True)
def gather_forces(motion, moved, due):
    """Keep the forces of the first slaves, and move them to their masters; those for steps that follow, too."""
    slave, master, weight = motion.slave[:moved], motion.master[:moved], motion.weight[:moved]
    force = motion.state[2]
    for i in range(moved):
        for c in range(3):
            motion.slave_force[i, c] = force[slave[i], c]
    gather_from_slaves(slave, master, weight, force)
    if due:
        gather_from_slaves(slave, master, weight, motion.ahead)


@njit(cache=True, fastmath=FINITE)
def first_moment(mass, places):
    """Return the sum of masses ``(n,)`` times places ``(n, 3)``."""
    x = y = z = 0.0
    for i in range(len(mass)):
        x += mass[i] * places[i, 0]
        y += mass[i] * places[i, 1]
        z += mass[i] * places[i, 2]
    return x, y, z


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
