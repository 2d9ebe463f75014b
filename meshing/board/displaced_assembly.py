"""The assembly as the shock uses it: the board flat, the package where it was when the solder froze."""

from pathlib import Path

import gmsh
import numpy as np

from reflowshock.meshing.board.blocks import check_elements
from reflowshock.meshing.board.displacement import Displacement
from reflowshock.meshing.board.package_side import PackageSide
from reflowshock.meshing.core.gmsh_session import gmsh_model, write_msh

PACKAGE_PARTS = ("substrate", "die", "copper_package")


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
    _check_room(points[below] + moves[below])
    return PackageSide.of_nodes(points[below], moves[below])


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
