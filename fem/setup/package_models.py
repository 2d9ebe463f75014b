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
from reflowshock.fem.division.record import coupling_record
from reflowshock.fem.division.tables import JointTables, joined, model_inputs
from reflowshock.fem.division.whole import survey
from reflowshock.fem.loads.shock_loads import check_shaken
from reflowshock.fem.materials.elasticity import role_of_part
from reflowshock.fem.mesh.supports import HELD, SYMMETRY
from reflowshock.fem.model.steps import Steps, agreed_minimum, assembled_step, steps_of_division, undivided
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.setup.models import Divided, Model, assembled, distributed, divided_on_root, treatment_of
from reflowshock.fem.statics.initial_state import Cooling, InitialState

COARSE = "board"  # role of the boxes that velocities are held in


def divided_package(world: MPI.Comm, request: RunInput) -> Divided[JointTables]:
    """Read, check and divide all meshes on rank 0, and tell the other ranks; collective.

    Raises:
        AgreedError: Meshes that do not fit; on every rank.
    """
    return divided_on_root(world, lambda: divided_on_one_rank(request))


def divided_on_one_rank(request: RunInput) -> Divided[JointTables]:
    """Read, check and divide all meshes; errors as ``read_package``, ``division.checks``."""
    shock, numerics = request.shock, request.shock.numerics
    whole = joined(read_package(request))
    found = survey(whole.mesh, request.materials, treatment_of(request))
    rules = Rules(
        coupling=shock.coupling,
        coarse=whole.mesh.in_parts(lambda name: role_of_part(name) == COARSE and not joint_of(name)),
        fraction=numerics.step_fraction,
        stiffness=shock.damping.coefficients[1],
        duration=shock.decided_duration,
        samples=numerics.history_samples,
        **(dict(zip(("copied", "copy"), copied_joints(whole.mesh), strict=True)) if request.one_way else {}),
    )
    division = divide(whole, found, rules)
    steps = steps_of_division(whole, found, division, rules)
    held = HELD if shock.method == "direct" else SYMMETRY
    if request.mode == "dns":
        steps = undivided(steps, float(found.step.min()), rules)
        inputs = model_inputs(whole, "dns", held, shock.joint_layer)
    else:
        check_division(whole, found, division, rules)
        inputs = model_inputs(whole, division, held, shock.joint_layer)
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
    if "dns" in pieces and request.numerics.critical_step == "power_iteration":
        factor = divided.mass_factors["dns"][pieces["dns"].local.cell_numbers]
        found = assembled_step(comms.models["dns"], (pieces["dns"], divided.tables["dns"]), factor)
        alone = agreed_minimum(comms.world, [pieces["dns"].steps * np.sqrt(factor)])
        steps = undivided(steps, max(found, alone), divided.rules)
    bodies = assembled(comms, replace(divided, steps=steps), pieces, request.kinematics)
    return {role: Model(divided.tables[role], body) for role, body in bodies.items()}, steps
