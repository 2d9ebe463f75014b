"""One shock run, from meshes to results: what every rank does, in order."""

import json
import time

import numpy as np
from mpi4py import MPI

from fem.agreement import agreed
from fem.communicators import Communicators, Role
from fem.estimate import WindowPlan
from fem.exchange import CutChannels
from fem.fields import Fields
from fem.history import History
from fem.inputs import RunInput
from fem.ledger import Ledger
from fem.loads import HalfSineDrop
from fem.model import Model, build_models
from fem.parameters import Shock
from fem.participant import Alone, Macro, Meso, Participant, uncut_motion
from fem.result import Timings, write_result
from fem.steps import Steps
from fem.watch_joints import JointWatch

PROGRESS_INTERVAL = 0.5  # [s] between two progress lines
NON_TRIVIAL = 1e-4  # of the energy that the pulse gives a free body: from there on the balance is judged


def run(world: MPI.Comm, request: RunInput) -> None:
    """Run one shock and write its results; collective over ``world``.

    Raises:
        AgreedError: Input or mesh that does not fit; on every rank.
        RankError: Too few or too many ranks; on every rank.
        EnergyError: Energies that do not balance; on every rank.
    """
    start = time.perf_counter()
    with Communicators(world, request.mode, request.shock.ranks) as comms:
        models, steps = build_models(comms, request)
        load = HalfSineDrop(request.shock.peak_acceleration, request.shock.pulse_duration)
        crew = make_crew(comms, models, steps.plan, load)
        history = make_history(comms, models, steps, load, request.shock)
        fields = make_fields(comms, models, request)
        ready = time.perf_counter()
        output_seconds = march(comms, crew, history, fields, request.shock.numerics.field_samples)
        timings = Timings(ready - start, time.perf_counter() - ready - output_seconds, output_seconds)
        write_result(comms, request, (models, steps), history, timings)
        agreed(comms.world, lambda: None)


def make_crew(
    comms: Communicators, models: dict[Role, Model], plan: WindowPlan, load: HalfSineDrop
) -> dict[Role, Participant]:
    """Return the participants of this rank, in the order of their turns; collective."""
    bodies = {role: model.body for role, model in models.items()}
    if "dns" in bodies:
        return {"dns": Alone(uncut_motion(bodies["dns"], [load], plan.step), plan)}
    absent = np.full_like(next(iter(bodies.values())).cut, -1)
    macro, meso = (bodies[role].cut if role in bodies else absent for role in ("macro", "meso"))
    channels = CutChannels.open(comms.world, macro, meso, receiver_waits=len(comms.models) == 1)
    made: dict[Role, Participant] = {}
    if "meso" in bodies:  # first: it sends the interface mass that the macro model waits for
        made["meso"] = Meso(bodies["meso"], [load], plan, channels)
    if "macro" in bodies:
        made["macro"] = Macro(bodies["macro"], [load], plan, channels)
    return {role: made[role] for role in comms.models}


def make_history(
    comms: Communicators, models: dict[Role, Model], steps: Steps, load: HalfSineDrop, shock: Shock
) -> History:
    """Return the empty history of this run."""
    speed = load.velocity_change(shock.duration)
    mass = steps.model_mass + steps.added_mass
    ledger = Ledger(shock.numerics.energy_balance_limit, NON_TRIVIAL * 0.5 * mass * speed**2)
    watches = {role: JointWatch(model.tables.watch, model.body) for role, model in models.items()}
    return History(comms.world, watches, ledger, {"base_acceleration": load.base})


def make_fields(comms: Communicators, models: dict[Role, Model], request: RunInput) -> dict[Role, Fields]:
    """Open a field file per model of this rank; collective."""
    return {
        role: Fields(
            comms.models[role],
            model.body,
            model.tables.part[model.body.local.cell_numbers],
            request.output / f"{role}.pvd",
        )
        for role, model in models.items()
    }


def march(
    comms: Communicators,
    crew: dict[Role, Participant],
    history: History,
    fields: dict[Role, Fields],
    field_samples: int,
) -> float:
    """Run all windows with their samples; return the seconds spent on fields."""
    any_participant = next(iter(crew.values()))
    plan = any_participant.plan
    field_windows = set(np.linspace(0, plan.windows, field_samples).round().astype(int).tolist())
    output_seconds, told = 0.0, time.perf_counter()
    for window in range(plan.windows + 1):
        if window:
            run_window(crew)
        if window % plan.stride == 0 or window == plan.windows:
            history.sample(crew)
        if window in field_windows:
            output_seconds += write_fields(crew, fields)
        if comms.world.rank == 0 and time.perf_counter() - told > PROGRESS_INTERVAL:
            told = time.perf_counter()
            print(json.dumps({"progress": window / plan.windows, "time": any_participant.motion.time}), flush=True)
    for file in fields.values():
        file.close()
    return output_seconds


def run_window(crew: dict[Role, Participant]) -> None:
    """Advance all models of this rank by one window, each at its turn."""
    for participant in crew.values():
        participant.begin_window()
    for participant in crew.values():
        participant.finish_window()


def write_fields(crew: dict[Role, Participant], fields: dict[Role, Fields]) -> float:
    """Write the fields of all models of this rank; return the seconds it took."""
    begin = time.perf_counter()
    for role, participant in crew.items():
        fields[role].write(participant.motion.displacement, participant.motion.time)
    return time.perf_counter() - begin
