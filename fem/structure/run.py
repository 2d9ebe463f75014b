"""One run of a structure, from its mesh to its results: what every rank does, in order."""

import time
from pathlib import Path

import numpy as np
from mpi4py import MPI

from fem.agreement import agreed
from fem.checkpoint import Checkpoints
from fem.checkpoint_files import digest_of_files
from fem.communicators import Communicators
from fem.coupling.placement import shared
from fem.coupling.stopwatch import Stopwatch
from fem.errors import AgreedError
from fem.fields import Fields
from fem.history import History
from fem.implicit import ImplicitMotion
from fem.inputs import StructureInput
from fem.ledger import Ledger
from fem.loads import Load
from fem.march import Outputs, march
from fem.materials.effects import plastic_laws
from fem.moving import Moving
from fem.participant import Alone, uncut_motion
from fem.pulse import Pulse
from fem.result import Timings
from fem.structure.loads import damping_loads, structure_loads
from fem.structure.model import StructureModel, build_structure
from fem.structure.modes import find_modes
from fem.structure.pulses import pulse_durations, pulses_of
from fem.structure.result import Found, element_peaks, write_result
from fem.watch_points import PointWatch


def run_structure(world: MPI.Comm, request: StructureInput) -> None:
    """Run one solver on a structure and write its results; collective over ``world``.

    Raises:
        AgreedError: Input or mesh that does not fit; on every rank.
        EnergyError: Energies that do not balance; on every rank.
    """
    start = time.perf_counter()
    pulses = agreed(world, lambda: pulses_of(request.loads))
    with Communicators(world, shared(("structure",), world.size)) as comms:
        comm = comms.models["structure"]
        model = build_structure(comm, request, pulse_durations(pulses))
        modes = find_modes(comm, model, request)
        structure = make_participant(comm, model, request, pulses)
        outputs = make_outputs(comm, model, request, pulses)
        stopwatch = Stopwatch({"structure": model.body.shared.clock})
        ready = time.perf_counter()
        output_seconds = march(comm, {"structure": structure}, outputs, stopwatch)
        seconds = time.perf_counter() - ready - output_seconds
        first = outputs.checkpoints.continued or 0
        balance = stopwatch.summary(comm, model.steps.plan.windows - first)
        timings = Timings(ready - start, seconds, output_seconds, balance, first)
        peaks = element_peaks(comm, outputs.fields["structure"], model.tables.part_names)
        cost = structure.motion.factor.cost if isinstance(structure.motion, ImplicitMotion) else None
        write_result(comm, request, model, Found(outputs.history, modes, peaks, cost), timings)
        agreed(comm, lambda: None)


def make_participant(comm: MPI.Comm, model: StructureModel, request: StructureInput, pulses: dict[str, Pulse]) -> Alone:
    """Return the structure with its loads and initial velocity, ready to move; collective."""
    loads = structure_loads(comm, model.body, model.tables, request, pulses)
    loads += damping_loads(request.dynamics.damping, model.body)
    plan, motion = model.steps.plan, make_motion(comm, model, request, loads)
    if any(request.dynamics.initial_velocity):
        motion.launch(np.array(request.dynamics.initial_velocity))
    return Alone(motion, plan)


def make_motion(comm: MPI.Comm, model: StructureModel, request: StructureInput, loads: list[Load]) -> Moving:
    """Return the motion from rest by the run's solver; collective.

    Raises:
        AgreedError: There is nothing to solve for; on every rank.
    """
    step = model.steps.plan.step
    if request.solver == "explicit":
        return uncut_motion(model.body, loads, step)
    try:
        return ImplicitMotion(comm, model.body, loads, step, request.dynamics.numerics.hht_alpha)
    except ValueError as error:  # of what all ranks know alike
        raise AgreedError(f"implicit solver: {error}") from error


def make_outputs(comm: MPI.Comm, model: StructureModel, request: StructureInput, pulses: dict[str, Pulse]) -> Outputs:
    """Open the files of a run, and name what its checkpoints depend on; collective."""
    part = model.tables.part[model.body.local.cell_numbers]
    yields = bool(plastic_laws(request.layer_materials))
    fields = Fields(comm, model.body, part, request.output / "structure.pvd", yields)
    tables = [Path(load.table) for load in request.loads.values() if load.table is not None]
    inputs = request.computed, model.steps.plan, digest_of_files(request.mesh, *tables)
    numerics = request.dynamics.numerics
    checkpoints = Checkpoints(comm, request.checkpoints, inputs, numerics.checkpoint_seconds)
    history = make_history(comm, model, request, pulses)
    return Outputs(history, {"structure": fields}, numerics.field_samples, checkpoints)


def make_history(comm: MPI.Comm, model: StructureModel, request: StructureInput, pulses: dict[str, Pulse]) -> History:
    """Return the empty history of this run, with the value of each load as ``load@<name>``."""
    plan, steps = model.steps.plan, model.steps
    # The balance is exact at any step, so that there is no energy too small to be judged.
    ledger = Ledger(request.dynamics.numerics.energy_balance_limit, 0.0, plan.step, steps.cut)
    signals = {f"load@{name}": pulse.value for name, pulse in pulses.items()}
    return History(comm, {"structure": PointWatch(model.tables.watch, model.body)}, ledger, signals)
