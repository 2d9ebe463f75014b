"""Set-up of the models of a package on a board, from its meshes to the bodies on each rank."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.division import Rules
from reflowshock.fem.division.fine_joints import copied_joints, joint_of, read_package
from reflowshock.fem.division.fitted import FittedTable, fit_to_mesh
from reflowshock.fem.division.neighbours import with_neighbours
from reflowshock.fem.division.record import coupling_record
from reflowshock.fem.division.tables import JointTables, join_meshes, model_inputs
from reflowshock.fem.division.whole import Whole, add_spring_stiffness, survey
from reflowshock.fem.loads.shock_loads import check_shaken
from reflowshock.fem.mesh.column import COPY
from reflowshock.fem.mesh.supports import HELD, SYMMETRY
from reflowshock.fem.model.assembly import make_body, make_rank_elements
from reflowshock.fem.model.attachments import beddings_of, with_attachments, with_support_stiffness
from reflowshock.fem.model.steps import Steps, assembled_step, find_minimum, single_model_steps, steps_of_division
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.problem.fittings import AXES, Fittings
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.setup.models import (
    DividedModels,
    Model,
    assemble_bodies,
    distribute_models,
    divide_on_root,
    treatment_of,
)
from reflowshock.fem.statics.initial_state import Cooling, InitialState
from reflowshock.materials.roles import role_of_part

COARSE = "board"  # material role of the macro model


def divide_package(world: MPI.Comm, request: RunInput) -> DividedModels[JointTables]:
    """Read, check and divide all meshes on rank 0, and broadcast the result; collective.

    Args:
        world: Communicator of all ranks.
        request: Input of the run, with the paths of the meshes.

    Returns:
        Meshes (on rank 0 only), tables, time steps and coupling scheme of the models.

    Raises:
        AgreedError: The meshes do not fit the input; on every rank.
    """
    return divide_on_root(world, lambda: _divide_on_one_rank(request))


def _divide_on_one_rank(request: RunInput) -> DividedModels[JointTables]:
    """Read, check and divide all meshes; raises as ``read_package`` and ``division.checks``."""
    shock = request.shock
    whole = join_meshes(with_neighbours(read_package(request), request.packages))
    fitted = _fit_board(whole, request)
    treatment = treatment_of(request, request.numerics.mass_scaled_step)
    unsupported = survey(whole.mesh, request.materials, treatment)
    elements = add_spring_stiffness(unsupported, whole.mesh, fitted, request.supports)
    coarse = whole.mesh.in_parts(lambda name: role_of_part(name) == COARSE and not joint_of(name))
    sprung = bool(fitted and fitted.bedded)
    rules = Rules.of_shock(shock, coarse, shock.decided_duration, sprung=sprung, cooled=bool(request.cooling))
    if shock.method == "large_mass":
        rules = replace(rules, shaken=whole.mesh.facet_nodes("mounting_holes"))
    if request.one_way:
        copied, copy = copied_joints(whole.mesh)
        rules = replace(rules, copied=copied, copy=copy)
    division = divide(whole, elements, rules)
    steps = steps_of_division(whole, elements, division, rules)
    if fitted:
        steps = replace(steps, model_mass=steps.model_mass + float(fitted.masses[1].sum()))
    held = _find_fixed_components(request)
    if request.mode == "dns":
        steps = single_model_steps(steps, float(elements.step.min()), rules)
        inputs = model_inputs(whole, "dns", held, shock.joint_layer, fitted)
    else:
        check_division(whole, elements, division, rules)
        inputs = model_inputs(whole, division, held, shock.joint_layer, fitted)
    check_shaken([item.tables for item in inputs.values()], shock)
    first = next(iter(inputs.values()))
    return DividedModels(
        meshes={role: item.mesh for role, item in inputs.items()},
        tables={role: item.tables for role, item in inputs.items()},
        mass_factors={role: elements.factor[item.cells] for role, item in inputs.items()},
        steps=steps,
        rules=rules,
        scheme=division.scheme,
        coupling={"direction": shock.coupling.direction}
        | coupling_record(division, elements, len(first.tables.interface)),
        initial=InitialState.of(Cooling.read(request.cooling), whole, inputs, not elements.linear.all())
        if request.cooling
        else None,
    )


def _fit_board(whole: Whole, request: RunInput) -> FittedTable | None:
    """Return the fittings of the board as tables, None if there are none; raises as ``fit_to_mesh``."""
    if not any(getattr(request, name) for name in Fittings.model_fields):
        return None
    board = whole.mesh.in_parts(lambda name: role_of_part(name) == COARSE and COPY not in name)
    return fit_to_mesh(whole.mesh, board, request, request.materials.board.plasticity is not None)


def _find_fixed_components(request: RunInput) -> dict[str, tuple[int, ...]]:
    """Return the fixed components by facet set, as in ``HELD``, for hole walls, supports or a large mass."""
    if request.shock.method == "large_mass":
        return SYMMETRY
    if not request.supports:
        return HELD
    held = {AXES.index(axis) for support in request.supports.values() for axis in support.hold}
    return SYMMETRY | {"mounting_holes": tuple(sorted(held))}


def build_package(
    comms: Communicators,
    divided: DividedModels[JointTables],
    request: RunInput,
    ranks: Mapping[Role, NDArray[np.int32]],
) -> tuple[dict[Role, Model[JointTables]], Steps]:
    """Distribute and assemble the models of this rank; collective.

    Args:
        comms: Communicators of the run and of its models.
        divided: Models before distribution.
        request: Input of the run.
        ranks: Rank of each cell, shape (ne,), of every model that is on several ranks; used on rank 0.

    Returns:
        Models of this rank, and the time steps, which power iteration may increase in a DNS.
    """
    steps = divided.steps
    rank_elements = distribute_models(comms, divided, ranks, request)
    beddings = {
        role: beddings_of(part.local, divided.tables[role].fitted, request.supports)
        for role, part in rank_elements.items()
    }
    for role, springs in beddings.items():
        for bedding in springs:
            rank_elements[role] = with_support_stiffness(rank_elements[role], bedding)
    if "dns" in rank_elements and request.numerics.critical_step == "power_iteration":
        factor = divided.mass_factors["dns"][rank_elements["dns"].local.cell_numbers]
        whole_step = assembled_step(
            comms.models["dns"], rank_elements["dns"], divided.tables["dns"], factor, beddings["dns"]
        )
        element_step = find_minimum(comms.world, [rank_elements["dns"].steps * np.sqrt(factor)])
        steps = single_model_steps(steps, max(whole_step, element_step), divided.rules)
    bodies = assemble_bodies(comms, replace(divided, steps=steps), rank_elements, request.kinematics)
    models = {
        role: Model(table := divided.tables[role], with_attachments(body, *table.fitted.masses, beddings[role]))
        for role, body in bodies.items()
    }
    return models, steps


def build_elastic_package(request: RunInput) -> tuple[Model[JointTables], float]:
    """Return package and board as one linear elastic model on a single rank, and its mass [kg].

    Coarse joints are used if a mesh of them exists, since the modes of the board do not depend on joint details.
    Plasticity, watch points and gauges of the input are ignored; supports and lumped masses are included.

    Args:
        request: Input of the run; its meshes are read.
    """
    coupling = request.shock.coupling.model_copy(update={"fine_joints": "all", "direction": "two_way"})
    meshes = (request.meshes[0], request.coarse_joints) if request.coarse_joints else request.meshes
    shock = request.shock.model_copy(update={"coupling": coupling, "method": "direct"})
    single = request.model_copy(update={"shock": shock, "meshes": meshes, "watch": {}, "gauges": {}})
    whole = join_meshes(with_neighbours(read_package(single), request.packages))
    model = model_inputs(whole, "dns", _find_fixed_components(single), shock.joint_layer, _fit_board(whole, single))[
        "dns"
    ]
    tables, local = model.tables, distribute(MPI.COMM_SELF, model.mesh)
    rank_elements = make_rank_elements(local, tables, request.materials, request.formulation)
    body = make_body(MPI.COMM_SELF, rank_elements, tables, np.ones(len(rank_elements.steps)), None)
    body = with_attachments(body, *tables.fitted.masses, beddings_of(local, tables.fitted, request.supports))
    return Model(tables, body), float(body.mass.sum())
