"""A structure as two models: which layers are fine, how they are divided, the tables of each."""

from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.division import Division
from reflowshock.fem.division.record import coupling_record
from reflowshock.fem.division.rules import Rules
from reflowshock.fem.division.split import Part, interface_between, part_of
from reflowshock.fem.division.structure_tables import StructureTables, structure_tables, tied
from reflowshock.fem.division.tables import ModelInput
from reflowshock.fem.division.whole import Survey, Treatment, Whole, survey
from reflowshock.fem.errors import CouplingError, StepError
from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.model.steps import steps_of_division
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.problem.structure import LayerCoupling, PrescribedMotion, fine_layers
from reflowshock.fem.setup.shock_models import Divided, told_to_all

DividedStructure = Divided[StructureTables]


def divided_structure(world: MPI.Comm, request: StructureInput) -> DividedStructure:
    """Read, check and divide the mesh of a structure on rank 0, and tell the other ranks; collective.

    Raises:
        AgreedError: A mesh that does not fit, or cannot be divided; on every rank.
    """
    return told_to_all(world, lambda: divided_on_one_rank(request))


def divided_on_one_rank(request: StructureInput) -> DividedStructure:
    """Read, check and divide the mesh of a structure; errors as ``tables``, ``coupling.checks``."""
    coupling, dynamics = request.dynamics.coupling, request.dynamics
    assert coupling is not None
    whole = tied(read_mesh(request.mesh), request)
    treatment = Treatment(request.structure.formulation, dynamics.kinematics, dynamics.numerics.mass_scaled)
    found = survey(whole.mesh, request.layer_materials, treatment)
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
    inputs = structure_inputs(whole, division, structure_tables(whole, request))
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


def structure_inputs(
    whole: Whole, division: Division, tables: StructureTables
) -> dict[Role, ModelInput[StructureTables]]:
    """Split a structure with its tables into the models ``macro`` and ``meso``.

    What both models have counts in the macro model.
    """
    macro, meso = part_of(whole, division.macro), part_of(whole, division.meso)
    interface = interface_between(whole, macro, meso)
    rest = np.where(macro.number < 0, meso.number, -1), np.where(macro.cell_number < 0, meso.cell_number, -1)
    level = division.level[division.meso]
    own = {
        "macro": restricted(whole, tables, macro, (macro.number, macro.cell_number)),
        "meso": replace(restricted(whole, tables, meso, rest), level=level, ratios=division.ratios),
    }
    parts: dict[Role, Part] = {"macro": macro, "meso": meso}
    return {
        role: ModelInput(
            part.mesh, replace(own[role], interface=part.number[interface]), np.flatnonzero(part.cell_number >= 0)
        )
        for role, part in parts.items()
    }


def restricted(
    whole: Whole, tables: StructureTables, part: Part, counted: tuple[NDArray[np.int32], NDArray[np.int32]]
) -> StructureTables:
    """Return the tables of a part of a structure.

    Args:
        whole: The structure.
        tables: Its tables.
        part: The part.
        counted: Own numbers of the nodes ``(n,)`` and cells ``(ne,)`` that are loaded and watched in this model, -1 for
            those of another one.
    """
    node, cell = counted
    mine = np.flatnonzero(part.number >= 0)
    order = mine[np.argsort(part.number[mine])]
    held = part.number[tables.held_nodes].astype(np.int64)
    return replace(
        tables,
        part=part.mesh.part,
        part_names=part.mesh.part_names,
        tie=part.tie,
        master_points=whole.mesh.points[order][part.tie.master],
        held_nodes=held[held >= 0],
        held=tables.held[held >= 0],
        nodes=part.nodes,
        level=np.zeros(len(part.mesh.cells), np.int32),
        nodes_of={name: present(node[nodes]) for name, nodes in tables.nodes_of.items()},
        areas={name: (present(node[nodes]), area[node[nodes] >= 0]) for name, (nodes, area) in tables.areas.items()},
        pressed={
            name: replace(item, facets=part.number[item.facets], cells=cell[item.cells])
            for name, item in tables.pressed.items()
        },
        watch=replace(
            tables.watch,
            nodes=node[tables.watch.nodes],
            cells=cell[tables.watch.cells],
            supports={name: (present(node[nodes]), held) for name, (nodes, held) in tables.watch.supports.items()},
        ),
    )


def present(numbers: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the numbers that are none of another model's."""
    return numbers[numbers >= 0]
