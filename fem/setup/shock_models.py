"""From input files to one model on each rank: read, divide, distribute, assemble."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.division import SchemeName
from reflowshock.fem.division.fine_joints import copied_joints, read_package
from reflowshock.fem.division.record import coupling_record
from reflowshock.fem.division.rules import Rules
from reflowshock.fem.division.tables import JointTables, Tables, TablesT_co, joined, model_inputs
from reflowshock.fem.division.whole import Treatment, survey
from reflowshock.fem.forces.force import Kinematics
from reflowshock.fem.loads.shock_loads import check_shaken
from reflowshock.fem.materials.elasticity import role_of_part
from reflowshock.fem.materials.parameters import Material
from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.supports import HELD, SYMMETRY
from reflowshock.fem.model.assembly import ForceOptions, Pieces, make_body, make_pieces
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.steps import Steps, agreed_minimum, assembled_step, steps_of_division, undivided
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.statics.initial_state import Cooling, InitialState

COARSE = "board"  # role of what velocities are held in


@dataclass(frozen=True, slots=True)
class Model:
    """One model on one rank, before it moves."""

    tables: JointTables
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


def divided_package(world: MPI.Comm, request: RunInput) -> Divided[JointTables]:
    """Read, check and divide all meshes on rank 0, and tell the other ranks; collective.

    Raises:
        AgreedError: Meshes that do not fit; on every rank.
    """
    return told_to_all(world, lambda: divided_on_one_rank(request))


def told_to_all(world: MPI.Comm, divided: Callable[[], Divided[TablesT_co]]) -> Divided[TablesT_co]:
    """Divide on rank 0, and tell the other ranks all but the meshes; collective, errors of rank 0 on every rank."""
    found = agreed(world, lambda: divided() if world.rank == 0 else None)
    told: Divided[TablesT_co] = world.bcast(replace(found, meshes={}) if found else None)
    return found or told


def divided_on_one_rank(request: RunInput) -> Divided[JointTables]:
    """Read, check and divide all meshes; errors as ``read_package``, ``division.checks``."""
    shock, numerics = request.shock, request.shock.numerics
    whole = joined(read_package(request))
    found = survey(
        whole.mesh,
        request.materials,
        Treatment(numerics.formulation, numerics.decided_kinematics, numerics.mass_scaled),
    )
    rules = Rules(
        coupling=shock.coupling,
        coarse=whole.mesh.in_parts(lambda name: role_of_part(name) == COARSE),
        fraction=numerics.step_fraction,
        stiffness=shock.damping.coefficients[1],
        duration=shock.duration,
        samples=numerics.history_samples,
        **(dict(zip(("copied", "copy"), copied_joints(whole.mesh), strict=True)) if request.one_way else {}),
    )
    division = divide(whole, found, rules)
    steps = steps_of_division(whole, found, division, rules)
    held = HELD if shock.method == "direct" else SYMMETRY
    if request.mode == "dns":
        steps = undivided(steps, float(found.step.min()), rules)
        inputs = model_inputs(whole, "dns", held)
    else:
        check_division(whole, found, division, rules)
        inputs = model_inputs(whole, division, held)
    check_shaken([item.tables for item in inputs.values()], shock)
    first = next(iter(inputs.values()))
    return Divided(
        meshes={role: item.mesh for role, item in inputs.items()},
        tables={role: item.tables for role, item in inputs.items()},
        mass_factors={role: found.factor[item.cells] for role, item in inputs.items()},
        steps=steps,
        rules=rules,
        scheme=division.scheme,
        coupling={"direction": shock.coupling.direction}
        | coupling_record(division, found, len(first.tables.interface)),
        initial=InitialState.of(Cooling.read(request.cooling), whole, inputs, not found.linear.all())
        if request.cooling
        else None,
    )


def build_models(
    comms: Communicators, divided: Divided[JointTables], request: RunInput, ranks: Mapping[Role, NDArray[np.int32]]
) -> tuple[dict[Role, Model], Steps]:
    """Distribute and assemble the models of this rank; collective.

    Args:
        comms: Communicators.
        divided: The models.
        request: The input.
        ranks: On rank 0, of each model on several ranks, the rank ``(ne,)`` of each cell.

    Returns:
        The models, and the steps: those of a DNS may be larger than what its elements allow each on its own.
    """
    world, numerics, steps = comms.world, request.shock.numerics, divided.steps
    pieces = distributed(comms, divided, ranks, request.materials, numerics.formulation)
    if "dns" in pieces and numerics.critical_step == "power_iteration":
        factor = divided.mass_factors["dns"][pieces["dns"].local.cell_numbers]
        found = assembled_step(comms.models["dns"], (pieces["dns"], divided.tables["dns"]), factor)
        alone = agreed_minimum(world, [pieces["dns"].steps * np.sqrt(factor)])
        steps = undivided(steps, max(found, alone), divided.rules)
    bodies = assembled(comms, replace(divided, steps=steps), pieces, numerics.decided_kinematics)
    return {role: Model(divided.tables[role], body) for role, body in bodies.items()}, steps


def distributed(
    comms: Communicators,
    divided: Divided[TablesT_co],
    ranks: Mapping[Role, NDArray[np.int32]],
    materials: Materials | Mapping[str, Material],
    formulation: str,
) -> dict[Role, Pieces]:
    """Distribute the models, and give the elements of this rank their materials; arguments as ``build_models``."""
    given = hand_over(comms, divided, ranks)
    mine = next(iter(divided.meshes.values()), None)
    dolfinx_api.compile_ahead(comms.world, mine.points[mine.cells[0]] if mine else None)
    meshes = {role: distribute(comms.models[role], *mesh) for role, mesh in given.items()}

    def pieces_of(role: Role) -> Pieces:
        return make_pieces(meshes[role], divided.tables[role], materials, formulation)

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
