"""From the mesh of a structure to its body on each rank: read, check, distribute, choose steps, assemble."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.structure_tables import StructureTables, structure_tables, tied
from reflowshock.fem.forces.force import Kinematics, linear_terms
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.model.assembly import ForceOptions, Pieces, make_body, make_pieces
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.power_iteration import highest_frequency
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.model.structure_steps import check_step, explicit_steps, implicit_steps, with_critical
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.setup.shock_models import Divided, assembled, distributed


@dataclass(frozen=True, slots=True)
class StructureModel:
    """A structure on one rank, before it moves."""

    tables: StructureTables
    body: Body
    steps: Steps


def build_structure(comm: MPI.Comm, request: StructureInput, pulses: list[float]) -> StructureModel:
    """Read and distribute a structure, choose its steps and assemble it; collective.

    Args:
        comm: All ranks of the run.
        request: The input.
        pulses: Durations of its loads [s].

    Raises:
        AgreedError: The mesh does not fit the input; on every rank.
    """
    mesh, tables = read_structure(comm, request)
    local = distribute(comm, mesh)
    formulation = request.structure.formulation
    pieces = agreed(comm, lambda: make_pieces(local, tables, request.layer_materials, formulation))
    steps = choose_steps(comm, pieces, request, pulses)
    kinematics = request.dynamics.kinematics
    model = assemble(comm, pieces, tables, steps, kinematics)
    if request.solver != "implicit" and request.dynamics.numerics.critical_step == "power_iteration":
        found = highest_frequency(comm, model.body, linear_terms(model.body.elements), model.body.mass)
        # Made anew, since a law that depends on the rate knows the step.
        model = assemble(comm, pieces, tables, with_critical(steps, found.critical_step, request.dynamics), kinematics)
    if request.solver != "implicit":
        check_step(request.dynamics, model.steps.smallest)
    return model


def assemble(
    comm: MPI.Comm, pieces: Pieces, tables: StructureTables, steps: Steps, kinematics: Kinematics
) -> StructureModel:
    """Return the model that moves by given steps; collective."""
    body = make_body(comm, pieces, tables, steps.mass_factors[0], ForceOptions(kinematics, steps.plan.step))
    return StructureModel(tables, body, steps)


def read_structure(comm: MPI.Comm, request: StructureInput) -> tuple[MeshData | None, StructureTables]:
    """Read the mesh on rank 0 and build its tables; the mesh is None on the other ranks."""

    def read() -> tuple[MeshData, StructureTables] | None:
        if comm.rank:
            return None
        whole = tied(read_mesh(request.mesh), request)
        return whole.mesh, structure_tables(whole, request)

    found = agreed(comm, read)
    return (found[0] if found else None), comm.bcast(found[1] if found else None)


def choose_steps(comm: MPI.Comm, pieces: Pieces, request: StructureInput, pulses: list[float]) -> Steps:
    """Choose the steps of the run's solver."""
    if request.solver == "implicit":
        return implicit_steps(comm, pieces, request.dynamics, pulses)
    return explicit_steps(comm, pieces, request.dynamics)


def build_coupled(
    comms: Communicators,
    divided: Divided[StructureTables],
    request: StructureInput,
    ranks: Mapping[Role, NDArray[np.int32]],
) -> dict[Role, StructureModel]:
    """Distribute and assemble the coupled models of this rank; ``ranks`` as ``build_models``; collective."""
    pieces = distributed(comms, divided, ranks, request.layer_materials, request.structure.formulation)
    bodies = assembled(comms, divided, pieces, request.dynamics.kinematics)
    return {role: StructureModel(divided.tables[role], body, divided.steps) for role, body in bodies.items()}
