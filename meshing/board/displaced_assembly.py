"""The assembly as the shock uses it: the board flat, the package where it was when the solder froze.

What counts is where the package is, seen from the board below it, u_package(x) - u_board(top face, same x and y). It is
raised flat, lifted as prescribed, or as computed.
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

Displacement = Callable[[np.ndarray], np.ndarray]  # reference places (n, 3) [m] -> displacements (n, 3) [m]
PACKAGE_PARTS = ("substrate", "die", "copper_package")


class DisplacementError(ValueError):
    """Nodes that a computed displacement does not know."""


class ContactError(ValueError):
    """A package that would lie in the board; says where."""


def write_displaced_assembly(source: Path, displacement: Displacement, path: Path) -> PackageSide:
    """Write an assembly again, the nodes of its package displaced.

    Args:
        source: the flat assembly.
        displacement: of the package, relative to the board.
        path: the ``.msh`` file to write.

    Returns:
        The package's underside.

    Raises:
        ContactError: the package would touch the board.
        ValueError: an element is inside out, or the displacement does not know a node.
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
    found = [gmsh.model.mesh.getNodesForPhysicalGroup(*group) for group in groups]
    tags, first = np.unique(np.concatenate([tags for tags, _ in found]), return_index=True)
    return tags, np.concatenate([points for _, points in found]).reshape(-1, 3)[first]


def _check_room(underside: np.ndarray) -> None:
    lowest = underside[underside[:, 2].argmin()]
    if lowest[2] <= 0.0:
        place = f"x = {1e3 * lowest[0]:.4g} mm, y = {1e3 * lowest[1]:.4g} mm"
        raise ContactError(f"the package lies {-1e3 * lowest[2]:.4g} mm inside the board at {place}, allowed < 0 mm")


def prescribed(package: Package, warpage: Warpage) -> Displacement:
    """Return the displacement of a package that is lifted."""

    def displacement(points: np.ndarray) -> np.ndarray:
        height = lift(package, warpage, points[:, 0], points[:, 1])
        return np.column_stack([np.zeros_like(points[:, :2]), height])

    return displacement


def raised(height: float) -> Displacement:
    """Return the displacement of a flat package that stands higher than drawn [m]."""
    return lambda points: np.broadcast_to([0.0, 0.0, height], points.shape)


def read_computed(path: Path) -> Displacement:
    """Read the displacement that a reflow left in its ``structure.npz``; errors as ``computed``."""
    with np.load(path) as arrays:
        return computed(arrays["points"], arrays["displacement"], arrays["package"])


def computed(points: np.ndarray, displacement: np.ndarray, is_package: np.ndarray) -> Displacement:
    """Return the displacement of the package relative to the board's top face, by the nodes of both.

    Args:
        points: (n, 3) where the nodes of package and board were [m].
        displacement: (n, 3) of them [m].
        is_package: (n,) which of them are the package's.

    Raises:
        NotStructuredError: the board's top face under the package is no grid.
    """
    package, moved = points[is_package], displacement[is_package]
    top = _board_top(points[~is_package], displacement[~is_package], package)
    relative = moved - top(package[:, 0], package[:, 1])
    tree = cKDTree(package)

    def at(places: np.ndarray) -> np.ndarray:
        distance, node = tree.query(places)
        if (worst := int(distance.argmax())) >= 0 and distance[worst] > MERGE:
            place = ", ".join(f"{value:.6g}" for value in places[worst])
            raise DisplacementError(
                f"no displacement is known at ({place}) m: the nearest is {distance[worst]:.3g} m off"
            )
        return relative[node]

    return at


def _board_top(points: np.ndarray, displacement: np.ndarray, package: np.ndarray) -> StructuredFace:
    """Return the displacement of the board's top face below the package."""
    low, high = package[:, :2].min(axis=0) - MERGE, package[:, :2].max(axis=0) + MERGE
    below = np.all((points[:, :2] >= low) & (points[:, :2] <= high), axis=1)
    on_top = below & (points[:, 2] >= points[below, 2].max() - MERGE)
    return StructuredFace.of_nodes(points[on_top], displacement[on_top])
