"""Compiled calls for all steps of a window, if no nodal load acts between them.

A model on one rank takes all steps in one call. A model on several ranks takes one step in a call, since the forces at
shared nodes are summed after each step.
"""

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
    count_impulses,
    forces_of,
    paced_forces_of,
    take_steps,
)
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.kernels.nonlinear_hexahedron import HexahedronBlocks
from reflowshock.fem.kernels.nonlinear_one_point import OnePointBlocks
from reflowshock.fem.kernels.vectors.vector import WIDTH
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body


def _none_of(*shape: int, kind: type = np.float64) -> Any:
    """Return an empty array of the given shape, for the unused arguments of a kernel."""
    return np.zeros(shape, kind)


NODES, AXES, ROWS = _none_of(0, kind=np.int32), _none_of(3, kind=np.int64), _none_of(0, 6, kind=np.int32)
CELLS, LINES, BY_LANE = _none_of(0, 8, LANES, kind=np.int32), _none_of(2, 3, 0), _none_of(0, LANES)
NOTHING = ForceArrays(
    congruent=(NODES, AXES, ROWS, _none_of(0, 8, 6), LINES),
    assembled=(_none_of(1, kind=np.int32), NODES, _none_of(0, 3, 3)),
    turning_rows=(NODES, AXES, ROWS, _none_of(0, 3), _none_of(0, 27), LINES),
    turning_boxes=(CELLS, NODES, NODES, _none_of(0, 30 * WIDTH)),
    turning=(CELLS, NODES, NODES, _none_of(0, 120 * WIDTH)),
    one_point=OnePointBlocks(
        *(CELLS, NODES, NODES, NODES, _none_of(0, 9), _none_of(0, 6), _none_of(0, 120 * WIDTH), _none_of(0, 1, WIDTH)),
        *(_none_of(0, 1, 13 * WIDTH), BY_LANE, BY_LANE, _none_of(0, 12 * WIDTH), _none_of(0)),
    ),
    hexahedron=HexahedronBlocks(
        *(CELLS, NODES, NODES, NODES, _none_of(0, 9), _none_of(0, 6), _none_of(0, 21 * LANES), _none_of(0, 9 * LANES)),
        *(_none_of(0, 8, LANES), _none_of(0, 8, LANES), _none_of(0, 32 * LANES), _none_of(0, 6 * LANES)),
        *(_none_of(0, 8, 7 * LANES), _none_of(0, 21 * LANES), BY_LANE, BY_LANE),
    ),
    path=Path(False, np.inf),
)


def no_interface(steps: int) -> Interface:
    """Return a coupling interface without nodes, for the compiled steps of a model that is not coupled.

    Args:
        steps: Number of steps taken in one call.
    """
    return Interface(NODES, NODES, _none_of(0, 3), _none_of(steps, 3), _none_of(steps + 1, 2), _none_of(2, 0, 3))


@dataclass(frozen=True, slots=True)
class CompiledSteps:
    """Arrays of a model with which one compiled call takes many explicit steps.

    Attributes:
        forces: Arrays of the force terms by pace.
        order: Order of the tie's slaves in ``StepArrays``, shape (ns,).
        tied: Slaves, masters and weights of the tie in this order.
        moved: Number of slaves moved at each pace, as in ``StepArrays``.
        ends: Number of nodes updated at each pace, as in ``StepArrays``.
        terms: For each pace, the force term by its field of ``ForceArrays``.
    """

    forces: PacedForces
    order: np.ndarray
    tied: tuple[np.ndarray, np.ndarray, np.ndarray]
    moved: np.ndarray
    ends: np.ndarray
    terms: list[dict[str, Any]]

    @classmethod
    def of(cls, body: Body, loads: Sequence[Load]) -> "CompiledSteps | None":
        """Return the compiled steps of a body under loads.

        None if a force term or a load needs Python between steps, or if there are more than ``PACES`` paces.
        """
        terms: dict[int, dict[str, Any]] = {}
        for term, pace in body.paced:
            arrays, same_pace = getattr(term, "arrays", {}), terms.setdefault(pace, {})
            if not arrays or same_pace.keys() & arrays.keys():
                return None
            same_pace |= dict.fromkeys(arrays, term)
        if len(terms) > PACES or any(acts_at_nodes(load) for load in loads):
            return None
        paces, unused = sorted(terms), PACES - len(terms)
        entries = [{name: term.arrays[name] for name, term in terms[pace].items()} for pace in paces]
        arrays = tuple(forces_of(NOTHING._replace(**entry)) for entry in [*entries, *[{}] * unused])
        all_paces, tie = np.array([*paces, *[0] * unused]), body.tie
        slave_pace, node_pace = body.node_paces
        order = np.argsort(slave_pace, kind="stable")
        moved = np.sum(slave_pace[:, None] <= all_paces, axis=0)
        last = [1 + np.flatnonzero(node_pace <= pace)[-1] for pace in paces[:-1]]
        ends = np.array([*last, *[len(node_pace)] * (1 + unused)])
        tied = tie.slave[order], tie.master[order], tie.weight[order]
        return cls(paced_forces_of(arrays, all_paces), order, tied, moved, ends, [terms[pace] for pace in paces])

    def take(
        self,
        motion: Motion,
        state: np.ndarray,
        ahead: np.ndarray,
        interface: Interface,
        accelerations: np.ndarray,
    ) -> float:
        """Take m steps and advance the time of the motion; collective over the ranks of the model.

        On several ranks all force terms must act in every step.

        Args:
            motion: Motion that takes the steps.
            state: Displacement, velocity and force of the motion, shape (3, n, 3).
            ahead: Delayed force of paced terms, as in ``ExplicitMotion``.
            interface: Coupling interface, see ``kernels.levels.take_steps``.
            accelerations: Body acceleration before the first step and after each step, shape (m + 1, 3) [m/s^2].

        Returns:
            Work of the body acceleration [J].

        Raises:
            InvertedElementError: An element is inverted; ``motion.time`` is then the time of the failed step.
        """
        steps = StepArrays(
            *(state, ahead, motion.mobility, motion.counted_mass, *self.tied),
            order=self.order,
            moved=self.moved,
            ends=self.ends,
            slave_force=motion.slave_force,
        )
        shared, last = motion.body.shared, len(accelerations) - 1
        if not shared.exchanged:
            return self._call(motion, steps, interface, accelerations)
        work = 0.0
        for k in range(last):
            work += self._call(motion, steps, _step_of(interface, k), accelerations[k : k + 2])
            shared.add(steps.state[2])
        count_impulses(interface, last, steps.state[2])
        return work

    def _call(self, motion: Motion, steps: StepArrays, interface: Interface, accelerations: np.ndarray) -> float:
        """Take steps in one call, with forces of this rank only; return the work of the body acceleration [J]."""
        work, taken, which, block, pace = take_steps(steps, self.forces, interface, accelerations, motion.step)
        for _ in range(taken):
            motion.time += motion.step
        if which != ALL_FINE:
            error: InvertedElementError = self.terms[pace][NAMES[which]].inverted(block, motion.displacement)
            raise error
        return float(work)


def _step_of(interface: Interface, substep: int) -> Interface:
    """Return the interface for a call that takes step ``substep`` (from 0) of a window.

    Its impulses count the force before the step only, since the force after the step is not yet summed over ranks.
    """
    weights = np.zeros((2, 2))
    weights[0] = interface.weights[substep]
    return interface._replace(change=interface.change[substep : substep + 1], weights=weights)


def acts_at_nodes(load: Load) -> bool:
    """Return whether a load does more in a step than accelerate all masses, such as adding nodal forces.

    Args:
        load: Load of a model.
    """
    kind = type(load)
    return any(getattr(kind, name) is not getattr(Load, name) for name in ("drive", "add", "collect"))
