"""Small meshes in memory: structured boxes with named facets, and non-matching joints."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData, boundary_facets

CYCLIC = [0, 1, 3, 2]
COPPER, GAP = 2e-5, 0.3e-3  # heights of a joint's pads and of its solder [m]
Line = Sequence[float] | NDArray[np.floating]
FACET_SETS = Callable[[NDArray[np.float64]], NDArray[np.bool_]]


def grid(x: Line, y: Line, z: Line) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) and hexahedra (ne, 8) in tensor order of a structured box."""
    zz, yy, xx = np.meshgrid(np.asarray(z, float), np.asarray(y, float), np.asarray(x, float), indexing="ij")
    points = np.column_stack([xx.ravel(), yy.ravel(), zz.ravel()])
    number = np.arange(len(points), dtype=np.int32).reshape(zz.shape)
    shift = [slice(None, -1), slice(1, None)]
    cells = np.stack([number[shift[a >> 2], shift[a >> 1 & 1], shift[a & 1]].ravel() for a in range(8)], axis=1)
    return points, cells


def mesh_of(points: np.ndarray, cells: np.ndarray, part: str | np.ndarray, facets: dict[str, FACET_SETS]) -> MeshData:
    """Return a mesh; ``facets`` maps a name to a test of boundary facet centres (nf, 3) -> (nf,)."""
    names = np.full(len(cells), part) if isinstance(part, str) else part
    part_names, number = np.unique(names, return_inverse=True)
    outside = boundary_facets(cells)[:, CYCLIC if cells.shape[1] == 8 else slice(None)]
    centres = points[outside].mean(axis=1)
    sets = {name: outside[test(centres)] for name, test in facets.items()}
    return MeshData(points, cells, number.astype(np.int32), tuple(str(name) for name in part_names), sets)


def on(axis: int, value: float, tolerance: float = 1e-9) -> FACET_SETS:
    """Return the test of facets on a plane."""
    return lambda centres: np.abs(centres[:, axis] - value) < tolerance


def joint_mesh(name: str, x: float, y: float, layers: int = 4, edges: int = 3) -> MeshData:
    """Return a box joint of solder between two copper pads, centred on (x, y)."""
    side = np.linspace(-0.2e-3, 0.2e-3, edges + 1)
    height = np.concatenate([[0.0], COPPER + np.linspace(0, GAP, layers + 1), [GAP + 2 * COPPER]])
    points, cells = grid(x + side, y + side, height)
    level = np.repeat(np.arange(layers + 2), edges**2)
    part = np.array(["solder"] * (layers + 2), dtype=object)
    part[0], part[-1] = "copper_board", "copper_package"
    ends = {f"foot@{name}": on(2, 0.0), f"head@{name}": on(2, height[-1])}
    mesh = mesh_of(points, cells, np.array([f"{part[k]}@{name}" for k in level]), ends)
    solder = cells[np.isin(level, np.arange(1, layers + 1))]
    inner = boundary_facets(solder)[:, CYCLIC]
    for end, z in (("board", COPPER), ("package", COPPER + GAP)):
        mesh.facets[f"pad_{end}@{name}"] = inner[on(2, z)(points[inner].mean(axis=1))]
    return mesh
