"""From the mesh of a structure to its tables: the work of one rank before anything is distributed."""

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
        nodes_of: Name -> nodes of a facet set that supports or motions act on.
        areas: Name -> nodes and outward areas of a facet set under pressure, see ``facet_areas.outward_areas``.
        pressed: Name -> the same facet set, for a pressure that follows it.
        pushed: Name of a force at a point -> nodes and their shares in it; on planes of symmetry they add up to the
            part that the meshed body bears.
        fitted: Watch points, gauges, supports and lumped masses.
    """

    nodes_of: dict[str, NDArray[np.integer]]
    areas: dict[str, tuple[NDArray[np.integer], NDArray[np.float64]]]
    pressed: dict[str, OutwardFacets]
    pushed: dict[str, Shares]
    fitted: FittedTable

    def counted(self, part: Part, node: NDArray[np.int32], cell: NDArray[np.int32]) -> dict[str, Any]:
        """Return facet sets and what is fitted."""
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


def tied(mesh: MeshData, problem: StructureProblem) -> Whole:
    """Tie the layers of a structure whose elements differ.

    Raises:
        MeshError: Cells of another shape, layers without elements or elements without layers.
        TieError: Layers whose elements differ do not touch.
    """
    check_layers(mesh, problem)
    return Whole(*tie_joints(mesh))


def structure_tables(whole: Whole, problem: StructureProblem) -> StructureTables:
    """Build the tables of a structure.

    Raises:
        MeshError, LoadError: As ``fitted``; a force outside, or a prescribed motion of what is held.
    """
    mesh, tie = whole.mesh, whole.tie
    moved = [load.on for load in problem.loads.values() if isinstance(load, OnNodes)]
    sets = [*(support.on for support in problem.supports.values()), *moved]
    nodes_of: dict[str, NDArray[np.integer]] = {}
    for name in sets:  # slaves follow their masters
        nodes_of[name] = np.setdiff1d(facet_set(mesh, name), tie.slave)
    pressed = {load.on for load in problem.loads.values() if isinstance(load, OnAreas)}
    held = held_by_supports(mesh, problem)
    check_motions(problem, nodes_of, held)
    check_shaken(problem, nodes_of, held)
    yields = bool(plastic_laws(problem.layer_materials))
    return StructureTables.undivided(
        whole,
        held,
        nodes_of=nodes_of,
        areas={name: outward_areas(mesh, name) for name in sorted(pressed)},
        pressed={name: outward_facets(mesh, name) for name in sorted(pressed)},
        pushed=pushed_nodes(mesh, problem),
        fitted=fitted(mesh, problem.fittings, problem.structure.symmetry, tie.slave, yields),
    )


def pushed_nodes(mesh: MeshData, problem: StructureProblem) -> dict[str, Shares]:
    """Return the nodes at forces and their shares, see ``StructureTables.pushed``; errors as ``structure_tables``."""
    found: dict[str, Shares] = {}
    for name, load in problem.loads.items():
        if isinstance(load, AtPoint):
            nodes, shares = point_shares(mesh, f"loads.{name}.at", load.at)
            found[name] = nodes, shares * 0.5 ** len(problem.structure.planes_at(load.at))
    return found


def check_layers(mesh: MeshData, problem: StructureProblem) -> None:
    """Compare the cells and the parts of the mesh with elements and layers; errors as ``tied``."""
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
            f"layers and parts of the mesh differ: layers without elements: {empty or 'none'}; parts that are no layer:"
            f" {foreign or 'none'}"
        )


def check_motions(problem: StructureProblem, nodes_of: dict[str, NDArray[np.integer]], held: NDArray[np.bool_]) -> None:
    """Refuse prescribed motions of held components ``(n, 3)``; errors as ``structure_tables``."""
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


def check_shaken(problem: StructureProblem, nodes_of: dict[str, NDArray[np.integer]], held: NDArray[np.bool_]) -> None:
    """Refuse a large mass on components ``(n, 3)`` that are held in space; errors as ``structure_tables``."""
    for name in shaken_supports(problem):
        nodes = nodes_of[problem.supports[name].on]
        count = int(held[nodes].any(axis=1).sum())
        if count:
            raise LoadError(
                f"a large mass cannot move supports.{name}: another support or a plane of symmetry holds {count} of its"
                f" {len(nodes)} nodes; method = direct can"
            )


def shaken_supports(problem: StructureProblem) -> list[str]:
    """Return the supports that a large mass moves: those that hold all components, where an input-G asks for it."""
    by_mass = any(load.is_large_mass for load in problem.loads.values())
    return [name for name, support in problem.supports.items() if by_mass and set(support.hold) == set(AXES)]


def held_by_supports(mesh: MeshData, problem: StructureProblem) -> NDArray[np.bool_]:
    """Return ``(n, 3)``: components that supports and planes of symmetry hold at zero."""
    shaken = shaken_supports(problem)
    rules = [(support.on, support.hold) for name, support in problem.supports.items() if name not in shaken]
    rules += [(f"{axis}_min", (axis,)) for axis in problem.structure.symmetry]
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    for name, components in rules:
        held[np.ix_(np.unique(facet_set(mesh, name)), np.array([AXES.index(axis) for axis in components], np.intp))] = (
            True
        )
    return held
