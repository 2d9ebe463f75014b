"""From the mesh of a structure to its models on each rank: one, or fine layers apart from the others.

Layers whose ``in_plane`` differs are meshed apart and tied; the finer face is the slave.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.division import Division, Rules
from reflowshock.fem.division.record import coupling_record
from reflowshock.fem.division.structure_tables import StructureTables, structure_tables, tied
from reflowshock.fem.division.tables import split
from reflowshock.fem.division.whole import Survey, Whole, survey
from reflowshock.fem.errors import CouplingError, StepError
from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.model.assembly import ForceOptions, Pieces, make_body, make_pieces
from reflowshock.fem.model.attachments import attached, bedded_steps, beddings_of
from reflowshock.fem.model.power_iteration import highest_frequency
from reflowshock.fem.model.steps import (
    Steps,
    check_step,
    explicit_steps,
    implicit_steps,
    steps_of_division,
    with_critical,
)
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.problem.load_kinds import PrescribedMotion
from reflowshock.fem.problem.structure import LayerCoupling, fine_layers
from reflowshock.fem.setup.models import Divided, Model, assembled, distributed, divided_on_root, treatment_of

StructureModel = Model[StructureTables]


def build_structure(comm: MPI.Comm, request: StructureInput, pulses: list[float]) -> tuple[StructureModel, Steps]:
    """Read and distribute a structure, choose its steps and assemble it as one model; collective.

    Args:
        comm: All ranks of the run.
        request: The input.
        pulses: Durations of its loads [s].

    Raises:
        AgreedError: The mesh does not fit the input; on every rank.
    """
    mesh, tables = read_structure(comm, request)
    local = distribute(comm, mesh)
    pieces = agreed(comm, lambda: make_pieces(local, tables, request.part_materials, request.formulation))
    beddings = beddings_of(pieces.local, tables.fitted, request.supports)
    for bedding in beddings:
        pieces = bedded_steps(pieces, bedding)
    steps = choose_steps(comm, pieces, request, pulses)
    steps = replace(steps, model_mass=steps.model_mass + float(tables.fitted.masses[1].sum()))
    model = assemble(comm, pieces, (tables, beddings), steps, request)
    if request.implicit:
        return model, steps
    if request.numerics.critical_step == "power_iteration":
        terms = [*linear_terms(model.body.elements), *beddings]
        found = highest_frequency(comm, model.body, terms, model.body.mass)
        steps = with_critical(steps, found.critical_step, request.dynamics)
        model = assemble(
            comm, pieces, (tables, beddings), steps, request
        )  # made anew: a law that depends on the rate has the step
    check_step(request.dynamics, steps.smallest)
    return model, steps


def assemble(
    comm: MPI.Comm,
    pieces: Pieces,
    given: tuple[StructureTables, list[BeddedFacets]],
    steps: Steps,
    request: StructureInput,
) -> StructureModel:
    """Return the model of given tables and elastic supports that moves by given steps; collective."""
    tables, beddings = given
    body = make_body(comm, pieces, tables, steps.mass_factors[0], ForceOptions(request.kinematics, steps.plan.step))
    return Model(tables, attached(body, tables.fitted.masses, beddings))


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
    if request.implicit:
        return implicit_steps(comm, pieces, request.dynamics, pulses)
    return explicit_steps(comm, pieces, request.dynamics)


def divided_structure(world: MPI.Comm, request: StructureInput) -> Divided[StructureTables]:
    """Read, check and divide the mesh of a structure on rank 0, and tell the other ranks; collective.

    Raises:
        AgreedError: A mesh that does not fit, or cannot be divided; on every rank.
    """
    return divided_on_root(world, lambda: divided_on_one_rank(request))


def build_coupled(
    comms: Communicators,
    divided: Divided[StructureTables],
    request: StructureInput,
    ranks: Mapping[Role, NDArray[np.int32]],
) -> dict[Role, StructureModel]:
    """Distribute and assemble the coupled models of this rank; ``ranks`` as ``distributed``; collective."""
    pieces = distributed(comms, divided, ranks, request)
    bodies = assembled(comms, divided, pieces, request.kinematics)
    return {role: Model(divided.tables[role], body) for role, body in bodies.items()}


def divided_on_one_rank(request: StructureInput) -> Divided[StructureTables]:
    """Read, check and divide the mesh of a structure; errors as ``tables``, ``coupling.checks``."""
    coupling, dynamics = request.dynamics.coupling, request.dynamics
    assert coupling is not None
    whole = tied(read_mesh(request.mesh), request)
    found = survey(whole.mesh, request.part_materials, treatment_of(request))
    fine = layers_that_are_fine(whole, found, coupling)
    rules = Rules(
        coupling=coupling,
        coarse=whole.mesh.in_parts(lambda name: name not in fine),
        fraction=dynamics.numerics.step_fraction,
        stiffness=dynamics.damping.coefficients[1],
        duration=dynamics.duration,
        samples=dynamics.numerics.history_samples,
    )
    division = divide(whole, found, rules)
    check_division(whole, found, division, rules)
    check_pulses(request, division.plan.window)
    inputs = split(whole, structure_tables(whole, request), division)
    check_motions_at_interface(division, inputs["macro"].tables, request)
    return Divided(
        meshes={role: item.mesh for role, item in inputs.items()},
        tables={role: item.tables for role, item in inputs.items()},
        mass_factors={role: found.factor[item.cells] for role, item in inputs.items()},
        steps=steps_of_division(whole, found, division, rules),
        rules=rules,
        scheme=division.scheme,
        coupling=coupling_record(division, found, len(inputs["macro"].tables.interface))
        | {"fine_layers": fine, "direction": "two_way"},
    )


def check_pulses(request: StructureInput, window: float) -> None:
    """Refuse a pulse that is shorter than a window [s], in which the macro model would not see it.

    Raises:
        StepError: With both durations.
    """
    for name, pulse in pulses_of(request.loads).items():
        shortest = min(pulse_durations({name: pulse}), default=window)
        if shortest < window:
            raise StepError(
                f"loads.{name} lasts {shortest:.4g} s, less than the window of two models, {window:.4g} s: smaller"
                " elements of the coarse layers make the window shorter, and without dynamics.coupling there is none"
            )


def check_motions_at_interface(division: Division, tables: StructureTables, request: StructureInput) -> None:
    """Check that the model that moves the interface knows what prescribes its motion: shared nodes are the macro's.

    Raises:
        CouplingError: A motion of the interface where the meso model carries it.
    """
    for name, load in request.loads.items():
        if division.scheme == "impulse" and isinstance(load, PrescribedMotion):
            count = len(np.intersect1d(tables.nodes_of[load.on], tables.interface))
            if count:
                raise CouplingError(
                    f"loads.{name} moves {count} nodes of the interface, which the meso model carries with"
                    " coupling.scheme = impulse: held_velocity, local_steps or gravouil_combescure let them be moved"
                )


def layers_that_are_fine(whole: Whole, found: Survey, coupling: LayerCoupling) -> tuple[str, ...]:
    """Return the layers that are fine: those that are named or, where none is, those of small steps.

    Raises:
        CouplingError: No layer is fine.
    """
    steps = {name: float(found.step[whole.mesh.in_parts(name.__eq__)].min()) for name in whole.mesh.part_names}
    fine = fine_layers(coupling, steps)
    if not fine:
        found_steps = ", ".join(f"{name} {step:.3g} s" for name, step in steps.items())
        raise CouplingError(
            f"no layer is fine: critical steps are {found_steps}, none less than half of the longest; name it in"
            " dynamics.coupling.fine, or leave dynamics.coupling out"
        )
    return fine
