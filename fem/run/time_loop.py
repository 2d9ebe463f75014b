"""Time loop of a run: windows of all models, with samples, fields, checkpoints and progress.

With ``shock.duration = "auto"`` a run has the longest duration and ends early at the first sample at which
``output.settled`` finds the response settled. Rank 0 decides from its samples, which a restart restores. The other
modes of a comparison end when the first one did.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from mpi4py import MPI

from reflowshock.fem.coupling.stopwatch import Stopwatch
from reflowshock.fem.dynamics.history import History
from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.errors import InvertedElementError
from reflowshock.fem.output.fields import Fields, FieldSample
from reflowshock.fem.parallel.checkpoint import Checkpoints
from reflowshock.fem.parallel.checkpoint_state import State
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.parallel.waiting import wait_for_all

PROGRESS_INTERVAL = 0.5  # [s] between two progress lines
FLATTENED = "the time step holds for undeformed elements; reduce numerics.step_fraction for strong compression"
GUARD = 500  # largest number of steps between two checks of the energies

Participants = Mapping[Role, Participant]


class Pictures(Protocol):
    """Snapshots of all models at the ends of some windows.

    Attributes:
        windows: Numbers of these windows.
    """

    windows: frozenset[int]

    def sample(self, participants: Participants) -> None:
        """Take a snapshot; collective over all models."""

    def write(self, directory: Path) -> None:
        """Write all snapshots; on rank 0."""

    def state(self) -> State:
        """Return the snapshots so far, for a checkpoint."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore the values that ``state`` returned."""


@dataclass(frozen=True, slots=True)
class Outputs:
    """Outputs of a run.

    Attributes:
        history: Samples and energy balance.
        fields: Field file of each model of this rank.
        field_samples: Number of times that each field file is written.
        checkpoints: Checkpoints from which the run restarts and to which it writes.
        pictures: Snapshots at chosen windows.
        is_over: Function that decides from the samples whether the run ends early; None if it never does.
    """

    history: History
    fields: dict[Role, Fields]
    field_samples: int
    checkpoints: Checkpoints
    pictures: Sequence[Pictures] = ()
    is_over: Callable[[History], bool] | None = None


def run_time_loop(
    world: MPI.Comm, participants: Participants, outputs: Outputs, stopwatch: Stopwatch
) -> tuple[int, float]:
    """Run the windows from the start or the latest checkpoint until the run is over; collective.

    A window is the time between two exchanges of macro and meso model, or a step of a single model. The run ends after
    the last window of the plan, or earlier if ``is_over`` returns true after a sample.

    Args:
        world: Communicator of all ranks.
        participants: Models of this rank with their motion, in the order of their turns.
        outputs: History, field files, checkpoints and pictures, which are filled and written.
        stopwatch: Stopwatch of the models, which is advanced.

    Returns:
        Number of the last window, and time spent on writing fields [s].

    Raises:
        EnergyError: The energy balance is violated; on every rank, see ``EnergyBalance.judge``.
        InvertedElementError: An element is inverted; only on the rank that has it.
    """
    plan = next(iter(participants.values())).plan
    field_windows = set(np.linspace(0, plan.windows, outputs.field_samples).round().astype(int).tolist())
    reported, output_seconds, first = time.perf_counter(), 0.0, 0
    state = outputs.checkpoints.read(_state_of(participants, outputs))
    if state is not None and outputs.checkpoints.continued is not None:
        first = outputs.checkpoints.continued + 1
        output_seconds += _restore_checkpoint(
            participants, outputs, state, [window for window in sorted(field_windows) if window < first]
        )
    for window in range(first, plan.windows + 1):
        ACTIVITY.window = window
        if window:
            run_window(participants, stopwatch)
        sampled = _take_samples(participants, outputs, window)
        over = window == plan.windows or (sampled and is_over(world, outputs))
        if over or window in field_windows:
            output_seconds += _write_fields(participants, outputs, window)
        if over:
            break
        if sampled and outputs.checkpoints.is_due():
            _write_checkpoint(participants, outputs, window)
        if world.rank == 0 and time.perf_counter() - reported > PROGRESS_INTERVAL:
            reported = time.perf_counter()
            print(json.dumps({"progress": window / plan.windows, "time": _time_of(participants)}), flush=True)
    ACTIVITY.slow = "writes the results"
    for file in outputs.fields.values():
        file.close()
    return window, output_seconds


def is_over(world: MPI.Comm, outputs: Outputs) -> bool:
    """Return whether the run may end early, on all ranks; collective.

    Rank 0, which has the samples of the history, decides by ``outputs.is_over``: for a drop that may end early this is
    the case when the joint stresses have settled (``settled.is_settled``). Without that function the run never does.

    Args:
        world: Communicator of all ranks.
        outputs: Outputs of the run.
    """
    if outputs.is_over is None:
        return False
    ACTIVITY.wait_for("the decision of rank 0 whether the run is over")
    wait_for_all(world)
    over = bool(world.bcast(outputs.is_over(outputs.history) if world.rank == 0 else None))
    ACTIVITY.go_on()
    return over


def _take_samples(participants: Participants, outputs: Outputs, window: int) -> bool:
    """Take the samples and snapshots due after a window, and return whether a sample was due."""
    plan = next(iter(participants.values())).plan
    sampled = window % plan.stride == 0 or window == plan.windows
    if sampled:
        outputs.history.sample(participants)
    elif window % max(1, GUARD // plan.substeps) == 0:
        outputs.history.check(participants)
    for pictures in outputs.pictures:
        if window in pictures.windows:
            pictures.sample(participants)
    return sampled


def run_window(participants: Participants, stopwatch: Stopwatch) -> None:
    """Advance all models of this rank by one window: all begin it in turn, then all finish it in turn.

    A window is the time between two exchanges of macro and meso model, or a step of a single model.

    Args:
        participants: Models of this rank with their motion, in the order of their turns.
        stopwatch: Stopwatch that adds up the time of each model.

    Raises:
        InvertedElementError: An element of this rank is inverted; the message names the time.
    """
    stopwatch.start()
    try:
        for role, participant in participants.items():
            participant.begin_window()
            stopwatch.lap(role)
        for role, participant in participants.items():
            participant.finish_window()
            stopwatch.lap(role)
        ACTIVITY.slow = ""  # from here on all kernels are compiled
    except InvertedElementError as error:
        raise InvertedElementError(f"time {_time_of(participants):.6e} s: {error}; {FLATTENED}") from error


def _time_of(participants: Participants) -> float:
    """Return the current time of the models [s]."""
    return next(iter(participants.values())).motion.time


def _write_fields(participants: Participants, outputs: Outputs, window: int) -> float:
    """Write the fields of all models of this rank, also for a restart; return the time spent [s]."""
    begin = time.perf_counter()
    with ACTIVITY.busy("writes fields"):
        for role, participant in participants.items():
            fields = outputs.fields[role]
            sample = _sample_fields(participant, fields)
            fields.write(sample)
            outputs.checkpoints.store(f"{role}-{window}", {role: fields.state(sample)})
    return time.perf_counter() - begin


def _sample_fields(participant: Participant, fields: Fields) -> FieldSample:
    """Return the current fields of a model, with displacement relative to the base."""
    motion = participant.motion
    return fields.sample(motion.displacement - motion.base_displacement(), motion.time)


def _state_of(participants: Participants, outputs: Outputs) -> State:
    """Return the time-dependent state of this rank, for a checkpoint."""
    models: dict[str, State] = {role: participant.state() for role, participant in participants.items()}
    pictures = {f"pictures-{k}": item.state() for k, item in enumerate(outputs.pictures)}
    return models | {"history": outputs.history.state()} | pictures


def _write_checkpoint(participants: Participants, outputs: Outputs, window: int) -> None:
    """Write a checkpoint at the end of a window."""
    with ACTIVITY.busy("writes a checkpoint"):
        outputs.checkpoints.write(window, _time_of(participants), _state_of(participants, outputs))


def _restore_checkpoint(
    participants: Participants, outputs: Outputs, state: dict[str, Any], field_windows: list[int]
) -> float:
    """Restore a checkpoint and rewrite its earlier fields; return the time spent on fields [s]."""
    checkpoints = outputs.checkpoints
    for role, participant in participants.items():
        participant.restore(state[role])
    outputs.history.restore(state["history"])
    for k, pictures in enumerate(outputs.pictures):
        pictures.restore(state[f"pictures-{k}"])
    begin = time.perf_counter()
    like = {
        role: outputs.fields[role].state(_sample_fields(participants[role], outputs.fields[role]))
        for role in participants
    }
    for window in field_windows:
        for role in participants:
            stored = checkpoints.stored(f"{role}-{window}", {role: like[role]})
            outputs.fields[role].write(FieldSample(**stored[role]))
    if checkpoints.moved and checkpoints.continued is not None:
        _write_checkpoint(participants, outputs, checkpoints.continued)
    return time.perf_counter() - begin
