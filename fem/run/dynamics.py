"""One run of a package or a structure, from its meshes to its results: what every rank does, in order."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.coupling.participants import CoupledRun, couple
from reflowshock.fem.coupling.planner import Plan, plan_ranks, works_of
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.coupling.self_check import recorded
from reflowshock.fem.coupling.stopwatch import Stopwatch
from reflowshock.fem.dynamics.energy_balance import EnergyBalance
from reflowshock.fem.dynamics.history import History, Signal, Watch
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.dynamics.participant import Alone, Participant, explicit_motion
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import FactorCost
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.output.fields import Fields, element_peaks
from reflowshock.fem.output.result import Outcome, Report, Timings, write_result
from reflowshock.fem.output.structure_modes import ModeTable
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.checkpoint import Checkpoints
from reflowshock.fem.parallel.checkpoint_files import digest_of_files
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import RunInput, StructureInput
from reflowshock.fem.run.time_loop import Outputs, Pictures, run_time_loop
from reflowshock.fem.setup.models import Divided, Model
from reflowshock.materials.roles import materials_of_parts

Models = Mapping[Role, Model[Any]]


class DynamicProblem(Protocol):
    """What moves: a package on a board, or a structure. All methods but properties are collective."""

    @property
    def request(self) -> RunInput | StructureInput:
        """Return the input."""

    @property
    def divided(self) -> Divided[Any] | None:
        """Return the models before they are distributed; None for one model that DOLFINx distributes."""

    @property
    def signals(self) -> Mapping[str, Signal]:
        """Return functions of time that belong to the history, by name."""

    @property
    def report(self) -> Report:
        """Return what the result tells of it."""

    def place(self, world: MPI.Comm) -> Plan:
        """Choose which ranks carry which model and which cells."""

    def build(self, comms: Communicators, cells: Mapping[Role, NDArray[np.int32]]) -> tuple[Models, Steps]:
        """Return the models of this rank and the steps of the run; ``cells`` are those of ``Plan``."""

    def loads(self, comm: MPI.Comm, model: Model[Any], steps: Steps) -> list[Load]:
        """Return the loads and the damping of a model."""

    def watch(self, model: Model[Any]) -> Watch:
        """Return the watch points of a model."""

    def trivial_energy(self, steps: Steps) -> float:
        """Return the energy [J] below which a balance is not judged."""

    def pictures(self, world: MPI.Comm, models: Models, steps: Steps) -> Sequence[Pictures]:
        """Return what is taken at windows of its own."""

    @property
    def is_over(self) -> Callable[[History], bool] | None:
        """Return what says of the history so far whether the run is over before its end; None where nothing does."""

    def find_modes(self, comms: Communicators, models: Models, steps: Steps) -> ModeTable | None:
        """Return the natural modes, if the run is asked for them."""


def run_dynamics(world: MPI.Comm, problem: DynamicProblem) -> None:
    """Run a problem and write its results; collective over ``world``.

    Raises:
        AgreedError: Input or mesh that does not fit; on every rank.
        RankError: Too few or too many ranks; on every rank.
        EnergyError: Energies that do not balance; on every rank.
    """
    start = time.perf_counter()
    plan = problem.place(world)
    with Communicators(world, plan.placement) as comms:
        models, steps = problem.build(comms, plan.cells)
        modes = problem.find_modes(comms, models, steps)
        participants, clocks, checked = make_participants(comms, problem, models, steps)
        outputs = make_outputs(comms, problem, models, steps)
        stopwatch = Stopwatch({role: model.body.shared.clock for role, model in models.items()}, clocks)
        ready = time.perf_counter()
        windows, output_seconds = run_time_loop(comms.world, participants, outputs, stopwatch)
        steps = replace(steps, plan=replace(steps.plan, windows=windows))
        seconds = time.perf_counter() - ready - output_seconds
        first = outputs.checkpoints.continued or 0
        balance = plan.summary | stopwatch.summary(comms.world, steps.plan.windows - first)
        timings = Timings(ready - start, seconds, output_seconds, balance, first)
        outcome = Outcome(
            models=models,
            steps=steps,
            history=outputs.history,
            peaks=element_peaks(comms.world, outputs.fields.values(), part_names(models)),
            coupling=(problem.divided.coupling if problem.divided else {}) | recorded(checked),
            modes=modes,
            factor=factor_cost(participants),
        )
        write_result(comms, problem.report, outcome, timings)
        for pictures in outputs.pictures:
            pictures.write(problem.request.output)
        agreed(comms.world, lambda: None)


def place(world: MPI.Comm, divided: Divided[Any], request: RunInput | StructureInput) -> Plan:
    """Choose which ranks carry which of the divided models and which cells, and say so; collective."""
    works, ranks = works_of(divided, request), request.ranks(world.size)
    return plan_ranks(world, works, ranks, request.checkpoints, divided.scheme)


def make_participants(comms: Communicators, problem: DynamicProblem, models: Models, steps: Steps) -> CoupledRun:
    """Return the participants of this rank, ready to move; collective."""
    bodies = {role: model.body for role, model in models.items()}
    loads = {role: problem.loads(comms.models[role], model, steps) for role, model in models.items()}
    if problem.divided and problem.request.coupled:
        scheme = scheme_of(problem.divided.scheme, problem.divided.rules.coupling.direction)
        made = couple(comms, bodies, loads, steps.plan, scheme)
    else:
        [(role, body)] = bodies.items()
        motion = make_motion(comms.models[role], body, loads[role], steps.plan.step, problem.request)
        made = CoupledRun({role: Alone(motion, steps.plan)}, [])
    for participant in made.participants.values():
        if any(problem.request.initial_velocity):
            participant.motion.launch(np.array(problem.request.initial_velocity))
    return made


def make_motion(
    comm: MPI.Comm, body: Body, loads: list[Load], step: float, request: RunInput | StructureInput
) -> Motion:
    """Return the motion from rest of one model by the run's solver; collective.

    Raises:
        AgreedError: There is nothing to solve for; on every rank.
    """
    if not request.implicit:
        return explicit_motion(body, loads, step)
    try:
        return ImplicitMotion(comm, body, loads, step, request.hht_alpha)
    except ValueError as error:  # of what all ranks know alike
        raise AgreedError(f"implicit solver: {error}") from error


def make_outputs(comms: Communicators, problem: DynamicProblem, models: Models, steps: Steps) -> Outputs:
    """Open the files of a run, and name what its checkpoints depend on; collective."""
    request, numerics = problem.request, problem.request.numerics
    inputs = request.computed, steps.plan, digest_of_files(*request.files)
    return Outputs(
        history=make_history(comms.world, problem, models, steps),
        fields=make_fields(comms, models, request),
        field_samples=numerics.field_samples,
        checkpoints=Checkpoints(comms.world, request.checkpoints, inputs, numerics.checkpoint_seconds),
        pictures=problem.pictures(comms.world, models, steps),
        is_over=problem.is_over,
    )


def make_history(world: MPI.Comm, problem: DynamicProblem, models: Models, steps: Steps) -> History:
    """Return the empty history of this run."""
    limit, trivial = problem.request.numerics.energy_balance_limit, problem.trivial_energy(steps)
    balance = EnergyBalance(limit, trivial, steps.plan.step, steps.smallest)
    watches = {role: problem.watch(model) for role, model in models.items()}
    return History(world, watches, balance, problem.signals)


def make_fields(comms: Communicators, models: Models, request: RunInput | StructureInput) -> dict[Role, Fields]:
    """Open a field file per model of this rank; collective."""
    _, materials = materials_of_parts(part_names(models), request.part_materials)
    yields = any(material.plasticity is not None for material in materials)
    made = {}
    for role, model in models.items():
        part = model.tables.part[model.body.local.cell_numbers]
        made[role] = Fields(comms.models[role], model.body, part, request.output / f"{role}.pvd", yields)
    return made


def part_names(models: Models) -> tuple[str, ...]:
    """Return the names of the parts, which all models of a run have."""
    return next(iter(models.values())).tables.part_names


def factor_cost(participants: Mapping[Role, Participant]) -> FactorCost | None:
    """Return what the factorisation of an implicit solver took, None for an explicit one."""
    motion = next(iter(participants.values())).motion
    return motion.factor.cost if isinstance(motion, ImplicitMotion) else None
