"""Tables of the fittings of a board or structure: watch points, strain gauges, supports, lumped masses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.facet_areas import OutwardFacets, facet_set, outward_facets
from reflowshock.fem.mesh.gauge_table import GaugeTable
from reflowshock.fem.mesh.mesh import MeshData, selected_cells
from reflowshock.fem.mesh.point_shares import point_shares
from reflowshock.fem.mesh.point_table import PointTable, Support, point_table
from reflowshock.fem.problem.fittings import AXES, Fittings, PointMass, StrainGauge

ROUNDING = 1e-9  # distance relative to the mesh below which points coincide
Shares = tuple[NDArray[np.integer], NDArray[np.float64]]
Gauge = tuple[NDArray[np.float64], float, NDArray[np.int64], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class FittedTable:
    """Fittings of a mesh, in input numbers.

    Attributes:
        points: Watch points, gauges and supports.
        bedded: Facets of each elastic support by name.
        masses: Nodes with lumped masses, and the mass at each [kg].
    """

    points: PointTable
    bedded: dict[str, OutwardFacets]
    masses: Shares

    def within(
        self, node: NDArray[np.integer], cell: NDArray[np.integer], every_node: NDArray[np.int32]
    ) -> "FittedTable":
        """Return the fittings of one model in its own numbers.

        Args:
            node: Number of each node in the model, -1 if it counts in another model, shape (n,).
            cell: Number of each cell in the model, -1 if it counts in another model, shape (ne,).
            every_node: Number of each node in the model, interface nodes included, shape (n,).
        """
        nodes, masses = node[self.masses[0]], self.masses[1]
        bedded = {
            name: replace(item, facets=every_node[item.facets], cells=cell[item.cells])
            for name, item in self.bedded.items()
        }
        return FittedTable(self.points.within(node, cell), bedded, (nodes[nodes >= 0], masses[nodes >= 0]))


def fitted(mesh: MeshData, fittings: Fittings, symmetry: Sequence[str], slaves: NDArray, yields: bool) -> FittedTable:
    """Return the tables of the fittings (supports, lumped masses, watch points, gauges) of a mesh.

    Args:
        mesh: Mesh of the whole body.
        fittings: Fittings of the input.
        symmetry: Axes ``x``, ``y``, ``z`` that are normal to a symmetry plane through the origin; may be empty.
        slaves: Slave nodes, which follow their masters and are not held, shape (ns,).
        yields: Whether plastic strain is watched.

    Returns:
        Nodes and cells of the fittings in the numbers of this mesh.

    Raises:
        MeshError: A watch point is outside the mesh.
        LoadError: A facet set is empty, or a mass or the end of a gauge is outside the mesh.
    """
    supports: dict[str, Support] = {
        name: (np.setdiff1d(facet_set(mesh, support.on), slaves), np.isin(list(AXES), support.hold))
        for name, support in fittings.supports.items()
    }
    points = point_table(mesh, {name: point.at for name, point in fittings.watch.items()}, supports, yields)
    return FittedTable(
        points=replace(points, gauges=_gauge_table(mesh, fittings.gauges, symmetry)),
        bedded={name: outward_facets(mesh, item.on) for name, item in fittings.supports.items() if item.bedding},
        masses=_lumped_masses(mesh, fittings.masses, symmetry),
    )


def fit_to_mesh(mesh: MeshData, chosen: NDArray[np.bool_], fittings: Fittings, yields: bool) -> FittedTable:
    """Return the fittings (supports, masses, watch points, gauges) of selected cells, such as the board.

    Args:
        mesh: Whole mesh.
        chosen: Cells that carry the fittings, shape (ne,).
        fittings: Fittings of the input.
        yields: Whether plastic strain is watched.

    Returns:
        Tables in the node and cell numbers of the whole mesh.

    Raises:
        MeshError: No cell is selected, or a watch point is outside the selected cells.
        LoadError: A facet set is empty, or a mass or the end of a gauge is outside the selected cells.
    """
    body, number = selected_cells(mesh, chosen)
    symmetry = [axis for axis in AXES if len(body.facets_of(f"symmetry_{axis}"))]
    nodes, cells = np.flatnonzero(number >= 0).astype(np.int32), np.flatnonzero(chosen)
    return fitted(body, fittings, symmetry, np.empty(0, np.int32), yields).within(nodes, cells, nodes)


def _lumped_masses(mesh: MeshData, masses: Mapping[str, PointMass], symmetry: Sequence[str]) -> Shares:
    """Return the nodes with lumped masses and the mass at each [kg]; arguments and errors as in ``fitted``."""
    nodes, shares = [np.empty(0, np.int64)], [np.empty(0)]
    margin = ROUNDING * float(np.ptp(mesh.points, axis=0).max())
    for name, item in masses.items():
        for position, part in item.meshed_places(symmetry, margin):
            around, share = point_shares(mesh, f"masses.{name}.at", position)
            nodes.append(around)
            shares.append(item.mass * part * share)
    numbers, where = np.unique(np.concatenate(nodes), return_inverse=True)
    total = np.zeros(len(numbers))
    np.add.at(total, where.reshape(-1), np.concatenate(shares))
    return numbers, total


def _gauge_table(mesh: MeshData, gauges: Mapping[str, StrainGauge], symmetry: Sequence[str]) -> GaugeTable:
    """Return the table of strain gauges; arguments and errors as in ``fitted``."""
    located = [_find_gauge(mesh, name, gauge, symmetry) for name, gauge in gauges.items()]
    if not located:
        return GaugeTable.none()
    directions, lengths, nodes, weights = zip(*located, strict=True)
    return GaugeTable(
        names=tuple(gauges),
        direction=np.array(directions),
        length=np.array(lengths),
        nodes=np.concatenate(nodes),
        gauge=np.repeat(np.arange(len(located)), [len(around) for around in nodes]),
        weight=np.concatenate(weights),
    )


def _find_gauge(mesh: MeshData, name: str, gauge: StrainGauge, symmetry: Sequence[str]) -> Gauge:
    """Return direction (3,), length [m], nodes (k,) and weights (k, 3) of a gauge, see ``GaugeTable``.

    The mirror image replaces an end beyond a symmetry plane.
    """
    heights = mesh.points[mesh.cells][:, :, 2]
    middle = np.array([*gauge.at, heights.max() if gauge.face == "upper" else heights.min()])
    direction = np.array([*gauge.direction, 0.0]) / np.linalg.norm(gauge.direction)
    around, _ = point_shares(mesh, f"gauges.{name}.at", tuple(middle.tolist()))
    length = max(gauge.length, float(np.ptp(mesh.points[around] @ direction)))
    nodes, weights = [], []
    for side in (1.0, -1.0):
        end = middle + 0.5 * side * length * direction
        mirror = np.array([-1.0 if axis in symmetry and x < 0.0 else 1.0 for axis, x in zip(AXES, end, strict=True)])
        near, share = point_shares(mesh, f"gauges.{name}: the end at", tuple((mirror * end).tolist()))
        nodes.append(near)
        weights.append(np.outer(side / length * share, mirror))
    return direction, length, np.concatenate(nodes), np.concatenate(weights)
