"""From input files to one model on each rank: read, check, distribute, choose steps, assemble."""

from dataclasses import dataclass

from fem import dolfinx_api
from fem.agreement import agreed
from fem.body import Body, make_body, make_pieces
from fem.communicators import Communicators
from fem.inputs import RunInput
from fem.local_mesh import distribute
from fem.mesh import MeshData, read_meshes
from fem.scene import Tables, prepare
from fem.steps import Steps, choose_steps


@dataclass(frozen=True, slots=True)
class Model:
    """One model on one rank, before it moves."""

    tables: Tables
    body: Body
    steps: Steps


def build_model(comms: Communicators, request: RunInput) -> Model:
    """Read, prepare and distribute the model of this rank; collective."""
    world = comms.world
    mesh, tables = read_model(comms, request)
    dolfinx_api.compile_ahead(world)
    local = distribute(comms.model, mesh)
    pieces = agreed(world, lambda: make_pieces(local, tables, request.materials))
    steps = choose_steps(world, pieces, tables, request.shock)
    return Model(tables, make_body(comms.model, pieces, tables, steps.mass_factor), steps)


def read_model(comms: Communicators, request: RunInput) -> tuple[MeshData | None, Tables]:
    """Read and check all meshes on rank 0, and hand each model its part.

    Returns:
        The model's mesh on the first of its ranks, None on the others; its tables.
    """
    world = comms.world
    inputs = agreed(world, lambda: prepare(read_meshes(request.meshes), request.mode) if world.rank == 0 else None)
    tables = world.bcast({role: item.tables for role, item in inputs.items()} if inputs else None)
    first = {"macro": 0, "meso": request.shock.ranks.macro, "dns": 0}
    if inputs and "meso" in inputs:
        world.send(inputs["meso"].mesh, first["meso"])
    if world.rank != first[comms.role]:
        return None, tables[comms.role]
    mesh = inputs[comms.role].mesh if inputs else world.recv(source=0)
    return mesh, tables[comms.role]
