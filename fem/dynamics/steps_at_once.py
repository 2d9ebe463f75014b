"""All steps of a window in one compiled call, where nothing else acts between them: no message, no load at nodes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.kernels.lanes import LANES
from reflowshock.fem.kernels.levels import (
    ALL_FINE,
    NAMES,
    PACES,
    ForceArrays,
    Interface,
    PacedForces,
    StepArrays,
    forces_of,
    paced_forces_of,
    take_steps,
)
from reflowshock.fem.kernels.nonlinear import STATE_SLOTS, Path
from reflowshock.fem.kernels.nonlinear_hexahedron import HexahedronBlocks
from reflowshock.fem.kernels.nonlinear_one_point import OnePointBlocks
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body


def none_of(*shape: int, kind: type = np.float64) -> Any:
    """Return an array with no entries for a kernel that has nothing to do."""
    return np.zeros(shape, kind)


NODES, AXES, ROWS = none_of(0, kind=np.int32), none_of(3, kind=np.int64), none_of(0, 6, kind=np.int32)
CELLS, LINES, BY_LANE = none_of(0, 8, LANES, kind=np.int32), none_of(2, 3, 0), none_of(0, LANES)
NOTHING = ForceArrays(
    congruent=(NODES, AXES, ROWS, none_of(0, 8, 6), LINES),
    assembled=(none_of(1, kind=np.int32), NODES, none_of(0, 3, 3)),
    turning_rows=(NODES, AXES, ROWS, none_of(0, 3), none_of(0, 27), LINES),
    turning_boxes=(CELLS, NODES, none_of(0, 30 * LANES)),
    turning=(CELLS, NODES, none_of(0, 120 * LANES)),
    one_point=OnePointBlocks(
        *(CELLS, NODES, NODES, NODES, none_of(0, 9), none_of(0, 6), none_of(0, 120 * LANES), none_of(0, 1, LANES)),
        *(none_of(0, 1, STATE_SLOTS), BY_LANE, BY_LANE, none_of(0, 12 * LANES), none_of(0)),
    ),
    hexahedron=HexahedronBlocks(
        *(CELLS, NODES, NODES, NODES, none_of(0, 9), none_of(0, 6), none_of(0, 21 * LANES), none_of(0, 9 * LANES)),
        *(none_of(0, 8, LANES), none_of(0, 8, LANES), none_of(0, 32 * LANES), none_of(0, 6 * LANES)),
        *(none_of(0, 8, 7 * LANES), none_of(0, 21 * LANES), BY_LANE, BY_LANE),
    ),
    path=Path(False, np.inf),
)


def no_interface(steps: int) -> Interface:
    """Return the interface of a model that nobody moves through some steps."""
    nowhere = none_of(0, 3)
    return Interface(NODES, NODES, nowhere, none_of(steps, 3), none_of(steps + 1, 2), none_of(2, 0, 3))


@dataclass(frozen=True, slots=True)
class StepsAtOnce:
    """The compiled steps of a motion.

    Attributes:
        forces: Its force terms by pace.
        order: ``(ns,)`` slaves of the tie as ``StepArrays`` has them, ``tied`` in this order; others as there.
        terms: By pace, entry of ``ForceArrays`` -> the term.
    """

    forces: PacedForces
    order: np.ndarray
    tied: tuple[np.ndarray, np.ndarray, np.ndarray]
    moved: np.ndarray
    ends: np.ndarray
    terms: list[dict[str, Any]]

    @classmethod
    def of(cls, body: Body, loads: Sequence[Load]) -> "StepsAtOnce | None":
        """Return the steps of a body under loads.

        None where some of either act between steps in their own way, or there are more than ``PACES``.
        """
        found: dict[int, dict[str, Any]] = {}
        for term, pace in body.paced:
            arrays, alike = getattr(term, "arrays", {}), found.setdefault(pace, {})
            if not arrays or alike.keys() & arrays.keys():
                return None
            alike |= dict.fromkeys(arrays, term)
        if len(found) > PACES or any(acts_at_nodes(load) for load in loads):
            return None
        paces, rest = sorted(found), PACES - len(found)
        entries = [{name: term.arrays[name] for name, term in found[pace].items()} for pace in paces]
        arrays = tuple(forces_of(NOTHING._replace(**own)) for own in [*entries, *[{}] * rest])
        every, tie = np.array([*paces, *[0] * rest]), body.tie
        own, node = body.node_paces
        order = np.argsort(own, kind="stable")
        moved = np.sum(own[:, None] <= every, axis=0)
        ends = np.array([*(1 + np.flatnonzero(node <= pace)[-1] for pace in paces[:-1]), *[len(node)] * (1 + rest)])
        tied = tie.slave[order], tie.master[order], tie.weight[order]
        return cls(paced_forces_of(arrays, every), order, tied, moved, ends, [found[pace] for pace in paces])

    def take(
        self, motion: Motion, state: tuple[np.ndarray, np.ndarray], interface: Interface, accelerations: np.ndarray
    ) -> float:
        """Take steps; return the work of the accelerations ``(m + 1, 3)`` [m/s^2] at the ends of steps [J].

        Args:
            motion: Of which ``state`` is the ``state`` and ``ahead`` of ``StepArrays``.
            state: See above.
            interface: See ``take_steps``.
            accelerations: See above.

        Raises:
            InvertedElementError: An element is turned inside out; the motion's time is that of the step.
        """
        steps = StepArrays(
            *(*state, motion.mobility, motion.counted_mass, *self.tied),
            order=self.order,
            moved=self.moved,
            ends=self.ends,
            slave_force=motion.slave_force,
        )
        work, taken, which, block, pace = take_steps(steps, self.forces, interface, accelerations, motion.step)
        for _ in range(taken):
            motion.time += motion.step
        if which != ALL_FINE:
            error: InvertedElementError = self.terms[pace][NAMES[which]].inverted(block, motion.displacement)
            raise error
        return float(work)


def acts_at_nodes(load: Load) -> bool:
    """Return whether a load does more in a step than to accelerate all masses."""
    kind = type(load)
    return any(getattr(kind, name) is not getattr(Load, name) for name in ("drive", "add", "collect"))
