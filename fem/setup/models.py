"""Set-up of the models of a run: divide on rank 0, distribute, assign materials, assemble."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.division.division import Rules, SchemeName
from reflowshock.fem.division.tables import Tables, TablesT_co
from reflowshock.fem.division.whole import Treatment
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.assembly import ForceOptions, RankElements, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.parallel.waiting import wait_for_all
from reflowshock.fem.problem.inputs import RunInput, StructureInput
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.fem.statics.initial_state import InitialState


@dataclass(frozen=True, slots=True)
class Model(Generic[TablesT_co]):
    """One model on one rank.

    Attributes:
        tables: Supports, interfaces and watch points of the whole model.
        body: Nodes, elements and masses of this rank.
    """

    tables: TablesT_co
    body: Body


@dataclass(frozen=True, slots=True)
class DividedModels(Generic[TablesT_co]):
    """Models of a run before they are distributed.

    Attributes:
        meshes: Mesh of each model, on rank 0; empty on other ranks.
        tables: Tables of each model, on every rank.
        mass_factors: Factor on the density of the cells of each model, shape (ne,), on every rank.
        steps: Time steps of the models.
        rules: Rules of the division.
        scheme: Coupling scheme.
        coupling: Coupling record of the result file.
        initial: Initial displacement and stress, None for an unstressed start.
    """

    meshes: Mapping[Role, MeshData]
    tables: Mapping[Role, TablesT_co]
    mass_factors: Mapping[Role, NDArray[np.float64]]
    steps: Steps
    rules: Rules
    scheme: SchemeName
    coupling: dict[str, Any]
    initial: InitialState | None = None


def treatment_of(request: RunInput | StructureInput, mass_scaled_step: float | None = None) -> Treatment:
    """Return the element formulation, kinematics and mass scaling of a run.

    Args:
        request: Input of the run.
        mass_scaled_step: Largest critical step after mass scaling [s]; None sets no limit.

    Returns:
        Formulation of hexahedra, kinematics, material roles with mass scaling, and largest step after mass scaling [s].
    """
    numerics = request.numerics
    return Treatment(request.formulation, request.kinematics, numerics.mass_scaled, mass_scaled_step or np.inf)


def divide_on_root(world: MPI.Comm, divide: Callable[[], DividedModels[TablesT_co]]) -> DividedModels[TablesT_co]:
    """Divide the models on rank 0 and broadcast all data except the meshes; collective.

    Args:
        world: Communicator of all ranks.
        divide: Function without arguments that divides the models; called on rank 0 only.

    Returns:
        Divided models, with an empty ``meshes`` on all ranks but rank 0.

    Raises:
        AgreedError: The division failed on rank 0; on every rank.
    """
    divided = agreed(world, lambda: divide() if world.rank == 0 else None)
    shared: DividedModels[TablesT_co] = world.bcast(replace(divided, meshes={}) if divided else None)
    return divided or shared


def distribute_models(
    comms: Communicators,
    divided: DividedModels[TablesT_co],
    ranks: Mapping[Role, NDArray[np.int32]],
    request: RunInput | StructureInput,
) -> dict[Role, RankElements]:
    """Distribute the models and assign materials to the elements of this rank; collective.

    Args:
        comms: Communicators of the run and of its models.
        divided: Models before distribution.
        ranks: Rank of each cell, shape (ne,), of every model that is on several ranks; used on rank 0.
        request: Input of the run.

    Returns:
        Elements of this rank by model.
    """
    parts = _send_meshes(comms, divided, ranks)
    first_mesh = next(iter(divided.meshes.values()), None)
    dolfinx_api.compile_ahead(first_mesh.points[first_mesh.cells[0]] if first_mesh else None)
    wait_for_all(comms.world)
    meshes = {role: distribute(comms.models[role], *part) for role, part in parts.items()}

    def rank_elements_of(role: Role) -> RankElements:
        return make_rank_elements(meshes[role], divided.tables[role], request.part_materials, request.formulation)

    return agreed(comms.world, lambda: {role: rank_elements_of(role) for role in meshes})


def assemble_bodies(
    comms: Communicators,
    divided: DividedModels[TablesT_co],
    rank_elements: Mapping[Role, RankElements],
    kinematics: Kinematics,
) -> dict[Role, Body]:
    """Assemble the bodies of this rank's models with their time steps and initial stress; collective.

    Args:
        comms: Communicators of the run and of its models.
        divided: Models before distribution.
        rank_elements: Elements of this rank by model.
        kinematics: Kinematics of the elements.

    Returns:
        Bodies by model.
    """
    bodies = {}
    for role, elements in rank_elements.items():
        factor = divided.mass_factors[role][elements.local.cell_numbers]
        response = ForceOptions(kinematics, divided.steps.step_of(role), divided.rules.stiffness)
        body = make_body(comms.models[role], elements, divided.tables[role], factor, response)
        bodies[role] = divided.initial.begin(role, body, elements.materials) if divided.initial else body
    return bodies


MeshAndRanks = tuple[MeshData | None, NDArray[np.int32] | None]


def _send_meshes(
    comms: Communicators, divided: DividedModels[Tables], ranks: Mapping[Role, NDArray[np.int32]]
) -> dict[Role, MeshAndRanks]:
    """Send mesh and cell ranks of each model from rank 0 to the first rank of the model; collective.

    Returns:
        Mesh and cell ranks of this rank's models, (None, None) where this rank is not the first of the model.
    """
    world = comms.world
    received: dict[Role, MeshAndRanks] = dict.fromkeys(comms.models, (None, None))
    for role, first in comms.first.items():
        message = divided.meshes.get(role), ranks.get(role)
        if world.rank == 0 and first:
            world.send(message, first)
        elif world.rank == first:
            received[role] = world.recv(source=0) if first else message
    return received
