"""Watch points, strain gauges and supports of a structure or a board in input numbers.

Strain and stress at a point follow from a linear field fitted to the means of the elements around it, which are their
best known values (superconvergent patch recovery: Zienkiewicz & Zhu, IJNME 33, 1992). Two rings of elements carry it to
a surface, which bending needs. Where one layer of elements is all there is, no gradient across it can be known, and the
value is that of the layer's middle.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.gauge_table import GaugeTable
from reflowshock.fem.mesh.mesh import MeshData

NEARNESS = 2.0  # in the weight exp(-2 d^2) of an element, d its distance in sizes of the nearest ones
SMALLEST = 1e-6  # of the largest singular value: below it a direction is not covered


ROUNDING = 1e-9  # of the mesh: closer than that is the same place
Support = tuple[NDArray[np.integer], NDArray[np.bool_]]
COMPONENTS = {"displacement": 3, "velocity": 3, "strain": 6, "stress": 6, "plastic_strain": 1}


@dataclass(frozen=True, slots=True)
class PointTable:
    """Watch points, gauges and supports in input numbers.

    Attributes:
        names: Of the points.
        nodes: ``(p,)`` the node nearest to each point.
        points: ``(p, 3)`` [m] where these nodes are.
        strain_points: ``(p, 3)`` [m] where strain and stress are taken.
        cells: ``(k,)`` elements whose means give strain and stress.
        owner: ``(k,)`` the point that each belongs to.
        weight: ``(k,)`` of each in its point's value.
        supports: Name -> nodes of a support, and ``(3,)`` which components it holds.
        quantities: What is watched, of ``COMPONENTS``.
        extent: Of the mesh [m].
        gauges: Strain gauges.
    """

    names: tuple[str, ...]
    nodes: NDArray[np.integer]
    points: NDArray[np.float64]
    strain_points: NDArray[np.float64]
    cells: NDArray[np.integer]
    owner: NDArray[np.int64]
    weight: NDArray[np.float64]
    supports: dict[str, Support]
    quantities: tuple[str, ...]
    extent: float
    gauges: GaugeTable = field(default_factory=GaugeTable.none)

    def within(self, node: NDArray[np.integer], cell: NDArray[np.integer]) -> "PointTable":
        """Return the part of a model, in its numbers of nodes ``(n,)`` and cells ``(ne,)``: -1 where another has it."""
        supports: dict[str, Support] = {
            name: (node[nodes][node[nodes] >= 0], held) for name, (nodes, held) in self.supports.items()
        }
        nodes, cells = node[self.nodes], cell[self.cells]
        return replace(self, nodes=nodes, cells=cells, supports=supports, gauges=self.gauges.within(node))

    @property
    def displaced(self) -> list[str]:
        """Return the names of the points whose strain and stress are those of another place than their node."""
        away = np.linalg.norm(self.strain_points - self.points, axis=1)
        names = zip(self.names, away.tolist(), strict=True)
        return [name for name, distance in names if distance > ROUNDING * self.extent]


def point_table(
    mesh: MeshData,
    wanted: Mapping[str, tuple[float, float, float]],
    supports: dict[str, Support],
    yields: bool = False,
) -> PointTable:
    """Find the nodes and the elements of watch points.

    Args:
        mesh: The whole mesh.
        wanted: Name -> place [m].
        supports: Name -> nodes and held components.
        yields: Whether plastic strain is watched, too.

    Raises:
        MeshError: A point lies outside the mesh.
    """
    nodes = np.array([nearest_node(mesh, name, np.array(place)) for name, place in wanted.items()], np.int64)
    patches = [patch(mesh, int(node)) for node in nodes]
    centres = [mesh.points[mesh.cells[cells]].mean(axis=1) for cells in patches]
    touching = [int((mesh.cells[cells] == node).any(axis=1).sum()) for cells, node in zip(patches, nodes, strict=True)]
    weights = [
        fit(around, count, mesh.points[node]) for around, count, node in zip(centres, touching, nodes, strict=True)
    ]
    places = [weight @ around for weight, around in zip(weights, centres, strict=True)]
    return PointTable(
        names=tuple(wanted),
        nodes=nodes,
        points=mesh.points[nodes],
        strain_points=np.array(places).reshape(-1, 3),
        cells=np.concatenate([np.empty(0, np.int64), *patches]),
        owner=np.repeat(np.arange(len(nodes)), [len(cells) for cells in patches]),
        weight=np.concatenate([np.empty(0), *weights]),
        supports=supports,
        quantities=tuple(name for name in COMPONENTS if yields or name != "plastic_strain"),
        extent=float(np.ptp(mesh.points, axis=0).max()),
    )


def nearest_node(mesh: MeshData, name: str, place: NDArray[np.float64]) -> int:
    """Return the node nearest to a place [m]; errors as ``point_table``."""
    distance = np.linalg.norm(mesh.points - place, axis=1)
    node = int(np.argmin(distance))
    around = mesh.points[mesh.cells[(mesh.cells == node).any(axis=1)]]
    size = float(np.linalg.norm(np.ptp(around, axis=1), axis=1).max())
    if distance[node] > size:
        at, there = (", ".join(f"{value:.6g}" for value in point) for point in (place, mesh.points[node]))
        raise MeshError(
            f"watch.{name}.at = ({at}) m lies outside the mesh: the nearest node is ({there}) m, {distance[node]:.3g} m"
            f" away, more than the size {size:.3g} m of its elements"
        )
    return node


def patch(mesh: MeshData, node: int) -> NDArray[np.int64]:
    """Return the elements of one part that have a node, nearest ones first, and those that touch them.

    Of several parts that meet at the node it is the lowest.
    """
    first = np.flatnonzero((mesh.cells == node).any(axis=1))
    heights = {part: mesh.points[mesh.cells[first[mesh.part[first] == part]], 2].mean() for part in mesh.part[first]}
    same = mesh.part == min(heights, key=lambda part: heights[part])
    first = first[same[first]]
    touching = np.isin(mesh.cells, mesh.cells[first]).any(axis=1) & same
    touching[first] = False
    return np.concatenate([first, np.flatnonzero(touching)])


def fit(centres: NDArray[np.float64], nearest: int, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weights ``(m,)`` of element means in the value at a point.

    Args:
        centres: ``(m, 3)`` [m] of the elements.
        nearest: How many of them, the first ones, touch the point.
        point: ``(3,)`` [m].

    Returns:
        They add up to one; together with ``centres`` they give the place that the value belongs to, ``point`` itself
        where the elements lie in more than one layer across each direction.
    """
    size = 2.0 * np.abs(centres[:nearest] - point).max(axis=0)
    scaled = (centres - point) / np.where(size > 0.0, size, 1.0)
    root = np.exp(-0.5 * NEARNESS * np.sum(scaled**2, axis=1))
    middle = root**2 @ scaled / np.sum(root**2)
    rows = root[:, None] * np.column_stack([np.ones(len(scaled)), scaled - middle])
    at_point = np.concatenate([[1.0], -middle])
    return at_point @ np.linalg.pinv(rows, rcond=SMALLEST) * root
