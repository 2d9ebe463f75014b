"""Program runs on one rank that advance window by window, so that several can be measured in turns."""

from collections.abc import Sequence
from dataclasses import replace
from time import process_time

import numpy as np
from mpi4py import MPI

from reflowshock.fem.estimates.placement import shared
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.run.dynamics import make_history, make_participants
from reflowshock.fem.run.package import PackageDrop


class ProgramRun:
    """Models, participants and history of an input, at rest.

    Attributes:
        participants: Participants of the coupling.
        plan: Window and substeps.
        elements: Number of elements of each model.
        setup: Processor seconds of the set-up.
        history: Samples of the run.
        others: Samples of the same motion with the watch points of other inputs.
    """

    def __init__(self, request: RunInput, others: Sequence[RunInput] = ()) -> None:
        """Build the models."""
        begin = process_time()
        problem = PackageDrop.read(MPI.COMM_SELF, request)
        comms = Communicators(MPI.COMM_SELF, shared(tuple(problem.divided.tables), 1))
        models, steps = problem.build(comms, {})
        self.plan = steps.plan
        self.participants = make_participants(comms, problem, models, steps).participants
        self.elements = {role: len(model.body.local.cells) for role, model in models.items()}
        self.setup = process_time() - begin
        self.history = make_history(comms.world, problem, models, steps)
        self.others = []
        for other in (PackageDrop.read(MPI.COMM_SELF, item) for item in others):
            watched = {role: replace(model, tables=other.divided.tables[role]) for role, model in models.items()}
            self.others.append(make_history(comms.world, other, watched, steps))

    def sample(self) -> None:
        """Take a sample of each history."""
        for history in (self.history, *self.others):
            history.sample(self.participants)

    def window(self) -> None:
        """Advance by one window."""
        for participant in self.participants.values():
            participant.begin_window()
        for participant in self.participants.values():
            participant.finish_window()

    def step(self, seconds: float) -> float:
        """Advance by a simulated time [s]; return the processor seconds per simulated second."""
        windows = max(1, round(seconds / self.plan.window))
        begin = process_time()
        for _ in range(windows):
            self.window()
        return (process_time() - begin) / (windows * self.plan.window)

    def to_end(self) -> tuple[dict[str, np.ndarray], float]:
        """Complete the run with samples; return them and the processor seconds of all windows."""
        self.sample()
        seconds = 0.0
        for window in range(1, self.plan.windows + 1):
            begin = process_time()
            self.window()
            seconds += process_time() - begin
            if window % self.plan.stride == 0 or window == self.plan.windows:
                self.sample()
        return self.history.arrays(), seconds
