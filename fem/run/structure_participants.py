"""The participants of a structure's run: one model by either solver, or two that are coupled."""

from collections.abc import Mapping

import numpy as np
from mpi4py import MPI

from reflowshock.fem.coupling.participants import CoupledRun, couple
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.division.division import SchemeName
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.dynamics.participant import Alone, explicit_motion
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.loads.load import Load
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.loads.structure_loads import damping_loads, structure_loads
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.setup.structure_model import StructureModel

Pulses = Mapping[str, Pulse]


def make_participant(comm: MPI.Comm, model: StructureModel, request: StructureInput, pulses: Pulses) -> Alone:
    """Return the only model with its loads and initial velocity, ready to move; collective."""
    motion = make_motion(comm, model, request, loads_of(comm, model, request, pulses))
    launch(motion, request)
    return Alone(motion, model.steps.plan)


def couple_models(
    comms: Communicators,
    models: Mapping[Role, StructureModel],
    request: StructureInput,
    pulses: Pulses,
    scheme: SchemeName,
) -> CoupledRun:
    """Return the coupled models of this rank, ready to move; collective."""
    bodies = {role: model.body for role, model in models.items()}
    loads = {role: loads_of(comms.models[role], model, request, pulses) for role, model in models.items()}
    plan = next(iter(models.values())).steps.plan
    participants = couple(comms, bodies, loads, plan, scheme_of(scheme))
    for participant in participants.participants.values():
        launch(participant.motion, request)
    return participants


def loads_of(comm: MPI.Comm, model: StructureModel, request: StructureInput, pulses: Pulses) -> list[Load]:
    """Return the loads and the damping of a model; collective over its ranks."""
    loads = structure_loads(comm, model.body, model.tables, request, pulses)
    return loads + damping_loads(request.dynamics.damping, model.body)


def launch(motion: Motion, request: StructureInput) -> None:
    """Give a motion its initial velocity, if there is one."""
    if any(request.dynamics.initial_velocity):
        motion.launch(np.array(request.dynamics.initial_velocity))


def make_motion(comm: MPI.Comm, model: StructureModel, request: StructureInput, loads: list[Load]) -> Motion:
    """Return the motion from rest by the run's solver; collective.

    Raises:
        AgreedError: There is nothing to solve for; on every rank.
    """
    step = model.steps.plan.step
    if request.solver != "implicit":
        return explicit_motion(model.body, loads, step)
    try:
        return ImplicitMotion(comm, model.body, loads, step, request.dynamics.numerics.hht_alpha)
    except ValueError as error:  # of what all ranks know alike
        raise AgreedError(f"implicit solver: {error}") from error
