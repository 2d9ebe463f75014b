"""A run of the program on one rank, window by window, so that several can be measured in turns."""

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
        participants: The participants.
        plan: Window and substeps.
        elements: Elements of each model.
        setup: Processor seconds until it could start.
        history: Its samples.
        others: Samples of what other inputs watch of the same motion.
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
        """Go on by one window."""
        for participant in self.participants.values():
            participant.begin_window()
        for participant in self.participants.values():
            participant.finish_window()

    def step(self, seconds: float) -> float:
        """Go on for some simulated time; return the processor seconds of a simulated one."""
        windows = max(1, round(seconds / self.plan.window))
        begin = process_time()
        for _ in range(windows):
            self.window()
        return (process_time() - begin) / (windows * self.plan.window)

    def to_end(self) -> tuple[dict[str, np.ndarray], float]:
        """Go to the end with samples; return them and the processor seconds of all windows."""
        self.sample()
        seconds = 0.0
        for window in range(1, self.plan.windows + 1):
            begin = process_time()
            self.window()
            seconds += process_time() - begin
            if window % self.plan.stride == 0 or window == self.plan.windows:
                self.sample()
        return self.history.arrays(), seconds
