"""One shock run, from meshes to results: what every rank does, in order."""

import time
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from reflowshock.fem.coupling.participants import CoupledRun, couple
from reflowshock.fem.coupling.planner import Plan, loads_of, plan_ranks
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.coupling.self_check import recorded
from reflowshock.fem.coupling.stopwatch import Stopwatch
from reflowshock.fem.division.checks import check_pulses
from reflowshock.fem.division.division import SchemeName
from reflowshock.fem.division.whole import Treatment
from reflowshock.fem.dynamics.energy_balance import EnergyBalance
from reflowshock.fem.dynamics.history import History
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.participant import Alone, explicit_motion
from reflowshock.fem.estimates.estimate import WindowPlan, implicit_plan, largest_implicit_step, shortened
from reflowshock.fem.estimates.placement import check_size
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.loads.shock_loads import shock_loads
from reflowshock.fem.loads.shock_pulse import shock_pulse
from reflowshock.fem.loads.structure_pulses import pulse_durations
from reflowshock.fem.materials.elasticity import materials_of_parts
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.output.fields import Fields, element_peaks
from reflowshock.fem.output.joint_interface import JointInterfaceStress, picture_windows
from reflowshock.fem.output.result import Found, Timings, write_result
from reflowshock.fem.output.watch_joints import JointWatch
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.checkpoint import Checkpoints
from reflowshock.fem.parallel.checkpoint_files import digest_of_files
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.shock import Shock
from reflowshock.fem.run.time_loop import Outputs, run_time_loop
from reflowshock.fem.setup.shock_models import Divided, Model, build_models, divided_package

SPEEDS = 201  # times at which the largest velocity of the table is looked for
NON_TRIVIAL = 1e-4  # of the energy that the pulse gives a free body: from there on the balance is judged


def run(world: MPI.Comm, request: RunInput) -> None:
    """Run one shock and write its results; collective over ``world``.

    Raises:
        AgreedError: Input or mesh that does not fit; on every rank.
        RankError: Too few or too many ranks; on every rank.
        EnergyError: Energies that do not balance; on every rank.
    """
    start = time.perf_counter()
    if request.mode == "two_scale":
        check_size(request.shock.ranks, world.size)
    divided = divided_package(world, request)
    pulse = agreed(world, lambda: pulse_of(request, divided.steps.plan.window))
    ranks = place(world, divided, request)
    with Communicators(world, ranks.placement) as comms:
        models, steps = build_models(comms, divided, request, ranks.cells)
        steps = planned(steps, request, pulse)
        participants, channels, checked = make_participants(comms, models, (steps, divided.scheme), request.shock)
        stopwatch = Stopwatch({role: model.body.shared.clock for role, model in models.items()}, channels)
        history = make_history(comms, models, steps, pulse, request)
        numerics, fields = request.shock.numerics, make_fields(comms, models, request)
        inputs = request.computed, steps.plan, digest_of_files(*request.files)
        checkpoints = Checkpoints(comms.world, request.checkpoints, inputs, numerics.checkpoint_seconds)
        pictures = make_pictures(comms, models, steps.plan, request.shock)
        outputs = Outputs(history, fields, numerics.field_samples, checkpoints, pictures)
        ready = time.perf_counter()
        output_seconds = run_time_loop(comms.world, participants, outputs, stopwatch)
        seconds = time.perf_counter() - ready - output_seconds
        first = checkpoints.continued or 0
        balance = ranks.summary | stopwatch.summary(comms.world, steps.plan.windows - first)
        timings = Timings(ready - start, seconds, output_seconds, balance, first)
        coupling = divided.coupling | recorded(checked)
        peaks = element_peaks(comms.world, fields.values(), next(iter(models.values())).tables.part_names)
        write_result(comms, request, (models, steps, coupling), Found(history, peaks), timings)
        for some in pictures:
            some.write(request.output)
        agreed(comms.world, lambda: None)


def pulse_of(request: RunInput, window: float) -> Pulse:
    """Return the pulse of a run whose window is given [s]; errors as ``shock_pulse`` and ``check_pulses``."""
    pulse = shock_pulse(request.shock).pulse
    if request.mode == "two_scale":
        check_pulses(pulse_durations({"drop": pulse}), window, request.shock.numerics.step_fraction)
    return pulse


def planned(steps: Steps, request: RunInput, pulse: Pulse) -> Steps:
    """Return the steps of a run that may be implicit, and of a DNS that may end early."""
    if request.mode == "dns" and request.shock.numerics.dns_duration is not None:
        steps = replace(steps, plan=shortened(steps.plan, request.shock.numerics.dns_duration))
    if not request.implicit:
        return steps
    largest = largest_implicit_step(request.shock.duration, pulse_durations({"drop": pulse}))
    return replace(steps, plan=implicit_plan(steps.plan, largest))


def place(world: MPI.Comm, divided: Divided, request: RunInput) -> Plan:
    """Choose which ranks carry which model and which cells, and say so; collective."""
    numerics = request.shock.numerics
    treatment = Treatment(numerics.formulation, numerics.decided_kinematics)
    loads = loads_of(divided, request.materials, treatment)
    return plan_ranks(world, loads, request.shock.ranks, request.checkpoints, divided.scheme)


def make_participants(
    comms: Communicators, models: dict[Role, Model], chosen: tuple[Steps, SchemeName], shock: Shock
) -> CoupledRun:
    """Return the participants of this rank, from the steps of the run and its scheme; collective."""
    steps, name = chosen
    plan, mass = steps.plan, steps.model_mass + steps.added_mass
    bodies = {role: model.body for role, model in models.items()}
    loads = {
        role: shock_loads(comms.models[role], mass, model.body, model.tables, shock) for role, model in models.items()
    }
    if "dns" not in bodies:
        return couple(comms, bodies, loads, plan, scheme_of(name, shock.coupling.direction))
    model = bodies["dns"], loads["dns"], plan.step
    implicit = shock.numerics.dns_solver == "implicit"
    motion = ImplicitMotion(comms.models["dns"], *model) if implicit else explicit_motion(*model)
    return CoupledRun({"dns": Alone(motion, plan)}, [])


def make_history(
    comms: Communicators, models: dict[Role, Model], steps: Steps, pulse: Pulse, request: RunInput
) -> History:
    """Return the empty history of this run."""
    shock, yields = request.shock, request.materials.solder.plasticity is not None
    speed = max(abs(pulse.integral(time)) for time in np.linspace(0.0, shock.duration, SPEEDS))
    mass, plan = steps.model_mass + steps.added_mass, steps.plan
    trivial = NON_TRIVIAL * 0.5 * mass * speed**2
    balance = EnergyBalance(shock.numerics.energy_balance_limit, trivial, plan.step, steps.smallest)
    watches = {role: JointWatch(model.tables.watch, model.body, yields) for role, model in models.items()}
    return History(comms.world, watches, balance, {"base_acceleration": pulse.value})


def make_pictures(
    comms: Communicators, models: dict[Role, Model], plan: WindowPlan, shock: Shock
) -> list[JointInterfaceStress]:
    """Return what is taken at ``shock.picture_times``; nothing where none is given."""
    if not shock.picture_times:
        return []
    tables = {role: (model.tables.joint_interface, model.body) for role, model in models.items()}
    return [JointInterfaceStress(comms.world, tables, picture_windows(shock.picture_times, plan))]


def make_fields(comms: Communicators, models: dict[Role, Model], request: RunInput) -> dict[Role, Fields]:
    """Open a field file per model of this rank; collective."""
    made = {}
    for role, model in models.items():
        _, materials = materials_of_parts(model.tables.part_names, request.materials)
        yields = any(material.plasticity is not None for material in materials)
        part = model.tables.part[model.body.local.cell_numbers]
        made[role] = Fields(comms.models[role], model.body, part, request.output / f"{role}.pvd", yields)
    return made
