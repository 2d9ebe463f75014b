"""From the meshes of a package on a board to its models on each rank."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.division import Rules
from reflowshock.fem.division.fine_joints import copied_joints, joint_of, read_package
from reflowshock.fem.division.fitted import FittedTable, fitted_to
from reflowshock.fem.division.neighbours import with_neighbours
from reflowshock.fem.division.record import coupling_record
from reflowshock.fem.division.tables import JointTables, joined, model_inputs
from reflowshock.fem.division.whole import Whole, on_springs, survey
from reflowshock.fem.loads.shock_loads import check_shaken
from reflowshock.fem.mesh.column import COPY
from reflowshock.fem.mesh.supports import HELD, SYMMETRY
from reflowshock.fem.model.assembly import make_body, make_pieces
from reflowshock.fem.model.attachments import attached, bedded_steps, beddings_of
from reflowshock.fem.model.steps import Steps, agreed_minimum, assembled_step, steps_of_division, undivided
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.problem.fittings import AXES, Fittings
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.setup.models import Divided, Model, assembled, distributed, divided_on_root, treatment_of
from reflowshock.fem.statics.initial_state import Cooling, InitialState
from reflowshock.materials.roles import role_of_part

COARSE = "board"  # role of the boxes that velocities are held in


def divided_package(world: MPI.Comm, request: RunInput) -> Divided[JointTables]:
    """Read, check and divide all meshes on rank 0, and tell the other ranks; collective.

    Raises:
        AgreedError: Meshes that do not fit; on every rank.
    """
    return divided_on_root(world, lambda: divided_on_one_rank(request))


def divided_on_one_rank(request: RunInput) -> Divided[JointTables]:
    """Read, check and divide all meshes; errors as ``read_package``, ``division.checks``."""
    shock = request.shock
    whole = joined(with_neighbours(read_package(request), request.packages))
    fitted = fitted_board(whole, request)
    plain = survey(whole.mesh, request.materials, treatment_of(request))
    found = on_springs(plain, whole.mesh, fitted, request.supports)
    coarse = whole.mesh.in_parts(lambda name: role_of_part(name) == COARSE and not joint_of(name))
    sprung = bool(fitted and fitted.bedded)
    rules = Rules.of_shock(shock, coarse, shock.decided_duration, sprung=sprung, cooled=bool(request.cooling))
    if shock.method == "large_mass":
        rules = replace(rules, shaken=whole.mesh.facet_nodes("mounting_holes"))
    if request.one_way:
        copied, copy = copied_joints(whole.mesh)
        rules = replace(rules, copied=copied, copy=copy)
    division = divide(whole, found, rules)
    steps = steps_of_division(whole, found, division, rules)
    if fitted:
        steps = replace(steps, model_mass=steps.model_mass + float(fitted.masses[1].sum()))
    held = held_by(request)
    if request.mode == "dns":
        steps = undivided(steps, float(found.step.min()), rules)
        inputs = model_inputs(whole, "dns", held, shock.joint_layer, fitted)
    else:
        check_division(whole, found, division, rules)
        inputs = model_inputs(whole, division, held, shock.joint_layer, fitted)
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


def fitted_board(whole: Whole, request: RunInput) -> FittedTable | None:
    """Return what is fitted to the board, None where nothing is; errors as ``fitted``."""
    if not any(getattr(request, name) for name in Fittings.model_fields):
        return None
    board = whole.mesh.in_parts(lambda name: role_of_part(name) == COARSE and COPY not in name)
    return fitted_to(whole.mesh, board, request, request.materials.board.plasticity is not None)


def held_by(request: RunInput) -> dict[str, tuple[int, ...]]:
    """Return what is held, as ``HELD``: the walls of the holes, unless supports or a large mass hold them otherwise."""
    if request.shock.method == "large_mass":
        return SYMMETRY
    if not request.supports:
        return HELD
    held = {AXES.index(axis) for support in request.supports.values() for axis in support.hold}
    return SYMMETRY | {"mounting_holes": tuple(sorted(held))}


def build_package(
    comms: Communicators, divided: Divided[JointTables], request: RunInput, ranks: Mapping[Role, NDArray[np.int32]]
) -> tuple[dict[Role, Model[JointTables]], Steps]:
    """Distribute and assemble the models of this rank; collective.

    Args:
        comms: Communicators.
        divided: The models.
        request: The input.
        ranks: On rank 0, of each model on several ranks, the rank ``(ne,)`` of each cell.

    Returns:
        The models, and the steps: those of a DNS may be larger than what its elements allow each on its own.
    """
    steps = divided.steps
    pieces = distributed(comms, divided, ranks, request)
    beddings = {
        role: beddings_of(own.local, divided.tables[role].fitted, request.supports) for role, own in pieces.items()
    }
    for role, springs in beddings.items():
        for bedding in springs:
            pieces[role] = bedded_steps(pieces[role], bedding)
    if "dns" in pieces and request.numerics.critical_step == "power_iteration":
        factor = divided.mass_factors["dns"][pieces["dns"].local.cell_numbers]
        model = pieces["dns"], divided.tables["dns"]
        found = assembled_step(comms.models["dns"], model, factor, beddings["dns"])
        alone = agreed_minimum(comms.world, [pieces["dns"].steps * np.sqrt(factor)])
        steps = undivided(steps, max(found, alone), divided.rules)
    bodies = assembled(comms, replace(divided, steps=steps), pieces, request.kinematics)
    models = {
        role: Model(table := divided.tables[role], attached(body, table.fitted.masses, beddings[role]))
        for role, body in bodies.items()
    }
    return models, steps


def elastic_package(request: RunInput) -> tuple[Model[JointTables], float]:
    """Return all of a package on its board as one linear elastic model on this rank alone, and its mass [kg].

    Its joints are coarse where there is a mesh of coarse ones: they change no mode of the board.
    """
    coupling = request.shock.coupling.model_copy(update={"fine_joints": "all", "direction": "two_way"})
    meshes = (request.meshes[0], request.coarse_joints) if request.coarse_joints else request.meshes
    shock = request.shock.model_copy(update={"coupling": coupling, "method": "direct"})
    alone = request.model_copy(update={"shock": shock, "meshes": meshes, "watch": {}, "gauges": {}})
    whole = joined(with_neighbours(read_package(alone), request.packages))
    given = model_inputs(whole, "dns", held_by(alone), shock.joint_layer, fitted_board(whole, alone))["dns"]
    tables, local = given.tables, distribute(MPI.COMM_SELF, given.mesh)
    pieces = make_pieces(local, tables, request.materials, request.formulation)
    body = make_body(MPI.COMM_SELF, pieces, tables, np.ones(len(pieces.steps)), None)
    body = attached(body, tables.fitted.masses, beddings_of(local, tables.fitted, request.supports))
    return Model(tables, body), float(body.mass.sum())
