"""From the mesh of a rank and the tables of its model to a body: materials, masses, force terms, tie."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.tables import Tables
from reflowshock.fem.elements.element import Elements, critical_steps, element_geometry, lumped_mass
from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.elements.kind import Geometry
from reflowshock.fem.elements.mesh_elements import elements_of
from reflowshock.fem.errors import LevelError, MassError, RankError
from reflowshock.fem.forces.force import ForceTerm, force_terms, linear_terms, terms_of
from reflowshock.fem.forces.force_ufl import Law, tangent_at_rest
from reflowshock.fem.mesh.tie import Tie
from reflowshock.fem.model.body import Body, paces_of_nodes
from reflowshock.fem.model.step_levels import Levels, SubsteppedElements, check_elastic
from reflowshock.fem.parallel.exchange import SharedNodes
from reflowshock.fem.parallel.local_mesh import LocalMesh
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.materials.parameters import Material
from reflowshock.materials.roles import Materials, materials_of_parts

MASS_TOLERANCE = 1e-10


@dataclass(frozen=True, slots=True)
class Pieces:
    """The elements of one rank before their masses are fixed.

    Attributes:
        local: The rank's mesh.
        elements: Its elements with the density of their material.
        geometry: Their volumes and mean gradients.
        steps: ``(ne,)`` critical step of each element [s].
        roles: ``(ne,)`` material role of each element.
        parts: ``(ne,)`` part of each element.
        materials: Material of each part.
        laws: Part -> law in UFL in the place of its material.
    """

    local: LocalMesh
    elements: Elements
    geometry: Geometry
    steps: NDArray[np.float64]
    roles: NDArray[np.str_]
    parts: NDArray[np.int32]
    materials: tuple[Material, ...]
    laws: Mapping[int, Law] = field(default_factory=dict)

    def with_laws(self, part_names: Sequence[str], laws: Mapping[str, Law]) -> "Pieces":
        """Give parts laws in UFL: they take the place of their material, whose density remains.

        Args:
            part_names: Of the model's tables.
            laws: Name of a part -> law.

        Raises:
            ValueError: There is no such part.
        """
        missing = [name for name in laws if name not in part_names]
        if missing:
            raise ValueError(f"part {missing[0]!r} does not exist; parts: {', '.join(part_names)}")
        steps, numbered = self.steps.copy(), {list(part_names).index(name): law for name, law in laws.items()}
        for part, law in numbered.items():
            chosen = np.flatnonzero(self.parts == part)
            if len(chosen):
                volume, tangent = self.geometry.nodal_volume[chosen], partial(tangent_at_rest, law=law)
                steps[chosen] = critical_steps(self.elements.subset(chosen), volume, tangent)
        return replace(self, steps=steps, laws=numbered)


@dataclass(frozen=True, slots=True)
class ForceOptions:
    """What the internal force depends on besides elements and materials.

    Attributes:
        kinematics: Whether rotations and strains are small.
        step: dt [s], of laws that depend on the rate, and of levels below it; infinity stands for slow.
        stiffness: beta of damping [s], which levels make room for.
    """

    kinematics: Kinematics = "small"
    step: float = np.inf
    stiffness: float = 0.0


def make_pieces(
    local: LocalMesh,
    tables: Tables,
    materials: Materials | Mapping[str, Material],
    formulation: str = HEXAHEDRON.name,
) -> Pieces:
    """Give the local elements their materials, and find their critical steps.

    Args:
        local: The rank's mesh.
        tables: The model's tables.
        materials: Material of each role, or of each part.
        formulation: Of hexahedra, see ``element.element_kind``.

    Raises:
        RankError: There is no element on this rank.
        MeshError: An element is turned inside out.
    """
    if not len(local.cells):
        raise RankError("a rank has no element of the mesh: take fewer ranks")
    local = often_moved_first(local.with_nodes(*masters_of(local, tables)), tables)
    number = tables.part[local.cell_numbers]
    names, assigned = materials_of_parts(tables.part_names, materials)
    elements = elements_of(local.points, local.cells, number, assigned, formulation)
    geometry = element_geometry(elements.points, elements.cells)
    steps = critical_steps(elements, geometry.nodal_volume)
    roles = np.array(names)[number]
    return Pieces(local, elements, geometry, steps, roles, number, assigned)


def often_moved_first(local: LocalMesh, tables: Tables) -> LocalMesh:
    """Return a mesh with its nodes in the order of the smallest pace at which elements act on them."""
    largest = int(tables.every.max())
    if largest == 1:
        return local
    every = tables.every[local.cell_numbers]
    _, node = paces_of_nodes(local.cells, every, local_tie(local, tables.tie), len(local.nodes), largest)
    return local.reordered(np.argsort(node, kind="stable"))


def masters_of(local: LocalMesh, tables: Tables) -> tuple[NDArray[np.integer], NDArray[np.float64]]:
    """Return the masters of this rank's slaves: nodes ``(k,)``, points ``(k, 3)`` [m]."""
    here = local.locate(tables.tie.slave) >= 0
    return tables.tie.master[here].ravel(), tables.master_points[here].reshape(-1, 3)


def local_tie(local: LocalMesh, tie: Tie) -> Tie:
    """Return the rows of a tie that belong to this rank's nodes, in local numbers."""
    slave = local.locate(tie.slave)
    here = slave >= 0
    return Tie(slave[here], local.locate(tie.master[here].ravel()).reshape(-1, 4), tie.weight[here])


def make_body(
    comm: MPI.Comm,
    pieces: Pieces,
    tables: Tables,
    mass_factor: NDArray[np.float64],
    response: ForceOptions | None = ForceOptions(),
) -> Body:
    """Assemble masses and forces of a model; collective.

    Args:
        comm: Communicator of the model.
        pieces: The rank's elements.
        tables: The model's tables.
        mass_factor: ``(ne,)`` factor on the density of each element.
        response: Kinematics and step; None for elastic terms at small strains whatever the materials.
    """
    local = pieces.local
    plain = pieces.elements
    elements = replace(plain, density=plain.density * mass_factor)
    shared = SharedNodes(comm, local.nodes)
    tie = local_tie(local, tables.tie)
    mass = assembled_mass(elements, pieces.geometry, tie, shared)
    check_mass(comm, float(mass[shared.owned].sum()), float(elements.density @ pieces.geometry.volume))
    free = np.ones((len(local.nodes), 3), dtype=bool)
    held = local.locate(tables.held_nodes)
    free[held[held >= 0]] = ~tables.held[held >= 0]
    free[tie.slave] = False
    interface = local.locate(tables.interface).astype(np.int32)
    body = Body(local, elements, pieces.geometry, [], tie, shared, interface, mass, free)
    if response and tables.every.max() > 1:
        body = with_paces(body, pieces, tables, response)
    else:
        terms = response_terms(comm, body, pieces, tables, response) if response else linear_terms(elements)
        body = replace(body, terms=terms)
    warm_up(body.terms, len(mass))
    return body


def with_paces(body: Body, pieces: Pieces, tables: Tables, response: ForceOptions) -> Body:
    """Return a body with force terms for each of the paces at which its elements act.

    Raises:
        LevelError: Some elements have a law in UFL; on every rank.
    """
    if pieces.laws:
        raise LevelError("parts with a law in UFL act in each step: choose coupling.levels = 1")
    every, schedule = tables.every[body.local.cell_numbers], np.unique(tables.every).tolist()
    terms: list[ForceTerm] = []
    paces: list[int] = []
    for pace in schedule:
        step = pace * response.step
        found = terms_of(body.elements, every == pace, pieces.materials, response.kinematics, step)
        terms, paces = [*terms, *found], [*paces, *[pace] * len(found)]
    return replace(body, terms=terms, paces=tuple(paces), schedule=tuple(schedule), element_paces=every)


def response_terms(
    comm: MPI.Comm, body: Body, pieces: Pieces, tables: Tables, response: ForceOptions
) -> list[ForceTerm]:
    """Return the force terms of a body, one of them with all elements that take smaller steps; collective.

    Raises:
        LevelError: Not all elements of a body with levels are linear elastic; on every rank.
    """
    if not tables.level.any():
        return force_terms(body.elements, pieces.materials, response.kinematics, response.step, pieces.laws)
    if pieces.laws:
        raise LevelError("parts with a law in UFL take no smaller steps: choose a coupling scheme without local steps")
    check_elastic(pieces.materials, response.kinematics, tables.ratios)
    level = tables.level[body.local.cell_numbers]
    levels = SubsteppedElements.build(
        comm, body, Levels(level, tables.ratios, response.step, response.stiffness / response.step)
    )
    return [*linear_terms(body.elements.subset(level == 0)), levels]


def warm_up(terms: Sequence[ForceTerm], count: int) -> None:
    """Have the kernels of terms compiled before the first step, whose time is measured; rest leaves no path."""
    for term in terms:
        term.add(np.zeros((count, 3)), np.zeros((count, 3)))


def assembled_mass(elements: Elements, geometry: Geometry, tie: Tie, shared: SharedNodes) -> NDArray[np.float64]:
    """Return the lumped mass ``(n,)`` [kg] summed over ranks, the slaves' moved to their masters: rowsum(N^T M N)."""
    column = np.repeat(lumped_mass(elements, geometry.nodal_volume)[:, None], 3, axis=1)
    tie.gather(column)
    shared.add(column)
    return np.ascontiguousarray(column[:, 0])


def check_mass(comm: MPI.Comm, lumped: float, integrated: float) -> None:
    """Compare the sum of lumped masses with density times volume over all ranks.

    Raises:
        MassError: They differ by more than 1e-10.
    """
    lumped, integrated = comm.allreduce(lumped), comm.allreduce(integrated)
    if abs(lumped - integrated) > MASS_TOLERANCE * integrated:
        raise MassError(f"lumped masses add up to {lumped:.12e} kg, density times volume to {integrated:.12e} kg")
