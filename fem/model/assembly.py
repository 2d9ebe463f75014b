"""Assembly of a model on one rank, from its mesh and tables to materials, masses, force terms and tie."""

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
class RankElements:
    """Elements of one rank with their materials and critical steps, before mass scaling.

    Attributes:
        local: Mesh of the rank.
        elements: Elements with the density of their material.
        geometry: Volumes and mean gradients of the elements.
        steps: Critical step of each element, shape (ne,) [s].
        roles: Material role of each element, shape (ne,).
        parts: Part number of each element, shape (ne,).
        materials: Material of each part.
        laws: UFL material law by part number, used instead of the material.
    """

    local: LocalMesh
    elements: Elements
    geometry: Geometry
    steps: NDArray[np.float64]
    roles: NDArray[np.str_]
    parts: NDArray[np.int32]
    materials: tuple[Material, ...]
    laws: Mapping[int, Law] = field(default_factory=dict)

    def with_laws(self, part_names: Sequence[str], laws: Mapping[str, Law]) -> "RankElements":
        """Replace the materials of some parts by UFL laws; the densities remain.

        Args:
            part_names: Part names of the model's tables.
            laws: UFL law by part name.

        Raises:
            ValueError: A part does not exist.
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
    """Options of the internal force apart from elements and materials.

    Attributes:
        kinematics: Small, corotational or finite kinematics.
        step: Time step of rate-dependent laws and of local time steps [s]; infinity for quasi-static loading.
        stiffness: Coefficient beta of stiffness-proportional damping [s], which local time steps allow for.
    """

    kinematics: Kinematics = "small"
    step: float = np.inf
    stiffness: float = 0.0


def make_rank_elements(
    local: LocalMesh,
    tables: Tables,
    materials: Materials | Mapping[str, Material],
    formulation: str = HEXAHEDRON.name,
) -> RankElements:
    """Assign materials to the elements of this rank and compute their critical steps; not collective.

    Args:
        local: ``LocalMesh``, cells and nodes of this rank.
        tables: ``Tables`` of the model (parts, ties, supports, step levels), equal on all ranks.
        materials: ``Materials`` with one material per role, or one material by part name.
        formulation: Formulation of hexahedra, see ``element.element_kind``.

    Returns:
        Elements of this rank; its mesh also has the masters of this rank's slaves.

    Raises:
        RankError: This rank has no element.
        MeshError: An element is inverted.
    """
    if not len(local.cells):
        raise RankError("a rank has no element of the mesh; use fewer ranks")
    local = _sorted_by_pace(local.with_nodes(*_masters_of(local, tables)), tables)
    number = tables.part[local.cell_numbers]
    names, assigned = materials_of_parts(tables.part_names, materials)
    elements = elements_of(local.points, local.cells, number, assigned, formulation)
    geometry = element_geometry(elements.points, elements.cells)
    steps = critical_steps(elements, geometry.nodal_volume)
    roles = np.array(names)[number]
    return RankElements(local, elements, geometry, steps, roles, number, assigned)


def _sorted_by_pace(local: LocalMesh, tables: Tables) -> LocalMesh:
    """Return a mesh with nodes sorted by the smallest pace of their elements."""
    largest = int(tables.every.max())
    if largest == 1:
        return local
    paces = tables.every[local.cell_numbers]
    _, node_paces = paces_of_nodes(local.cells, paces, _local_tie(local, tables.tie), len(local.nodes), largest)
    return local.reordered(np.argsort(node_paces, kind="stable"))


def _masters_of(local: LocalMesh, tables: Tables) -> tuple[NDArray[np.integer], NDArray[np.float64]]:
    """Return nodes (k,) and points (k, 3) [m] of the masters of this rank's slaves."""
    local_slaves = local.locate(tables.tie.slave) >= 0
    return tables.tie.master[local_slaves].ravel(), tables.master_points[local_slaves].reshape(-1, 3)


def _local_tie(local: LocalMesh, tie: Tie) -> Tie:
    """Return the rows of a tie whose slaves are on this rank, in local node numbers."""
    slave = local.locate(tie.slave)
    is_local = slave >= 0
    return Tie(slave[is_local], local.locate(tie.master[is_local].ravel()).reshape(-1, 4), tie.weight[is_local])


def make_body(
    comm: MPI.Comm,
    rank_elements: RankElements,
    tables: Tables,
    mass_factor: NDArray[np.float64],
    response: ForceOptions | None = ForceOptions(),
) -> Body:
    """Assemble masses and force terms of a model, and compile their kernels; collective.

    Args:
        comm: Communicator of the model.
        rank_elements: Elements of the rank.
        tables: ``Tables`` of the model (parts, ties, supports, step levels), equal on all ranks.
        mass_factor: Factor on the density of each of this rank's elements, shape (ne,); ones without mass scaling.
        response: Kinematics and step; None for linear elastic terms, also for plastic materials.

    Returns:
        Model of this rank, without attached masses and elastic supports.

    Raises:
        MassError: Lumped masses differ from density times volume; on every rank.
        LevelError: Local time steps do not support a material, law or kinematics; on every rank.
    """
    local = rank_elements.local
    plain = rank_elements.elements
    elements = replace(plain, density=plain.density * mass_factor)
    shared = SharedNodes(comm, local.nodes)
    tie = _local_tie(local, tables.tie)
    mass = _assembled_mass(elements, rank_elements.geometry, tie, shared)
    _check_mass(comm, float(mass[shared.owned].sum()), float(elements.density @ rank_elements.geometry.volume))
    free = np.ones((len(local.nodes), 3), dtype=bool)
    held = local.locate(tables.held_nodes)
    free[held[held >= 0]] = ~tables.held[held >= 0]
    free[tie.slave] = False
    interface = local.locate(tables.interface).astype(np.int32)
    body = Body(local, elements, rank_elements.geometry, [], tie, shared, interface, mass, free)
    if response and tables.every.max() > 1:
        body = _with_paces(body, rank_elements, tables, response)
    else:
        terms = _response_terms(comm, body, rank_elements, tables, response) if response else linear_terms(elements)
        body = replace(body, terms=terms)
    warm_up(body.terms, len(mass))
    return body


def _with_paces(body: Body, rank_elements: RankElements, tables: Tables, response: ForceOptions) -> Body:
    """Return a body with separate force terms for the elements of each pace.

    Raises:
        LevelError: An element has a UFL law; on every rank.
    """
    if rank_elements.laws:
        raise LevelError("a UFL law needs every time step; set coupling.levels = 1")
    element_paces, schedule = tables.every[body.local.cell_numbers], np.unique(tables.every).tolist()
    terms: list[ForceTerm] = []
    paces: list[int] = []
    for pace in schedule:
        step = pace * response.step
        pace_terms = terms_of(body.elements, element_paces == pace, rank_elements.materials, response.kinematics, step)
        terms, paces = [*terms, *pace_terms], [*paces, *[pace] * len(pace_terms)]
    return replace(body, terms=terms, paces=tuple(paces), schedule=tuple(schedule), element_paces=element_paces)


def _response_terms(
    comm: MPI.Comm, body: Body, rank_elements: RankElements, tables: Tables, response: ForceOptions
) -> list[ForceTerm]:
    """Return the force terms of a body, with one term for all elements that take local time steps; collective.

    Raises:
        LevelError: A body with local time steps has an element that is not linear elastic; on every rank.
    """
    if not tables.level.any():
        return force_terms(
            body.elements, rank_elements.materials, response.kinematics, response.step, rank_elements.laws
        )
    if rank_elements.laws:
        raise LevelError("a UFL law does not support local time steps; choose a coupling.scheme other than local_steps")
    check_elastic(rank_elements.materials, response.kinematics, tables.ratios)
    level = tables.level[body.local.cell_numbers]
    levels = SubsteppedElements.build(
        comm, body, Levels(level, tables.ratios, response.step, response.stiffness / response.step)
    )
    return [*linear_terms(body.elements.subset(level == 0)), levels]


def warm_up(terms: Sequence[ForceTerm], count: int) -> None:
    """Compile the kernels of the force terms before timing starts: compute the force at rest.

    Args:
        terms: Force terms at rest, without displacement so far; their history does not change.
        count: Number of nodes of this rank.
    """
    for term in terms:
        term.add(np.zeros((count, 3)), np.zeros((count, 3)))


def _assembled_mass(elements: Elements, geometry: Geometry, tie: Tie, shared: SharedNodes) -> NDArray[np.float64]:
    """Return the lumped mass over all ranks, moved from slaves to masters, rowsum(T^T M T), shape (n,) [kg]."""
    column = np.repeat(lumped_mass(elements, geometry.nodal_volume)[:, None], 3, axis=1)
    tie.gather(column)
    shared.add(column)
    return np.ascontiguousarray(column[:, 0])


def _check_mass(comm: MPI.Comm, lumped: float, integrated: float) -> None:
    """Check that lumped masses [kg] add up to density times volume [kg] over all ranks; collective.

    Raises:
        MassError: They differ by a fraction of more than ``MASS_TOLERANCE``.
    """
    lumped, integrated = comm.allreduce(lumped), comm.allreduce(integrated)
    if abs(lumped - integrated) > MASS_TOLERANCE * integrated:
        raise MassError(f"lumped masses add up to {lumped:.12e} kg, but density times volume is {integrated:.12e} kg")
