"""Dynamic run of a package or a structure, from its meshes to its results, as every rank executes it."""

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
from reflowshock.fem.dynamics.participant import Participant, SingleModel, explicit_motion
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.loads.damping import WindowDrag
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
from reflowshock.fem.setup.models import DividedModels, Model
from reflowshock.materials.roles import materials_of_parts

Models = Mapping[Role, Model[Any]]


class DynamicProblem(Protocol):
    """Problem of a dynamic run: a package on a board, or a structure; methods are collective, properties are not."""

    @property
    def request(self) -> RunInput | StructureInput:
        """Input of the run."""

    @property
    def divided(self) -> DividedModels[Any] | None:
        """Models before distribution, None for a single model that DOLFINx distributes."""

    @property
    def signals(self) -> Mapping[str, Signal]:
        """Functions of time that are recorded in the history, by name."""

    @property
    def report(self) -> Report:
        """Report of the problem in the result file."""

    def place(self, world: MPI.Comm) -> Plan:
        """Assign models and cells to ranks."""

    def build(self, comms: Communicators, cells: Mapping[Role, NDArray[np.int32]]) -> tuple[Models, Steps]:
        """Return the models of this rank and the time steps of the run; ``cells`` is the attribute of ``Plan``."""

    def loads(self, comm: MPI.Comm, model: Model[Any], steps: Steps) -> list[Load]:
        """Return the loads and the damping of a model."""

    def watch(self, model: Model[Any]) -> Watch:
        """Return the watch points of a model."""

    def trivial_energy(self, steps: Steps) -> float:
        """Return the energy below which the balance is not checked [J]."""

    def pictures(self, world: MPI.Comm, models: Models, steps: Steps) -> Sequence[Pictures]:
        """Return the snapshots taken at windows chosen by the problem."""

    @property
    def is_over(self) -> Callable[[History], bool] | None:
        """Function that decides from the history whether the run ends early; None if it never does."""

    def find_modes(self, comms: Communicators, models: Models, steps: Steps) -> ModeTable | None:
        """Return the natural modes if the input requests them, otherwise None."""


def run_dynamics(world: MPI.Comm, problem: DynamicProblem) -> None:
    """Run a problem in time and write its results to its output folder; collective over ``world``.

    Args:
        world: Communicator of all ranks.
        problem: Package drop or structure, read and divided.

    Raises:
        AgreedError: The input or a mesh does not fit; on every rank.
        RankError: The number of ranks does not suit the problem; on every rank.
        EnergyError: The energy balance is violated; on every rank.
        InvertedElementError: An element is inverted; only on the rank that has it.
    """
    start = time.perf_counter()
    plan = problem.place(world)
    with Communicators(world, plan.placement) as comms:
        models, steps = problem.build(comms, plan.cells)
        modes = problem.find_modes(comms, models, steps)
        participants, clocks, checked = make_participants(comms, problem, models, steps)
        outputs = _make_outputs(comms, problem, models, steps)
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
            peaks=element_peaks(comms.world, outputs.fields.values(), _part_names(models)),
            coupling=(problem.divided.coupling if problem.divided else {}) | recorded(checked),
            modes=modes,
            factor=_factor_cost(participants),
        )
        write_result(comms, problem.report, outcome, timings)
        for pictures in outputs.pictures:
            pictures.write(problem.request.output)
        agreed(comms.world, lambda: None)


def place_models(world: MPI.Comm, divided: DividedModels[Any], request: RunInput | StructureInput) -> Plan:
    """Assign the divided models and their cells to ranks, and print the assignment; collective.

    Args:
        world: Communicator of all ranks.
        divided: Meshes (on rank 0) and tables of the models.
        request: Input, with ranks, placement and checkpoint folder, in which measured costs are stored.

    Returns:
        Ranks of each model, rank of each cell (on rank 0), and the prediction for the result file.
    """
    works, ranks = works_of(divided, request), request.ranks(world.size)
    return plan_ranks(world, works, ranks, request.checkpoints, divided.scheme)


def make_participants(comms: Communicators, problem: DynamicProblem, models: Models, steps: Steps) -> CoupledRun:
    """Create the participants (models with loads, motion and coupling) of this rank at time zero; collective.

    Args:
        comms: Communicators of the run and of its models.
        problem: Package drop or structure, which builds the loads.
        models: Models of this rank.
        steps: Time steps of the run.

    Returns:
        Participants in the order of their turns, clocks of their channels, and the self-check (None for one model).
    """
    bodies = {role: model.body for role, model in models.items()}
    loads = {role: problem.loads(comms.models[role], model, steps) for role, model in models.items()}
    if problem.divided and problem.request.coupled:
        scheme = scheme_of(problem.divided.scheme, problem.divided.rules.coupling.direction)
        coupled = couple(comms, bodies, loads, steps.plan, scheme)
    else:
        [(role, body)] = bodies.items()
        single, plan = loads[role], steps.plan
        if not problem.request.implicit:
            single = WindowDrag.once_a_window(single, plan.substeps, plan.window)
        motion = _make_motion(comms.models[role], body, single, plan.step, problem.request)
        coupled = CoupledRun({role: SingleModel(motion, steps.plan)}, [])
    for participant in coupled.participants.values():
        if any(problem.request.initial_velocity):
            participant.motion.launch(np.array(problem.request.initial_velocity))
    return coupled


def _make_motion(
    comm: MPI.Comm, body: Body, loads: list[Load], step: float, request: RunInput | StructureInput
) -> Motion:
    """Return the motion of a single model for the run's solver, starting at rest; collective.

    Raises:
        AgreedError: The implicit solver does not support the model; on every rank.
    """
    if not request.implicit:
        return explicit_motion(body, loads, step)
    try:
        return ImplicitMotion(comm, body, loads, step, request.hht_alpha)
    except ValueError as error:  # raised on every rank
        raise AgreedError(f"implicit solver: {error}") from error


def _make_outputs(comms: Communicators, problem: DynamicProblem, models: Models, steps: Steps) -> Outputs:
    """Open the output files of a run and identify the inputs of its checkpoints; collective."""
    request, numerics = problem.request, problem.request.numerics
    inputs = request.computed, steps.plan, digest_of_files(*request.files)
    return Outputs(
        history=make_history(comms.world, problem, models, steps),
        fields=_make_fields(comms, models, request),
        field_samples=numerics.field_samples,
        checkpoints=Checkpoints(comms.world, request.checkpoints, inputs, numerics.checkpoint_seconds),
        pictures=problem.pictures(comms.world, models, steps),
        is_over=problem.is_over,
    )


def make_history(world: MPI.Comm, problem: DynamicProblem, models: Models, steps: Steps) -> History:
    """Return an empty history with the watch points of this rank and the limit of the energy balance.

    Args:
        world: Communicator of all ranks.
        problem: Package drop or structure, with watch points and functions of time to record.
        models: Models of this rank.
        steps: Time steps of the run.
    """
    limit, trivial = problem.request.numerics.energy_balance_limit, problem.trivial_energy(steps)
    balance = EnergyBalance(limit, trivial, steps.plan.step, steps.smallest)
    watches = {role: problem.watch(model) for role, model in models.items()}
    return History(world, watches, balance, problem.signals)


def _make_fields(comms: Communicators, models: Models, request: RunInput | StructureInput) -> dict[Role, Fields]:
    """Open one field file for each model of this rank; collective."""
    _, materials = materials_of_parts(_part_names(models), request.part_materials)
    yields = any(material.plasticity is not None for material in materials)
    fields = {}
    for role, model in models.items():
        part = model.tables.part[model.body.local.cell_numbers]
        fields[role] = Fields(comms.models[role], model.body, part, request.output / f"{role}.pvd", yields)
    return fields


def _part_names(models: Models) -> tuple[str, ...]:
    """Return the names of the parts, which are the same in all models of a run."""
    return next(iter(models.values())).tables.part_names


def _factor_cost(participants: Mapping[Role, Participant]) -> FactorCost | None:
    """Return the factorisation cost of an implicit solver, None for an explicit one."""
    motion = next(iter(participants.values())).motion
    return motion.factor.cost if isinstance(motion, ImplicitMotion) else None
