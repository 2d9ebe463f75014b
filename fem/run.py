"""One shock run, from meshes to results: what every rank does, in order."""

import json
import time

import numpy as np
from mpi4py import MPI

from fem.agreement import agreed
from fem.communicators import Communicators
from fem.exchange import CutChannels
from fem.fields import Fields
from fem.history import History
from fem.inputs import RunInput
from fem.ledger import Ledger
from fem.loads import HalfSineDrop
from fem.model import Model, build_model
from fem.participant import Alone, Macro, Meso, Participant
from fem.result import Timings, write_result
from fem.watch import Watch

PROGRESS_INTERVAL = 0.5  # [s] between two progress lines
NON_TRIVIAL = 1e-4  # of the energy that the pulse gives a free body: from there on the balance is judged
SIDE = {"macro": 1.0, "meso": -1.0, "dns": 0.0}


def run(world: MPI.Comm, request: RunInput) -> None:
    """Run one shock and write its results; collective over ``world``.

    Raises:
        AgreedError: Input or mesh that does not fit; on every rank.
        RankError: Too few or too many ranks; on every rank.
        EnergyError: Energies that do not balance; on every rank.
    """
    start = time.perf_counter()
    with Communicators(world, request.mode, request.shock.ranks) as comms:
        model = build_model(comms, request)
        load = HalfSineDrop(request.shock.peak_acceleration, request.shock.pulse_duration)
        participant = make_participant(comms, model, load)
        history = make_history(comms, model, load, request)
        fields = Fields(
            comms.model,
            model.body,
            model.tables.part[model.body.local.cell_numbers],
            request.output / f"{comms.role}.pvd",
        )
        ready = time.perf_counter()
        output_seconds = march(comms, participant, history, fields, request)
        timings = Timings(ready - start, time.perf_counter() - ready - output_seconds, output_seconds)
        write_result(comms, request, model, history, timings)
        agreed(comms.world, lambda: None)


def make_participant(comms: Communicators, model: Model, load: HalfSineDrop) -> Participant:
    """Return the participant of this rank; collective."""
    body, plan = model.body, model.steps.plan
    if comms.role == "dns":
        return Alone(body, [load], plan)
    absent = np.full_like(body.cut, -1)
    if comms.role == "macro":
        return Macro(body, [load], plan, CutChannels.open(comms.world, body.cut, absent))
    return Meso(body, [load], plan, CutChannels.open(comms.world, absent, body.cut))


def make_history(comms: Communicators, model: Model, load: HalfSineDrop, request: RunInput) -> History:
    """Return the empty history of this run."""
    speed = load.velocity_change(request.shock.duration)
    mass = model.steps.model_mass + model.steps.added_mass
    ledger = Ledger(request.shock.numerics.energy_balance_limit, NON_TRIVIAL * 0.5 * mass * speed**2)
    return History(comms.world, Watch(model.tables.watch, model.body), ledger, load)


def march(comms: Communicators, participant: Participant, history: History, fields: Fields, request: RunInput) -> float:
    """Run all windows with their samples; return the seconds spent on fields."""
    plan = participant.plan
    field_windows = set(np.linspace(0, plan.windows, request.shock.numerics.field_samples).round().astype(int).tolist())
    output_seconds, told = 0.0, time.perf_counter()
    for window in range(plan.windows + 1):
        if window:
            participant.run_window()
        if window % plan.stride == 0 or window == plan.windows:
            history.sample(participant, SIDE[comms.role])
        if window in field_windows:
            begin = time.perf_counter()
            fields.write(participant.motion.displacement, participant.motion.time)
            output_seconds += time.perf_counter() - begin
        if comms.world.rank == 0 and time.perf_counter() - told > PROGRESS_INTERVAL:
            told = time.perf_counter()
            print(json.dumps({"progress": window / plan.windows, "time": participant.motion.time}), flush=True)
    fields.close()
    return output_seconds
