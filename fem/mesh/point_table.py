"""Watch points, strain gauges and supports of a structure or a board in input numbers.

Strain and stress at a point follow from a linear field fitted to the means of the elements around it, which are
superconvergent (superconvergent patch recovery: Zienkiewicz & Zhu, IJNME 33, 1992). Two rings of elements extrapolate
to a surface, which bending needs. With a single layer of elements the gradient across it is undetermined, and the value
at mid-thickness is returned.
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


ROUNDING = 1e-9  # of the mesh: points at a smaller distance coincide
Support = tuple[NDArray[np.integer], NDArray[np.bool_]]
COMPONENTS = {"displacement": 3, "velocity": 3, "strain": 6, "stress": 6, "plastic_strain": 1}


@dataclass(frozen=True, slots=True)
class PointTable:
    """Watch points, gauges and supports in input numbers.

    Attributes:
        names: Names of the points.
        nodes: Node nearest to each point, shape (p,).
        points: Coordinates of these nodes, shape (p, 3) [m].
        strain_points: Positions at which strain and stress are evaluated, shape (p, 3) [m].
        cells: Elements whose means give strain and stress, shape (k,).
        owner: Point of each element, shape (k,).
        weight: Weight of each element in the value of its point, shape (k,).
        supports: Name -> nodes of a support, and whether it holds each component, shape (3,).
        quantities: Recorded quantities, keys of ``COMPONENTS``.
        extent: Largest extent of the mesh [m].
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
        """Return the part of one model in its own numbers.

        Args:
            node: Node number in the model of each input node, -1 if it belongs to another, shape (n,).
            cell: Cell number in the model of each input cell, -1 if it belongs to another, shape (ne,).
        """
        supports: dict[str, Support] = {
            name: (node[nodes][node[nodes] >= 0], held) for name, (nodes, held) in self.supports.items()
        }
        nodes, cells = node[self.nodes], cell[self.cells]
        return replace(self, nodes=nodes, cells=cells, supports=supports, gauges=self.gauges.within(node))

    @property
    def displaced(self) -> list[str]:
        """Names of the points whose strain and stress are evaluated at a distance from their node."""
        away = np.linalg.norm(self.strain_points - self.points, axis=1)
        names = zip(self.names, away.tolist(), strict=True)
        return [name for name, distance in names if distance > ROUNDING * self.extent]


def point_table(
    mesh: MeshData,
    positions: Mapping[str, tuple[float, float, float]],
    supports: dict[str, Support],
    yields: bool = False,
) -> PointTable:
    """Find the nodes and the elements of watch points.

    Args:
        mesh: The whole mesh.
        positions: Name -> coordinates of a watch point [m].
        supports: Name -> nodes of a support, shape (k,), and whether it holds each component, shape (3,).
        yields: Whether plastic strain is also recorded.

    Returns:
        Nearest node of each point, and the elements and weights for its strain and stress, in numbers of the mesh.

    Raises:
        MeshError: A point lies outside the mesh.
    """
    nodes = np.array([_nearest_node(mesh, name, np.array(position)) for name, position in positions.items()], np.int64)
    patches = [patch(mesh, int(node)) for node in nodes]
    centres = [mesh.points[mesh.cells[cells]].mean(axis=1) for cells in patches]
    touching = [int((mesh.cells[cells] == node).any(axis=1).sum()) for cells, node in zip(patches, nodes, strict=True)]
    weights = [
        fit(around, count, mesh.points[node]) for around, count, node in zip(centres, touching, nodes, strict=True)
    ]
    places = [weight @ around for weight, around in zip(weights, centres, strict=True)]
    return PointTable(
        names=tuple(positions),
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


def _nearest_node(mesh: MeshData, name: str, position: NDArray[np.float64]) -> int:
    """Return the node nearest to a position (3,) [m]; errors as in ``point_table``."""
    distance = np.linalg.norm(mesh.points - position, axis=1)
    node = int(np.argmin(distance))
    around = mesh.points[mesh.cells[(mesh.cells == node).any(axis=1)]]
    size = float(np.linalg.norm(np.ptp(around, axis=1), axis=1).max())
    if distance[node] > size:
        at, there = (", ".join(f"{value:.6g}" for value in point) for point in (position, mesh.points[node]))
        raise MeshError(
            f"watch.{name}.at = ({at}) m lies outside the mesh: the nearest node is ({there}) m, {distance[node]:.3g} m"
            f" away, more than the size {size:.3g} m of its elements"
        )
    return node


def patch(mesh: MeshData, node: int) -> NDArray[np.int64]:
    """Return the numbers of the elements of one part around a node, followed by their neighbours in it, shape (m,).

    If several parts meet at the node, the lowest one along z is used.

    Args:
        mesh: The mesh.
        node: Number of the node.
    """
    first = np.flatnonzero((mesh.cells == node).any(axis=1))
    heights = {part: mesh.points[mesh.cells[first[mesh.part[first] == part]], 2].mean() for part in mesh.part[first]}
    same = mesh.part == min(heights, key=lambda part: heights[part])
    first = first[same[first]]
    touching = np.isin(mesh.cells, mesh.cells[first]).any(axis=1) & same
    touching[first] = False
    return np.concatenate([first, np.flatnonzero(touching)])


def fit(centres: NDArray[np.float64], nearest: int, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weights of element means in the value at a point, by a weighted linear least-squares fit.

    Args:
        centres: Centres of the elements, shape (m, 3) [m].
        nearest: Number of elements that touch the point; they come first.
        point: Position of the point, shape (3,) [m].

    Returns:
        Weights that add up to one, shape (m,). The weighted mean of ``centres`` is the position at which the value
        applies: ``point`` itself if there are several layers of elements along each direction.
    """
    size = 2.0 * np.abs(centres[:nearest] - point).max(axis=0)
    scaled = (centres - point) / np.where(size > 0.0, size, 1.0)
    root = np.exp(-0.5 * NEARNESS * np.sum(scaled**2, axis=1))
    middle = root**2 @ scaled / np.sum(root**2)
    rows = root[:, None] * np.column_stack([np.ones(len(scaled)), scaled - middle])
    at_point = np.concatenate([[1.0], -middle])
    return at_point @ np.linalg.pinv(rows, rcond=SMALLEST) * root
