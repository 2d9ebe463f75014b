"""Gmsh file with all joint meshes of an array; every part and facet set is a physical group."""

from pathlib import Path

import gmsh
import numpy as np

from reflowshock.meshing.core.gmsh_session import HEXAHEDRON, QUADRANGLE, gmsh_model, name_groups, write_msh
from reflowshock.meshing.joint.solder_mesh import JointMesh


def write_joints(meshes: list[JointMesh], path: Path) -> dict[str, float]:
    """Write joint meshes to a Gmsh file in metres, each part as a discrete volume.

    Args:
        meshes: Joint meshes in the assembly: nodes, hexahedra by part name, and facets.
        path: The ``.msh`` file to write.

    Returns:
        Joint name -> smallest scaled Jacobian, computed by Gmsh.
    """
    with gmsh_model("joints"):
        nodes = elements = 1
        worst = {}
        for mesh in meshes:
            first = elements
            elements = _add_joint(mesh, nodes, elements)
            nodes += len(mesh.points)
            hexahedra = first + np.arange(sum(len(cells) for cells in mesh.cells.values()))
            worst[mesh.name] = float(gmsh.model.mesh.getElementQualities(hexahedra, "minSJ").min())
        write_msh(path)
    return worst


def _add_joint(mesh: JointMesh, first_node: int, first_element: int) -> int:
    """Add one joint with contiguous tags, hexahedra before facets; return the next free element tag."""
    node_tags = first_node + np.arange(len(mesh.points))
    owner = None
    for dimension, kind, groups in ((3, HEXAHEDRON, mesh.cells), (2, QUADRANGLE, mesh.facets)):
        for name, connectivity in groups.items():
            entity = gmsh.model.addDiscreteEntity(dimension)
            if owner is None:
                owner = entity
                gmsh.model.mesh.addNodes(dimension, owner, node_tags, mesh.points.ravel())
            tags = first_element + np.arange(len(connectivity))
            gmsh.model.mesh.addElementsByType(entity, kind, tags, node_tags[connectivity].ravel())
            name_groups(dimension, {name: [entity]})
            first_element += len(connectivity)
    return first_element
