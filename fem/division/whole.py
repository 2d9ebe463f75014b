"""Joined mesh of a run before division: ties, and properties of its elements."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.fitted import FittedTable
from reflowshock.fem.elements.element import critical_steps, element_geometry
from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.elements.mesh_elements import elements_of
from reflowshock.fem.errors import StepError
from reflowshock.fem.estimates.estimate import BOARD_ADVANTAGE, UPDATES_PER_SECOND
from reflowshock.fem.estimates.solver_cost import NONLINEAR_RATE, TURNING_BOX_RATE, TURNING_RATE
from reflowshock.fem.forces.force_congruent import is_box
from reflowshock.fem.mesh.column import COLUMN
from reflowshock.fem.mesh.facet import spring_rates
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.tie import Tie
from reflowshock.fem.problem.fittings import Support
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.materials.parameters import Material
from reflowshock.materials.roles import Materials, materials_of_parts, role_of_part

IN_COLUMN = "column"  # elements of board and substrate in the columns of fine joints


@dataclass(frozen=True, slots=True)
class Whole:
    """Mesh whose parts share nodes or are tied; slaves were moved onto their facets by at most ``moved`` [m]."""

    mesh: MeshData
    tie: Tie
    moved: float


@dataclass(frozen=True, slots=True)
class Treatment:
    """Formulation, kinematics and mass scaling of elements.

    Attributes:
        formulation: Formulation of hexahedra.
        kinematics: Small, corotational or finite kinematics.
        mass_scaled: Material roles with mass scaling, or ``IN_COLUMN``.
        scaled_step: Largest critical step after mass scaling [s].
    """

    formulation: str = HEXAHEDRON.name
    kinematics: Kinematics = "small"
    mass_scaled: Sequence[str] = ()
    scaled_step: float = np.inf


@dataclass(frozen=True, slots=True)
class Survey:
    """Properties of the elements of a mesh.

    Attributes:
        role: Material role, shape (ne,).
        plain_step: Critical step of the single element without mass scaling, shape (ne,) [s].
        factor: Factor of mass scaling on the density, shape (ne,).
        mass: Mass without mass scaling, shape (ne,) [kg].
        linear: Whether the force is linear in the displacement, shape (ne,).
        cost: Cost of an update relative to a box, shape (ne,).
    """

    role: NDArray[np.str_]
    plain_step: NDArray[np.float64]
    factor: NDArray[np.float64]
    mass: NDArray[np.float64]
    linear: NDArray[np.bool_]
    cost: NDArray[np.float64]

    @property
    def step(self) -> NDArray[np.float64]:
        """Critical step of the single element with mass scaling, shape (ne,) [s]."""
        return self.plain_step * np.sqrt(self.factor)

    @property
    def added_mass(self) -> NDArray[np.float64]:
        """Mass added by mass scaling, shape (ne,) [kg]."""
        return self.mass * (self.factor - 1.0)


def survey(mesh: MeshData, materials: Materials | Mapping[str, Material], treatment: Treatment) -> Survey:
    """Determine critical steps, masses, linearity and costs of the elements of a mesh.

    Args:
        mesh: Mesh with named parts.
        materials: One material for each role, or the material of each part by name.
        treatment: Formulation, kinematics and mass scaling of the elements.

    Returns:
        Arrays of shape (ne,): role, critical step [s], mass [kg], factor of mass scaling, linearity, relative cost.

    Raises:
        MeshError: An element is inverted.
        StepError: Every role has mass scaling.
    """
    names, assigned = materials_of_parts(mesh.part_names, materials)
    elements = elements_of(mesh.points, mesh.cells, mesh.part, assigned, treatment.formulation)
    geometry = element_geometry(elements.points, elements.cells)
    step = critical_steps(elements, geometry.nodal_volume)
    role = np.array(names)[mesh.part]
    scaled = mesh.in_parts(lambda name: role_of_part(name) in treatment.mass_scaled)
    if IN_COLUMN in treatment.mass_scaled:
        scaled |= mesh.in_parts(lambda name: COLUMN in name)
    elastic = np.array([material.plasticity is None for material in assigned])[mesh.part]
    linear = elastic & (treatment.kinematics == "small")
    box = is_box(mesh.points[mesh.cells])
    turning = elastic & (treatment.kinematics == "corotational") & (elements.kind.nodes == HEXAHEDRON.nodes)
    rate = np.where(turning, np.where(box, TURNING_BOX_RATE, TURNING_RATE), NONLINEAR_RATE[elements.kind.name])
    return Survey(
        role=role,
        plain_step=step,
        factor=_mass_factors(step, scaled, treatment),
        mass=elements.density * geometry.volume,
        linear=linear,
        cost=np.where(linear, np.where(box, 1.0, BOARD_ADVANTAGE), BOARD_ADVANTAGE * UPDATES_PER_SECOND / rate),
    )


def add_spring_stiffness(
    survey: Survey, mesh: MeshData, table: FittedTable | None, supports: Mapping[str, Support]
) -> Survey:
    """Return a survey with critical steps reduced by elastic supports.

    Args:
        survey: Properties of the elements without supports.
        mesh: Mesh of these elements.
        table: Facets of the elastic supports; None returns the same critical steps.
        supports: Name -> support with its stiffness per area [N/m^3].

    Returns:
        The survey (role, critical step, mass, linearity and cost of each element) with smaller critical steps at the
        facets.
    """
    added_frequency = np.zeros(len(survey.plain_step))  # squared circular frequency [1/s^2]
    for name, facets in table.bedded.items() if table else ():
        cells, corners = mesh.cells[facets.cells], mesh.points[facets.facets]
        geometry = element_geometry(mesh.points, cells)
        mass = (survey.mass[facets.cells] / geometry.volume)[:, None] * geometry.nodal_volume
        rates = spring_rates(cells, facets.facets, mass, corners, np.array(supports[name].stiffness))
        np.add.at(added_frequency, facets.cells, rates)
    return replace(survey, plain_step=2.0 / np.sqrt((2.0 / survey.plain_step) ** 2 + added_frequency))


def _mass_factors(step: NDArray[np.float64], scaled: NDArray[np.bool_], treatment: Treatment) -> NDArray[np.float64]:
    """Return the density factor that raises critical steps to those of unscaled elements or to a limit, shape (ne,).

    Args:
        step: Critical steps, shape (ne,) [s].
        scaled: Elements with mass scaling, shape (ne,).
        treatment: Mass scaling settings.

    Raises:
        StepError: Every element has mass scaling, and there is no limit.
    """
    target = min(float(step[~scaled].min(initial=np.inf)), treatment.scaled_step)
    if not np.isfinite(target):
        raise StepError(
            f"numerics.mass_scaled = {tuple(treatment.mass_scaled)} includes every role; omit at least one, whose"
            " elements determine the step"
        )
    return np.where(scaled, np.maximum(1.0, (target / step) ** 2), 1.0)


def touching(cells: NDArray[np.int32], nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which cells have at least one of the marked nodes, shape (ne,).

    Args:
        cells: Nodes of each cell, shape (ne, k).
        nodes: Whether each node is marked, shape (n,).
    """
    return nodes[cells].any(axis=1)


def nodes_of(cells: NDArray[np.int32], chosen: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Return which nodes belong to one of the chosen cells, shape (count,).

    Args:
        cells: Nodes of each cell, shape (ne, k).
        chosen: Chosen cells, shape (ne,).
        count: Number of nodes.
    """
    is_used = np.zeros(count, dtype=bool)
    is_used[cells[chosen]] = True
    return is_used


def seeds_of(whole: Whole, fine: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which nodes belong to fine cells or are masters of such a node, shape (n,).

    Args:
        whole: Joined mesh with its ties, n nodes.
        fine: Fine cells, shape (ne,).
    """
    nodes = nodes_of(whole.mesh.cells, fine, len(whole.mesh.points))
    nodes[whole.tie.master[nodes[whole.tie.slave]]] = True
    return nodes
