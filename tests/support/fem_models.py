"""Small meshes for the shock tests: bars, boards, and a package with box joints on non-matching meshes."""

from pathlib import Path

import gmsh
import numpy as np

from reflowshock.cases.hard.trials.grids import COPPER, GAP, grid, joint_mesh, mesh_of, on
from reflowshock.fem.cell_shape import TENSOR_ORDER
from reflowshock.fem.mesh.mesh import MeshData, append, without_unused_nodes

# Gmsh type and node order of cells and facets by their number of nodes.
GMSH_TYPES = {8: 5, 4: 4, 10: 11}, {4: 3, 3: 2, 6: 9}
GMSH_ORDER = {8: np.argsort(TENSOR_ORDER), 4: np.arange(4), 10: np.array([0, 1, 2, 3, 9, 6, 8, 7, 4, 5])}


def bar(length: float, elements: int, width: float, part: str = "board") -> MeshData:
    """Return the mesh of a bar along x, one element thick, with facet sets ``low`` at x = 0 and ``high`` at its end.

    Args:
        length: Length [m].
        elements: Number of elements along x.
        width: Side of the square cross-section [m].
        part: Name of the part.
    """
    points, cells = grid(np.linspace(0, length, elements + 1), [0, width], [0, width])
    return mesh_of(points, cells, part, {"low": on(0, 0.0), "high": on(0, length)})


BOARD_X, BOARD_Y, BOARD_Z = 12e-3, 8e-3, 1e-3
PATCH, PACKAGE = 3.5e-3, 2.5e-3


def board_mesh(size: float = 0.5e-3, layers: int = 4, patch_layers: int = 2) -> MeshData:
    """Return a quarter of a board with its patch under the package, with the facet sets of symmetry and supports.

    Args:
        size: Edge length of the elements in plan [m].
        layers: Number of element layers.
        patch_layers: Number of upper layers that belong to the part ``board_patch``.
    """
    x, y = np.arange(0, BOARD_X + size / 2, size), np.arange(0, BOARD_Y + size / 2, size)
    points, cells = grid(x, y, np.linspace(-BOARD_Z, 0, layers + 1))
    centre = points[cells].mean(axis=1)
    bottom = -BOARD_Z * patch_layers / layers
    patch = (centre[:, 0] < PATCH) & (centre[:, 1] < PATCH) & (centre[:, 2] > bottom)
    facets = {
        "symmetry_x": on(0, 0.0),
        "symmetry_y": on(1, 0.0),
        "mounting_holes": lambda c: (np.abs(c[:, 0] - BOARD_X) < 1e-9) & (c[:, 1] > BOARD_Y - 2e-3),
        "board_side": lambda c: (np.abs(c[:, 2]) < 1e-9) & (c[:, 0] < PATCH) & (c[:, 1] < PATCH),
        "board_bottom": on(2, -BOARD_Z),
    }
    return mesh_of(points, cells, np.where(patch, "board_patch", "board"), facets)


def package_mesh(size: float = 0.5e-3) -> MeshData:
    """Return the mesh of a quarter of substrate and die above the joints, in elements of ``size`` [m] in plan."""
    low = GAP + 2 * COPPER
    x = np.arange(0, PACKAGE + size / 2, size)
    points, cells = grid(x, x, low + np.array([0.0, 0.2e-3, 0.4e-3, 0.6e-3, 0.8e-3]))
    centre = points[cells].mean(axis=1)
    die = centre[:, 2] > low + 0.4e-3
    is_filled = ~die | ((centre[:, 0] < 2e-3) & (centre[:, 1] < 2e-3))
    facets = {"symmetry_x": on(0, 0.0), "symmetry_y": on(1, 0.0), "package_side": on(2, low)}
    mesh = mesh_of(points, cells[is_filled], np.where(die, "die", "substrate")[is_filled], facets)
    return without_unused_nodes(mesh)[0]


SITES = {"B2": (0.5e-3, 0.5e-3), "B3": (1.5e-3, 0.5e-3), "A2": (0.5e-3, 1.5e-3), "A3": (1.5e-3, 1.5e-3)}


def small_assembly(joints: int = 4, **board: float) -> list[MeshData]:
    """Return board, package and joints, in this order, as meshes without common nodes.

    Args:
        joints: Number of joints, 1 to 4.
        board: Arguments of ``board_mesh``.
    """
    sites = list(SITES.items())[-joints:]
    return [board_mesh(**board), package_mesh(), *(joint_mesh(name, x, y) for name, (x, y) in sites)]


def write_msh(mesh: MeshData, path: Path) -> None:
    """Write a mesh as MSH 4.1 in metres, its parts and facet sets as physical groups."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("test")
        volumes, surfaces = GMSH_TYPES
        nodes, of_facets = mesh.cells.shape[1], mesh.shape.faces.shape[1]
        parts = [
            (3, volumes[nodes], name, mesh.cells[mesh.part == part][:, GMSH_ORDER[nodes]])
            for part, name in enumerate(mesh.part_names)
        ]
        parts += [(2, surfaces[of_facets], name, facets) for name, facets in mesh.facets.items() if len(facets)]
        entities = [gmsh.model.addDiscreteEntity(dimension) for dimension, *_ in parts]
        gmsh.model.mesh.addNodes(3, entities[0], np.arange(1, len(mesh.points) + 1), mesh.points.ravel())
        for entity, (dimension, kind, name, nodes) in zip(entities, parts, strict=True):
            gmsh.model.mesh.addElementsByType(entity, kind, [], (nodes + 1).ravel())
            gmsh.model.addPhysicalGroup(dimension, [entity], name=name)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.option.setNumber("Mesh.SaveAll", 0)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def write_small_assembly(directory: Path, joints: int = 4, **board: float) -> list[Path]:
    """Write ``assembly.msh`` and ``joints.msh`` of ``small_assembly`` into a folder; return their paths."""
    board_part, package, *others = small_assembly(joints, **board)
    paths = [directory / "assembly.msh", directory / "joints.msh"]
    write_msh(append([board_part, package]), paths[0])
    write_msh(append(others), paths[1])
    return paths
