"""From input files to one model on each rank: read, check, distribute, choose steps, assemble."""

from dataclasses import dataclass

from fem import dolfinx_api
from fem.agreement import agreed
from fem.body import Body, Pieces, Response, make_body, make_pieces
from fem.communicators import Communicators, Role
from fem.inputs import RunInput
from fem.local_mesh import distribute
from fem.mesh import MeshData
from fem.mesh_file import read_meshes
from fem.scene import JointTables, prepare
from fem.steps import Steps, choose_steps
from fem.supports import HELD, SYMMETRY


@dataclass(frozen=True, slots=True)
class Model:
    """One model on one rank, before it moves."""

    tables: JointTables
    body: Body


def build_models(comms: Communicators, request: RunInput) -> tuple[dict[Role, Model], Steps]:
    """Read, prepare and distribute the models of this rank, and choose their steps; collective."""
    world = comms.world
    inputs = read_models(comms, request)
    mine = next((mesh for mesh, _ in inputs.values() if mesh), None) if world.rank == 0 else None
    dolfinx_api.compile_ahead(world, mine.points[mine.cells[0]] if mine else None)
    meshes = {role: distribute(comms.models[role], mesh) for role, (mesh, _) in inputs.items()}
    numerics = request.shock.numerics

    def pieces_of(role: Role) -> Pieces:
        return make_pieces(meshes[role], inputs[role][1], request.materials, numerics.formulation)

    pieces = agreed(world, lambda: {role: pieces_of(role) for role in meshes})
    candidates = {role: (pieces[role], inputs[role][1]) for role in pieces}
    steps = choose_steps(world, candidates, request.shock, comms.models)
    models = {}
    for role, factor in zip(pieces, steps.mass_factors, strict=True):
        tables, response = inputs[role][1], Response(numerics.kinematics, steps.step_of(role))
        models[role] = Model(tables, make_body(comms.models[role], pieces[role], tables, factor, response))
    return models, steps


def read_models(comms: Communicators, request: RunInput) -> dict[Role, tuple[MeshData | None, JointTables]]:
    """Read and check all meshes on rank 0, and hand each model its part.

    Returns:
        Per model of this rank: its mesh on the first rank that carries it, None on the others; its tables.
    """
    world = comms.world
    rules = HELD if request.shock.method == "direct" else SYMMETRY
    inputs = agreed(
        world, lambda: prepare(read_meshes(request.meshes), request.mode, rules) if world.rank == 0 else None
    )
    tables = world.bcast({role: item.tables for role, item in inputs.items()} if inputs else None)
    meshes: dict[Role, MeshData | None] = dict.fromkeys(comms.models)
    for role, first in comms.first.items():
        if inputs and first == 0:
            meshes[role] = inputs[role].mesh
        elif inputs:
            world.send(inputs[role].mesh, first)
        elif world.rank == first:
            meshes[role] = world.recv(source=0)
    return {role: (meshes[role], tables[role]) for role in comms.models}
