"""All joint meshes of an array as one Gmsh file with a physical name for every part and facet set."""

from pathlib import Path

import gmsh
import numpy as np

from meshing.gmsh_session import HEXAHEDRON, QUADRANGLE, gmsh_model, name_groups, write_msh
from meshing.solder_mesh import JointMesh


def write_joints(meshes: list[JointMesh], path: Path) -> int:
    """Write joints as discrete Gmsh volumes in metres.

    Args:
        meshes: the joints in their places.
        path: the ``.msh`` file to write.

    Returns:
        Number of hexahedra.
    """
    counter = _TagCounter()
    with gmsh_model("joints"):
        for mesh in meshes:
            _add_joint(mesh, counter)
        write_msh(path)
    return sum(len(cells) for mesh in meshes for cells in mesh.cells.values())


class _TagCounter:
    """Contiguous node and element tags over all joints."""

    def __init__(self) -> None:
        self.nodes, self.elements = 0, 0

    def take_nodes(self, count: int) -> int:
        first, self.nodes = self.nodes + 1, self.nodes + count
        return first

    def take_elements(self, count: int) -> np.ndarray:
        first, self.elements = self.elements + 1, self.elements + count
        return np.arange(first, first + count)


def _add_joint(mesh: JointMesh, counter: _TagCounter) -> None:
    first_node = counter.take_nodes(len(mesh.points))
    node_tags = first_node + np.arange(len(mesh.points))
    owner: int | None = None
    for name, cells in mesh.cells.items():
        volume = gmsh.model.addDiscreteEntity(3)
        if owner is None:
            owner = volume
            gmsh.model.mesh.addNodes(3, volume, node_tags, mesh.points.ravel())
        gmsh.model.mesh.addElementsByType(volume, HEXAHEDRON, counter.take_elements(len(cells)), node_tags[cells].ravel())
        name_groups(3, {name: [volume]})
    for name, quads in mesh.facets.items():
        surface = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addElementsByType(surface, QUADRANGLE, counter.take_elements(len(quads)), node_tags[quads].ravel())
        name_groups(2, {name: [surface]})
