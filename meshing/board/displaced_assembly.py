"""Assembly for the shock: a flat board, and the package at its position when the solder froze.

The package is displaced relative to the board below it, u_package(x) - u_board(top face, same x and y): by a uniform
lift, a prescribed warpage, or the displacement computed by a reflow simulation.
"""

from collections.abc import Callable
from pathlib import Path

import gmsh
import numpy as np
from scipy.spatial import cKDTree

from reflowshock.meshing.board.blocks import check_elements
from reflowshock.meshing.board.package_side import MERGE, PackageSide, StructuredFace
from reflowshock.meshing.board.pads import lift
from reflowshock.meshing.board.parameters import Package, Warpage
from reflowshock.meshing.core.gmsh_session import gmsh_model, write_msh

Displacement = Callable[[np.ndarray], np.ndarray]  # reference positions (n, 3) [m] -> displacements (n, 3) [m]
PACKAGE_PARTS = ("substrate", "die", "copper_package")


class DisplacementError(ValueError):
    """Error for a node without a computed displacement."""


class ContactError(ValueError):
    """Error for a displaced package that penetrates the board; gives the position."""


def write_displaced_assembly(source: Path, displacement: Displacement, path: Path) -> PackageSide:
    """Displace the nodes of the package in a flat assembly and write the result.

    Args:
        source: The ``.msh`` file of the flat assembly, as ``write_assembly`` writes it; read only.
        displacement: Function of node positions of the package, shape (k, 3) [m], that returns their displacements
            relative to the board, shape (k, 3) [m].
        path: The ``.msh`` file to write.

    Returns:
        Underside of the displaced package: height of its nodes above the board's top face, interpolated between them.

    Raises:
        ContactError: The package would touch the board.
        ValueError: An element is inverted, or the displacement of a node is missing.
    """
    with gmsh_model("assembly"):
        gmsh.merge(str(source))
        groups = {gmsh.model.getPhysicalName(*group): group for group in gmsh.model.getPhysicalGroups()}
        tags, points = _nodes([groups[name] for name in PACKAGE_PARTS if name in groups])
        moves = displacement(points)
        for tag, point in zip(tags, points + moves, strict=True):
            gmsh.model.mesh.setNode(tag, point, [])
        check_elements("displaced assembly")
        write_msh(path)
        below = np.isin(tags, _nodes([groups["package_side"]])[0])
        through = below if "copper_package" in groups else np.isin(tags, _nodes([groups["substrate"]])[0])
    _check_room(points[below] + moves[below])
    return PackageSide.of_nodes(points[through], moves[through])


def _nodes(groups: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return tags (n,) and points (n, 3) [m] of the nodes of physical groups, each once."""
    nodes = [gmsh.model.mesh.getNodesForPhysicalGroup(*group) for group in groups]
    tags, first = np.unique(np.concatenate([tags for tags, _ in nodes]), return_index=True)
    return tags, np.concatenate([points for _, points in nodes]).reshape(-1, 3)[first]


def _check_room(underside: np.ndarray) -> None:
    lowest = underside[underside[:, 2].argmin()]
    if lowest[2] <= 0.0:
        position = f"x = {1e3 * lowest[0]:.4g} mm, y = {1e3 * lowest[1]:.4g} mm"
        raise ContactError(f"the package lies {-1e3 * lowest[2]:.4g} mm inside the board at {position}, allowed < 0 mm")


def prescribed_displacement(package: Package, warpage: Warpage) -> Displacement:
    """Return the displacement field of a package with prescribed warpage.

    Args:
        package: Package, whose outermost joints define the warpage.
        warpage: Prescribed warpage, a paraboloid given by its value at the corner joint [m].

    Returns:
        Function of undisplaced points of the package, shape (k, 3) [m], that returns their displacements relative to
        the board, shape (k, 3) [m].
    """

    def displacement(points: np.ndarray) -> np.ndarray:
        height = lift(package, warpage, points[:, 0], points[:, 1])
        return np.column_stack([np.zeros_like(points[:, :2]), height])

    return displacement


def uniform_lift(height: float) -> Displacement:
    """Return the displacement field of a flat package that lies a height [m] above its drawn position.

    Returns:
        Function of points, shape (k, 3) [m], that returns their displacements, shape (k, 3) [m].
    """
    return lambda points: np.broadcast_to([0.0, 0.0, height], points.shape)


def read_displacement(path: Path) -> Displacement:
    """Read the displacement field of the package that a reflow wrote.

    Args:
        path: NPZ file, ``structure.npz`` of a reflow, with the arrays ``points`` and ``displacement``, shape (n, 3)
            [m], and ``package``, shape (n,); see ``computed_displacement``.

    Returns:
        Function of points of the package, shape (k, 3) [m], as ``computed_displacement`` returns it.

    Raises:
        NotStructuredError: The nodes of the board's top face under the package do not form a grid.
    """
    with np.load(path) as arrays:
        return computed_displacement(arrays["points"], arrays["displacement"], arrays["package"])


def computed_displacement(points: np.ndarray, displacement: np.ndarray, is_package: np.ndarray) -> Displacement:
    """Return the displacement of the package relative to the board's top face from nodal displacements of both.

    Args:
        points: Reference positions of the nodes of package and board, shape (n, 3) [m].
        displacement: Displacements of these nodes, shape (n, 3) [m].
        is_package: Whether each node belongs to the package, shape (n,).

    Returns:
        Function of points at nodes of the package, shape (k, 3) [m], that returns their displacements, shape (k, 3)
        [m]; it raises DisplacementError for a point without a node.

    Raises:
        NotStructuredError: The nodes of the board's top face under the package do not form a grid.
    """
    package, moved = points[is_package], displacement[is_package]
    top = _board_top(points[~is_package], displacement[~is_package], package)
    relative = moved - top(package[:, 0], package[:, 1])
    tree = cKDTree(package)

    def at(positions: np.ndarray) -> np.ndarray:
        distance, node = tree.query(positions)
        if (worst := int(distance.argmax())) >= 0 and distance[worst] > MERGE:
            position = ", ".join(f"{value:.6g}" for value in positions[worst])
            raise DisplacementError(
                f"no displacement is known at ({position}) m: the nearest node is {distance[worst]:.3g} m away"
            )
        return relative[node]

    return at


def _board_top(points: np.ndarray, displacement: np.ndarray, package: np.ndarray) -> StructuredFace:
    """Return the displacement of the board's top face below the package."""
    low, high = package[:, :2].min(axis=0) - MERGE, package[:, :2].max(axis=0) + MERGE
    below = np.all((points[:, :2] >= low) & (points[:, :2] <= high), axis=1)
    on_top = below & (points[:, 2] >= points[below, 2].max() - MERGE)
    return StructuredFace.of_nodes(points[on_top], displacement[on_top])
