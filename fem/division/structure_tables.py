"""Tables of a structure from its mesh, computed on one rank before distribution."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.fitted import FittedTable, Shares, fitted
from reflowshock.fem.division.split import Part
from reflowshock.fem.division.tables import Tables, present
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.errors import LoadError, MeshError
from reflowshock.fem.estimates.material_effects import plastic_laws
from reflowshock.fem.mesh.facet_areas import OutwardFacets, facet_set, outward_areas, outward_facets
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.point_shares import point_shares
from reflowshock.fem.mesh.tie import tie_joints
from reflowshock.fem.problem.fittings import AXES
from reflowshock.fem.problem.load_kinds import AtPoint, OnAreas, OnNodes, PrescribedMotion
from reflowshock.fem.problem.structure import StructureProblem

NODES = {"hexahedron": 8, "tetrahedron": 4, "tetrahedron_quadratic": 10}


@dataclass(frozen=True, slots=True)
class StructureTables(Tables):
    """Tables of a structure.

    Attributes:
        nodes_of: Nodes of each facet set with a support or a motion, by name.
        areas: Nodes and outward areas of each facet set under pressure, see ``facet_areas.outward_areas``.
        pressed: Facets of each facet set under pressure, for follower pressure.
        pushed: Nodes and their shares of each point force, by name; on symmetry planes the shares add up to the
            fraction that acts on the meshed body.
        fitted: Watch points, gauges, supports and lumped masses.
    """

    nodes_of: dict[str, NDArray[np.integer]]
    areas: dict[str, tuple[NDArray[np.integer], NDArray[np.float64]]]
    pressed: dict[str, OutwardFacets]
    pushed: dict[str, Shares]
    fitted: FittedTable

    def restricted(self, part: Part, node: NDArray[np.int32], cell: NDArray[np.int32]) -> dict[str, Any]:
        """Return facet sets and fittings in the numbers of a model."""
        return {
            "nodes_of": {name: present(node[nodes]) for name, nodes in self.nodes_of.items()},
            "areas": {
                name: (present(node[nodes]), area[node[nodes] >= 0]) for name, (nodes, area) in self.areas.items()
            },
            "pressed": {
                name: replace(item, facets=part.number[item.facets], cells=cell[item.cells])
                for name, item in self.pressed.items()
            },
            "pushed": {
                name: (present(node[nodes]), share[node[nodes] >= 0]) for name, (nodes, share) in self.pushed.items()
            },
            "fitted": self.fitted.within(node, cell, part.number),
        }


def tie_layers(mesh: MeshData, problem: StructureProblem) -> Whole:
    """Tie layers of a structure with different meshes.

    Args:
        mesh: Mesh of the structure with facet sets ``slave@...`` and ``master@...`` where meshes do not match.
        problem: Parameters of the structure, with its layers and cell shape.

    Returns:
        Mesh with slave nodes moved onto the master facets, their ties, and the largest such move [m].

    Raises:
        MeshError: The cell shape, or the set of layers, differs between mesh and input.
        TieError: Layers with different meshes do not touch.
    """
    _check_layers(mesh, problem)
    return Whole(*tie_joints(mesh))


def structure_tables(whole: Whole, problem: StructureProblem) -> StructureTables:
    """Build the tables of a structure: ties, fixed components, nodes and areas of loads, fittings.

    Args:
        whole: Mesh of the structure with its ties.
        problem: Parameters of the structure, with loads and supports.

    Returns:
        Tables in the node and cell numbers of the undivided mesh.

    Raises:
        MeshError: A watch point is outside the mesh.
        LoadError: A facet set is missing or empty; a force, a mass or the end of a gauge is outside the mesh; or a
            motion acts on a fixed component.
    """
    mesh, tie = whole.mesh, whole.tie
    moved = [load.on for load in problem.loads.values() if isinstance(load, OnNodes)]
    sets = [*(support.on for support in problem.supports.values()), *moved]
    nodes_of: dict[str, NDArray[np.integer]] = {}
    for name in sets:  # slaves follow their masters
        nodes_of[name] = np.setdiff1d(facet_set(mesh, name), tie.slave)
    pressed = {load.on for load in problem.loads.values() if isinstance(load, OnAreas)}
    held = _held_by_supports(mesh, problem)
    _check_motions(problem, nodes_of, held)
    _check_shaken(problem, nodes_of, held)
    yields = bool(plastic_laws(problem.layer_materials))
    return StructureTables.undivided(
        whole,
        held,
        nodes_of=nodes_of,
        areas={name: outward_areas(mesh, name) for name in sorted(pressed)},
        pressed={name: outward_facets(mesh, name) for name in sorted(pressed)},
        pushed=_pushed_nodes(mesh, problem),
        fitted=fitted(mesh, problem.fittings, problem.structure.symmetry, tie.slave, yields),
    )


def _pushed_nodes(mesh: MeshData, problem: StructureProblem) -> dict[str, Shares]:
    """Return nodes and shares of the point forces, see ``StructureTables.pushed``; raises as ``structure_tables``."""
    pushed: dict[str, Shares] = {}
    for name, load in problem.loads.items():
        if isinstance(load, AtPoint):
            nodes, shares = point_shares(mesh, f"loads.{name}.at", load.at)
            pushed[name] = nodes, shares * 0.5 ** len(problem.structure.planes_at(load.at))
    return pushed


def _check_layers(mesh: MeshData, problem: StructureProblem) -> None:
    """Check that cells and parts of the mesh match elements and layers of the input; raises as ``tie_layers``."""
    element = problem.structure.element
    if mesh.shape.nodes != NODES[element]:
        raise MeshError(
            f"structure.element = {element} has {NODES[element]} nodes, the cells of the mesh ({mesh.shape.name}) have"
            f" {mesh.shape.nodes}"
        )
    layers, parts = set(problem.structure.layers), set(mesh.part_names)
    if layers != parts:
        empty, foreign = ", ".join(sorted(layers - parts)), ", ".join(sorted(parts - layers))
        raise MeshError(
            f"layers and parts of the mesh differ: layers without elements: {empty or 'none'}; parts without a layer:"
            f" {foreign or 'none'}"
        )


def _check_motions(
    problem: StructureProblem, nodes_of: dict[str, NDArray[np.integer]], held: NDArray[np.bool_]
) -> None:
    """Check that no motion acts on fixed components, shape (n, 3); raises as ``structure_tables``."""
    for name, load in problem.loads.items():
        if not isinstance(load, PrescribedMotion):
            continue
        nodes = nodes_of[load.on]
        count = int(held[nodes, AXES.index(load.component)].sum())
        if count:
            raise LoadError(
                f"loads.{name} moves {load.on} along {load.component}, where a support or a plane of symmetry holds"
                f" {count} of its {len(nodes)} nodes"
            )


def _check_shaken(problem: StructureProblem, nodes_of: dict[str, NDArray[np.integer]], held: NDArray[np.bool_]) -> None:
    """Check that no large mass acts on fixed components, shape (n, 3); raises as ``structure_tables``."""
    for name in shaken_supports(problem):
        nodes = nodes_of[problem.supports[name].on]
        count = int(held[nodes].any(axis=1).sum())
        if count:
            raise LoadError(
                f"a large mass cannot move supports.{name}: another support or a plane of symmetry holds {count} of its"
                f" {len(nodes)} nodes; method = direct can"
            )


def shaken_supports(problem: StructureProblem) -> list[str]:
    """Return the names of the supports that a large mass moves: those that fix x, y and z.

    Args:
        problem: Parameters of the structure; the result is empty if none of its loads is an input acceleration by a
            large mass.
    """
    by_mass = any(load.is_large_mass for load in problem.loads.values())
    return [name for name, support in problem.supports.items() if by_mass and set(support.hold) == set(AXES)]


def _held_by_supports(mesh: MeshData, problem: StructureProblem) -> NDArray[np.bool_]:
    """Return the components that supports and symmetry planes fix, shape (n, 3)."""
    shaken = shaken_supports(problem)
    rules = [(support.on, support.hold) for name, support in problem.supports.items() if name not in shaken]
    rules += [(f"{axis}_min", (axis,)) for axis in problem.structure.symmetry]
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    for name, components in rules:
        held[np.ix_(np.unique(facet_set(mesh, name)), np.array([AXES.index(axis) for axis in components], np.intp))] = (
            True
        )
    return held
