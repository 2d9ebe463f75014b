"""Tables of board and package before distribution: one mesh, fixed components, free rigid-body motions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from reflowshock.fem.division.tables import Tables
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.coupling_interface import find_interface
from reflowshock.fem.mesh.mesh import MeshData, merge_nodes
from reflowshock.fem.mesh.supports import SYMMETRY, held_components
from reflowshock.fem.mesh.tie import Tie
from reflowshock.materials.roles import role_of_part

MOTIONS = ("x", "y", "z", "turn_x", "turn_y", "turn_z")
BLOCKED = 1e-9  # displacement of fixed components, relative to the body's size, up to which a motion is free


@dataclass(frozen=True, slots=True)
class RigidMotions:
    """Free rigid-body motions of one body, with linearised rotations.

    Attributes:
        centre: Centre of the rotations, shape (3,) [m].
        numbers: Indices of the free motions in ``MOTIONS``.
    """

    centre: NDArray[np.float64]
    numbers: tuple[int, ...]

    @classmethod
    def free(cls, points: NDArray[np.float64], held: NDArray[np.bool_], centre: NDArray[np.float64]) -> "RigidMotions":
        """Return the motions of a body's points, shape (n, 3) [m], that no fixed component, shape (n, 3), blocks."""
        motions = cls(centre, tuple(range(6)))
        limit = BLOCKED * float(np.ptp(points, axis=0).max())
        largest = [np.abs(field[held]).max(initial=0.0) for field in motions.fields(points)]
        free = tuple(number for number, moved in zip(motions.numbers, largest, strict=True) if moved <= limit)
        return cls(centre, free)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the motions: translations along and rotations about x, y, z."""
        return tuple(MOTIONS[number] for number in self.numbers)

    def fields(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement of points, shape (n, 3), for a unit of each motion, shape (k, n, 3) [m/m, m/rad]."""
        axes = np.eye(3)
        fields = [
            np.broadcast_to(axes[number], points.shape)
            if number < 3
            else np.cross(axes[number - 3], points - self.centre)
            for number in self.numbers
        ]
        return np.array(fields).reshape(len(fields), *points.shape)

    def pins(self, points: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return points and components, shape (k,), that determine the motions; those of rotations are far apart."""
        size = float(np.ptp(points, axis=0).max())
        scale = np.array([1.0 if number < 3 else 1.0 / size for number in self.numbers])
        fields = scale[:, None] * self.fields(points).reshape(len(self.numbers), points.size)
        order = scipy.linalg.qr(fields, mode="r", pivoting=True)[1][: len(self.numbers)]
        node, component = np.divmod(order, 3)
        return node, component


BOARD_PARTS = ("board", "board_patch", "copper_board")


@dataclass(frozen=True, slots=True)
class ThermalTables(Tables):
    """Tables of board and package, unconnected while the solder is liquid.

    Attributes:
        package: Whether a node belongs to the package, shape (n,).
        motions: Free rigid-body motions of board and package.
    """

    package: NDArray[np.bool_]
    motions: tuple[RigidMotions, RigidMotions]


def connect_board(mesh: MeshData) -> MeshData:
    """Return the mesh with the nodes of board and board patch merged.

    Args:
        mesh: Mesh in which the patch under the package has its own nodes; unchanged without board or patch.

    Raises:
        CouplingError: A node of the patch has no partner in the board.
    """
    macro, meso = find_interface(mesh)
    return merge_nodes(mesh, meso, macro)[0]


def thermal_tables(mesh: MeshData, centre: NDArray[np.float64]) -> ThermalTables:
    """Return the supports of board and package: symmetry planes, one point at each hole, and pins.

    The points at the holes carry the weight of the board and let it expand. Pins fix the remaining rigid-body motions;
    they have no reaction, since inertia balances the loads along free motions.

    Args:
        mesh: Mesh of board and package.
        centre: Centre of the package's rotations, shape (3,) [m].

    Returns:
        Tables with fixed components and pins, mask of the package's nodes, and free rigid-body motions of both bodies.

    Raises:
        MeshError: Board or package is missing, or they share nodes.
    """
    package = _find_package_nodes(mesh)
    held = held_components(mesh, SYMMETRY)
    held[_find_resting_nodes(mesh), 2] = True
    motions = []
    for nodes in (np.flatnonzero(~package), np.flatnonzero(package)):
        points = mesh.points[nodes]
        free = RigidMotions.free(points, held[nodes], centre if package[nodes[0]] else np.zeros(3))
        node, component = free.pins(points)
        held[nodes[node], component] = True
        motions.append(free)
    whole = Whole(mesh, Tie.none(), moved=0.0)
    return ThermalTables.undivided(whole, held, package=package, motions=(motions[0], motions[1]))


def _find_package_nodes(mesh: MeshData) -> NDArray[np.bool_]:
    """Return whether a node belongs to the package, shape (n,); raises as ``thermal_tables``."""
    of_board = mesh.in_parts(BOARD_PARTS.__contains__)
    if of_board.all() or not of_board.any():
        raise MeshError(f"the mesh needs board and package; its parts are {', '.join(mesh.part_names)}")
    package = np.zeros(len(mesh.points), dtype=bool)
    package[mesh.cells[~of_board]] = True
    both = np.intersect1d(mesh.cells[of_board], mesh.cells[~of_board])
    if len(both):
        raise MeshError(f"board and package share {len(both)} nodes, but must be separate while the solder is liquid")
    return package


def _find_resting_nodes(mesh: MeshData) -> NDArray[np.intp]:
    """Return one node at the lower end of each mounting hole, the nearest to the centre of the board, shape (k,)."""
    nodes = mesh.facet_nodes("mounting_holes")
    if not len(nodes):
        return nodes.astype(np.intp)
    points = mesh.points[nodes]
    low = nodes[points[:, 2] <= points[:, 2].min() + 1e-6 * np.ptp(points[:, 2])]
    distance = np.hypot(*mesh.points[low, :2].T)
    quadrant = 2 * (mesh.points[low, 0] > 0.0) + (mesh.points[low, 1] > 0.0)
    return np.array([low[quadrant == q][np.argmin(distance[quadrant == q])] for q in np.unique(quadrant)])


def find_die_corners(mesh: MeshData) -> NDArray[np.intp]:
    """Return the nodes at the upper corners of the die, without corners that a symmetry plane removes, shape (k,).

    There are four in a whole model, two in a half and one in a quarter model.

    Args:
        mesh: Mesh of board and package.

    Raises:
        MeshError: The mesh has no die.
    """
    cells = mesh.cells[mesh.in_parts(lambda name: role_of_part(name) == "die")]
    if not len(cells):
        raise MeshError(f"the mesh has no die whose corners could be moved; its parts are {', '.join(mesh.part_names)}")
    nodes = np.unique(cells)
    points = mesh.points[nodes]
    top = nodes[points[:, 2] >= points[:, 2].max() - 1e-6 * np.ptp(points[:, 2])]
    return np.array([top[np.argmax(mesh.points[top, :2] @ sign)] for sign in _outward(mesh)])


def _outward(mesh: MeshData) -> Sequence[tuple[float, float]]:
    signs = [(1.0,) if len(mesh.facets_of(name)) else (1.0, -1.0) for name in ("symmetry_x", "symmetry_y")]
    return [(x, y) for x in signs[0] for y in signs[1]]
