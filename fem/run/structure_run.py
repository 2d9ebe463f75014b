"""One run of a structure, from its mesh to its results: what every rank does, in order."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.coupling.planner import Plan, loads_of, plan_ranks
from reflowshock.fem.coupling.self_check import recorded
from reflowshock.fem.coupling.stopwatch import Stopwatch
from reflowshock.fem.division.whole import Treatment
from reflowshock.fem.dynamics.energy_balance import EnergyBalance
from reflowshock.fem.dynamics.history import History
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.estimates.material_effects import plastic_laws
from reflowshock.fem.estimates.placement import shared
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of
from reflowshock.fem.output.fields import Fields, element_peaks
from reflowshock.fem.output.result import Timings
from reflowshock.fem.output.structure_modes import ModeTable, find_modes
from reflowshock.fem.output.structure_result import Found, write_result
from reflowshock.fem.output.watch_points import PointWatch
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.checkpoint import Checkpoints
from reflowshock.fem.parallel.checkpoint_files import digest_of_files
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.exchange import MessageClock
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.problem.shock import Ranks
from reflowshock.fem.problem.structure import LayerCoupling
from reflowshock.fem.run.structure_participants import couple_models, make_participant
from reflowshock.fem.run.time_loop import Outputs, run_time_loop
from reflowshock.fem.setup.structure_divided import DividedStructure, divided_structure
from reflowshock.fem.setup.structure_model import StructureModel, build_coupled, build_structure

Models = Mapping[Role, StructureModel]


@dataclass(frozen=True, slots=True)
class Started:
    """A run before its first step.

    Attributes:
        models: The models of this rank.
        participants: Their participants, in the order of their turns.
        modes: Natural modes, if the run is asked for them.
        channels: Clocks of the channels between two models.
        coupling: How they are coupled, for the result.
    """

    models: Models
    participants: dict[Role, Participant]
    modes: ModeTable | None
    channels: Sequence[MessageClock] = ()
    coupling: dict[str, Any] | None = None


def run_structure(world: MPI.Comm, request: StructureInput) -> None:
    """Run one solver on a structure and write its results; collective over ``world``.

    Raises:
        AgreedError: Input or mesh that does not fit; on every rank.
        EnergyError: Energies that do not balance; on every rank.
    """
    start = time.perf_counter()
    pulses = agreed(world, lambda: pulses_of(request.loads))
    divided = divided_structure(world, request) if request.coupled else None
    ranks = place(world, divided, request) if divided else Plan(shared(("structure",), world.size), {}, {})
    with Communicators(world, ranks.placement) as comms:
        if divided is None:
            started = start_one(comms, request, pulses)
        else:
            started = start_two(comms, request, pulses, divided, ranks.cells)
        models, participants = started.models, started.participants
        outputs = make_outputs(comms, models, request, pulses)
        stopwatch = Stopwatch({role: model.body.shared.clock for role, model in models.items()}, started.channels)
        ready = time.perf_counter()
        output_seconds = run_time_loop(comms.world, participants, outputs, stopwatch)
        seconds = time.perf_counter() - ready - output_seconds
        first = outputs.checkpoints.continued or 0
        balance = ranks.summary | stopwatch.summary(comms.world, next(iter(participants.values())).plan.windows - first)
        timings = Timings(ready - start, seconds, output_seconds, balance, first)
        peaks = element_peaks(comms.world, outputs.fields.values(), next(iter(models.values())).tables.part_names)
        motion = next(iter(participants.values())).motion
        cost = motion.factor.cost if isinstance(motion, ImplicitMotion) else None
        found = Found(outputs.history, started.modes, peaks, cost, started.coupling)
        write_result(comms, request, models, found, timings)
        agreed(comms.world, lambda: None)


def place(world: MPI.Comm, divided: DividedStructure, request: StructureInput) -> Plan:
    """Choose which ranks carry which model and which cells, and say so; collective."""
    coupling = divided.rules.coupling
    assert isinstance(coupling, LayerCoupling)
    treatment = Treatment(request.structure.formulation, request.dynamics.kinematics)
    loads = loads_of(divided, request.layer_materials, treatment)
    ranks = Ranks(total=world.size, placement=coupling.placement, macro=coupling.macro_ranks)
    return plan_ranks(world, loads, ranks, request.checkpoints, divided.scheme)


def start_one(comms: Communicators, request: StructureInput, pulses: dict[str, Pulse]) -> Started:
    """Return the only model, and its natural modes if the run is asked for them; collective."""
    comm = comms.models["structure"]
    model = build_structure(comm, request, pulse_durations(pulses))
    modes = find_modes(comm, model, request)
    return Started({"structure": model}, {"structure": make_participant(comm, model, request, pulses)}, modes)


def start_two(
    comms: Communicators,
    request: StructureInput,
    pulses: dict[str, Pulse],
    divided: DividedStructure,
    cells: Mapping[Role, NDArray[np.int32]],
) -> Started:
    """Return the coupled models of this rank; ``cells`` are those of ``planner.Plan``; collective."""
    models = build_coupled(comms, divided, request, cells)
    participants, channels, checked = couple_models(comms, models, request, pulses, divided.scheme)
    return Started(models, participants, None, channels, divided.coupling | recorded(checked))


def make_outputs(comms: Communicators, models: Models, request: StructureInput, pulses: dict[str, Pulse]) -> Outputs:
    """Open the files of a run, and name what its checkpoints depend on; collective."""
    yields = bool(plastic_laws(request.layer_materials))
    fields = {}
    for role, model in models.items():
        part = model.tables.part[model.body.local.cell_numbers]
        fields[role] = Fields(comms.models[role], model.body, part, request.output / f"{role}.pvd", yields)
    tables = [Path(load.table) for load in request.loads.values() if load.table is not None]
    inputs = request.computed, next(iter(models.values())).steps.plan, digest_of_files(request.mesh, *tables)
    numerics = request.dynamics.numerics
    checkpoints = Checkpoints(comms.world, request.checkpoints, inputs, numerics.checkpoint_seconds)
    history = make_history(comms.world, models, request, pulses)
    return Outputs(history, fields, numerics.field_samples, checkpoints)


def make_history(world: MPI.Comm, models: Models, request: StructureInput, pulses: dict[str, Pulse]) -> History:
    """Return the empty history of this run, with the value of each load as ``load@<name>``."""
    steps = next(iter(models.values())).steps
    # The balance is exact at any step, so that there is no energy too small to be judged.
    balance = EnergyBalance(request.dynamics.numerics.energy_balance_limit, 0.0, steps.plan.step, steps.smallest)
    signals = {f"load@{name}": pulse.value for name, pulse in pulses.items()}
    watches = {role: PointWatch(model.tables.watch, model.body) for role, model in models.items()}
    return History(world, watches, balance, signals)
