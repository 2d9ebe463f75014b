"""Set-up of the models of a structure: a single model, or fine layers coupled to coarse ones.

Layers with different ``in_plane`` mesh sizes are meshed separately and tied; the finer face is the slave.
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
from reflowshock.fem.division.structure_tables import StructureTables, structure_tables, tie_layers
from reflowshock.fem.division.tables import split
from reflowshock.fem.division.whole import Survey, Whole, survey
from reflowshock.fem.errors import CouplingError, StepError
from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.model.assembly import ForceOptions, RankElements, make_body, make_rank_elements
from reflowshock.fem.model.attachments import beddings_of, with_attachments, with_support_stiffness
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
from reflowshock.fem.setup.models import (
    DividedModels,
    Model,
    assemble_bodies,
    distribute_models,
    divide_on_root,
    treatment_of,
)

StructureModel = Model[StructureTables]


def build_structure(comm: MPI.Comm, request: StructureInput, pulses: list[float]) -> tuple[StructureModel, Steps]:
    """Read and distribute a structure, choose its steps and assemble it as one model; collective.

    Args:
        comm: Communicator of all ranks of the run.
        request: Input of the run.
        pulses: Durations of the load pulses [s]; the shortest limits an implicit step.

    Returns:
        Model of this rank, and the time steps, equal on all ranks apart from the mass factors.

    Raises:
        AgreedError: The mesh does not fit the input; on every rank.
        StepError: The step of the input is above the critical step.
    """
    mesh, tables = _read_structure(comm, request)
    local = distribute(comm, mesh)
    rank_elements = agreed(comm, lambda: make_rank_elements(local, tables, request.part_materials, request.formulation))
    beddings = beddings_of(rank_elements.local, tables.fitted, request.supports)
    for bedding in beddings:
        rank_elements = with_support_stiffness(rank_elements, bedding)
    steps = _choose_steps(comm, rank_elements, request, pulses)
    steps = replace(steps, model_mass=steps.model_mass + float(tables.fitted.masses[1].sum()))

    def assemble(steps: Steps) -> StructureModel:
        body = make_body(
            comm, rank_elements, tables, steps.mass_factors[0], ForceOptions(request.kinematics, steps.plan.step)
        )
        return Model(tables, with_attachments(body, *tables.fitted.masses, beddings))

    model = assemble(steps)
    if request.implicit:
        return model, steps
    if request.numerics.critical_step == "power_iteration":
        terms = [*linear_terms(model.body.elements), *beddings]
        highest = highest_frequency(comm, model.body, terms, model.body.mass)
        steps = with_critical(steps, highest.critical_step, request.dynamics)
        model = assemble(steps)  # rate-dependent laws use the new step
    check_step(request.dynamics, steps.smallest)
    return model, steps


def _read_structure(comm: MPI.Comm, request: StructureInput) -> tuple[MeshData | None, StructureTables]:
    """Read the mesh and build its tables on rank 0; the mesh is None on other ranks; collective."""

    def read() -> tuple[MeshData, StructureTables] | None:
        if comm.rank:
            return None
        whole = tie_layers(read_mesh(request.mesh), request)
        return whole.mesh, structure_tables(whole, request)

    structure = agreed(comm, read)
    return (structure[0] if structure else None), comm.bcast(structure[1] if structure else None)


def _choose_steps(comm: MPI.Comm, rank_elements: RankElements, request: StructureInput, pulses: list[float]) -> Steps:
    """Choose the time steps of the run's solver; collective."""
    if request.implicit:
        return implicit_steps(comm, rank_elements, request.dynamics, pulses)
    return explicit_steps(comm, rank_elements, request.dynamics)


def divide_structure(world: MPI.Comm, request: StructureInput) -> DividedModels[StructureTables]:
    """Read, check and divide the mesh of a structure on rank 0, and broadcast the result; collective.

    Args:
        world: Communicator of all ranks.
        request: Input of the run, with the path of the mesh.

    Returns:
        Meshes (on rank 0 only), tables, time steps and coupling scheme of the macro and meso model.

    Raises:
        AgreedError: The mesh does not fit the input or cannot be divided; on every rank.
    """
    return divide_on_root(world, lambda: divide_on_one_rank(request))


def build_coupled(
    comms: Communicators,
    divided: DividedModels[StructureTables],
    request: StructureInput,
    ranks: Mapping[Role, NDArray[np.int32]],
) -> dict[Role, StructureModel]:
    """Distribute and assemble the coupled models of this rank; collective.

    Args:
        comms: Communicators of the run and of its models.
        divided: Models before distribution.
        request: Input of the run.
        ranks: Rank of each cell, shape (ne,), of every model that is on several ranks; used on rank 0.

    Returns:
        Models of this rank, ``macro``, ``meso`` or both.
    """
    rank_elements = distribute_models(comms, divided, ranks, request)
    bodies = assemble_bodies(comms, divided, rank_elements, request.kinematics)
    return {role: Model(divided.tables[role], body) for role, body in bodies.items()}


def divide_on_one_rank(request: StructureInput) -> DividedModels[StructureTables]:
    """Read, check and divide the mesh of a structure into macro and meso model; not collective.

    Args:
        request: Input of the run, whose dynamics must have coupling settings.

    Returns:
        Meshes, tables, time steps and coupling scheme of both models.

    Raises:
        MeshError: The file, its layers or a watch point does not fit the input.
        TieError: Layers with different meshes do not touch.
        LoadError: A load, support or mass does not fit the mesh.
        CouplingError: A model is empty, a step is unstable, or the scheme does not support the supports.
        LevelError: The critical steps differ by more than the levels allow.
        PulseError: A pulse is shorter than a window, the time between two exchanges of the models.
    """
    coupling, dynamics = request.dynamics.coupling, request.dynamics
    assert coupling is not None
    whole = tie_layers(read_mesh(request.mesh), request)
    elements = survey(whole.mesh, request.part_materials, treatment_of(request))
    fine = _choose_fine_layers(whole, elements, coupling)
    rules = Rules(
        coupling=coupling,
        coarse=whole.mesh.in_parts(lambda name: name not in fine),
        fraction=dynamics.numerics.step_fraction,
        stiffness=dynamics.damping.coefficients[1],
        duration=dynamics.duration,
        samples=dynamics.numerics.history_samples,
    )
    division = divide(whole, elements, rules)
    check_division(whole, elements, division, rules)
    _check_pulses(request, division.plan.window)
    inputs = split(whole, structure_tables(whole, request), division)
    _check_motions_at_interface(division, inputs["macro"].tables, request)
    return DividedModels(
        meshes={role: item.mesh for role, item in inputs.items()},
        tables={role: item.tables for role, item in inputs.items()},
        mass_factors={role: elements.factor[item.cells] for role, item in inputs.items()},
        steps=steps_of_division(whole, elements, division, rules),
        rules=rules,
        scheme=division.scheme,
        coupling=coupling_record(division, elements, len(inputs["macro"].tables.interface))
        | {"fine_layers": fine, "direction": "two_way"},
    )


def _check_pulses(request: StructureInput, window: float) -> None:
    """Check that no pulse is shorter than a window [s], which the macro model could not resolve.

    Raises:
        StepError: A pulse is shorter.
    """
    for name, pulse in pulses_of(request.loads).items():
        shortest = min(pulse_durations({name: pulse}), default=window)
        if shortest < window:
            raise StepError(
                f"loads.{name} lasts {shortest:.4g} s, less than the coupling window of {window:.4g} s; use"
                " smaller elements in the coarse layers, or remove dynamics.coupling"
            )


def _check_motions_at_interface(division: Division, tables: StructureTables, request: StructureInput) -> None:
    """Check that no prescribed motion acts on interface nodes that the meso model carries.

    Raises:
        CouplingError: A motion is prescribed at the interface with the impulse scheme.
    """
    for name, load in request.loads.items():
        if division.scheme == "impulse" and isinstance(load, PrescribedMotion):
            count = len(np.intersect1d(tables.nodes_of[load.on], tables.interface))
            if count:
                raise CouplingError(
                    f"loads.{name} prescribes the motion of {count} interface nodes, which coupling.scheme = impulse"
                    " does not support; use held_velocity, local_steps or gravouil_combescure"
                )


def _choose_fine_layers(whole: Whole, elements: Survey, coupling: LayerCoupling) -> tuple[str, ...]:
    """Return the fine layers: the ones named in the input or, without names, the ones with small critical steps.

    Raises:
        CouplingError: No layer is fine.
    """
    steps = {name: float(elements.step[whole.mesh.in_parts(name.__eq__)].min()) for name in whole.mesh.part_names}
    fine = fine_layers(coupling, steps)
    if not fine:
        step_list = ", ".join(f"{name} {step:.3g} s" for name, step in steps.items())
        raise CouplingError(
            f"no layer is fine: critical steps are {step_list}, none less than half of the longest; name the fine"
            " layers in dynamics.coupling.fine, or remove dynamics.coupling"
        )
    return fine
