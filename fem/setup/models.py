"""The models of a run on each rank: divided on rank 0, distributed, given their materials, assembled."""

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
from reflowshock.fem.model.assembly import ForceOptions, Pieces, make_body, make_pieces
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.problem.inputs import RunInput, StructureInput
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.fem.statics.initial_state import InitialState


@dataclass(frozen=True, slots=True)
class Model(Generic[TablesT_co]):
    """One model on one rank, before it moves."""

    tables: TablesT_co
    body: Body


@dataclass(frozen=True, slots=True)
class Divided(Generic[TablesT_co]):
    """The models of a run before they are distributed.

    Attributes:
        meshes: Mesh of each model, on rank 0.
        tables: Their tables, on every rank.
        mass_factors: Factor ``(ne,)`` on the density of the cells of each, on every rank.
        steps: Their steps.
        rules: What their division followed.
        scheme: How they are coupled.
        coupling: What the result tells of it.
        initial: How its models begin, None from rest without stress.
    """

    meshes: Mapping[Role, MeshData]
    tables: Mapping[Role, TablesT_co]
    mass_factors: Mapping[Role, NDArray[np.float64]]
    steps: Steps
    rules: Rules
    scheme: SchemeName
    coupling: dict[str, Any]
    initial: InitialState | None = None


def treatment_of(request: RunInput | StructureInput) -> Treatment:
    """Return how a run computes its elements."""
    step = request.numerics.mass_scaled_step if isinstance(request, RunInput) else None
    return Treatment(request.formulation, request.kinematics, request.numerics.mass_scaled, step or np.inf)


def divided_on_root(world: MPI.Comm, divided: Callable[[], Divided[TablesT_co]]) -> Divided[TablesT_co]:
    """Divide on rank 0, and tell the other ranks all but the meshes; collective, errors of rank 0 on every rank."""
    found = agreed(world, lambda: divided() if world.rank == 0 else None)
    shared: Divided[TablesT_co] = world.bcast(replace(found, meshes={}) if found else None)
    return found or shared


def distributed(
    comms: Communicators,
    divided: Divided[TablesT_co],
    ranks: Mapping[Role, NDArray[np.int32]],
    request: RunInput | StructureInput,
) -> dict[Role, Pieces]:
    """Distribute the models, and give the elements of this rank their materials; collective.

    Args:
        comms: Communicators.
        divided: The models.
        ranks: On rank 0, of each model on several ranks, the rank ``(ne,)`` of each cell.
        request: The input.
    """
    given = hand_over(comms, divided, ranks)
    mine = next(iter(divided.meshes.values()), None)
    dolfinx_api.compile_ahead(comms.world, mine.points[mine.cells[0]] if mine else None)
    meshes = {role: distribute(comms.models[role], *mesh) for role, mesh in given.items()}

    def pieces_of(role: Role) -> Pieces:
        return make_pieces(meshes[role], divided.tables[role], request.part_materials, request.formulation)

    return agreed(comms.world, lambda: {role: pieces_of(role) for role in meshes})


def assembled(
    comms: Communicators, divided: Divided[TablesT_co], pieces: Mapping[Role, Pieces], kinematics: Kinematics
) -> dict[Role, Body]:
    """Assemble the bodies of this rank's models, each for its step; collective."""
    bodies = {}
    for role, own in pieces.items():
        factor = divided.mass_factors[role][own.local.cell_numbers]
        response = ForceOptions(kinematics, divided.steps.step_of(role), divided.rules.stiffness)
        body = make_body(comms.models[role], own, divided.tables[role], factor, response)
        bodies[role] = divided.initial.begin(role, body, own.materials) if divided.initial else body
    return bodies


Given = tuple[MeshData | None, NDArray[np.int32] | None]


def hand_over(
    comms: Communicators, divided: Divided[Tables], ranks: Mapping[Role, NDArray[np.int32]]
) -> dict[Role, Given]:
    """Return mesh and ranks of cells of this rank's models: None on all but the first that carries one; collective."""
    world = comms.world
    given: dict[Role, Given] = dict.fromkeys(comms.models, (None, None))
    for role, first in comms.first.items():
        whole = divided.meshes.get(role), ranks.get(role)
        if world.rank == 0 and first:
            world.send(whole, first)
        elif world.rank == first:
            given[role] = world.recv(source=0) if first else whole
    return given
