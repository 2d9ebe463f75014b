"""Small package whose joints match board and package node for node, for programs without ties."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from reflowshock.cases.hard.trials.grids import CYCLIC, grid, mesh_of, on
from reflowshock.fem.mesh.mesh import MeshData, boundary_facets, without_unused_nodes
from reflowshock.materials.library import COPPER, SAC405, SILICON
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import Materials

# Materials are isotropic for the peers: the board has the in-plane stiffness of FR4.
BOARD = Isotropic(density=1910.0, young_modulus=27.9e9, poisson_ratio=0.11)
MATERIALS = Materials(board=BOARD, substrate=BOARD, die=SILICON, copper=COPPER, solder=SAC405.elastic)
LENGTH, WIDTH, THICKNESS, PACKAGE = 8e-3, 6e-3, 1e-3, 2e-3  # [m] of a quarter
JOINTS = {"B2": (0.5e-3, 0.5e-3), "B3": (1.5e-3, 0.5e-3), "A2": (0.5e-3, 1.5e-3), "A3": (1.5e-3, 1.5e-3)}
RADIUS, COPPER_THICKNESS, GAP, LAYER = 0.2e-3, 2e-5, 0.3e-3, 0.4e-3


def conforming_package(refinement: int = 1) -> MeshData:
    """Return the mesh of a quarter of a package on its board, with parts and facet sets; all parts share their nodes.

    Args:
        refinement: Number of elements into which each element is divided, in each direction.
    """
    top = GAP + 2 * COPPER_THICKNESS
    levels = [(-THICKNESS, 4), (0.0, 1), (COPPER_THICKNESS, 4), (COPPER_THICKNESS + GAP, 1), (top, 2), (top + LAYER, 2)]
    z = grid_lines([level for level, _ in levels] + [top + 2 * LAYER], [count * refinement for _, count in levels])
    x, y = (in_plane_lines(length, refinement) for length in (LENGTH, WIDTH))
    points, cells = grid(x, y, z)
    part = assign_parts(points[cells].mean(axis=1), top)
    is_filled = part != ""
    facets = {
        "symmetry_x": on(0, 0.0),
        "symmetry_y": on(1, 0.0),
        "mounting_holes": lambda c: (np.abs(c[:, 0] - LENGTH) < 1e-9) & (c[:, 2] < 0.0),
        "board_bottom": on(2, -THICKNESS),
    }
    return without_unused_nodes(with_pads(mesh_of(points, cells[is_filled], part[is_filled], facets)))[0]


def in_plane_lines(length: float, refinement: int) -> np.ndarray:
    """Return the grid lines along one side: through the joints' edges and axes, then half a millimetre apart.

    Args:
        length: Length of the board along this side [m].
        refinement: Number of elements into which each element is divided.

    Returns:
        Increasing coordinates, shape (k,) [m].
    """
    joints = [value for centre in (0.5e-3, 1.5e-3) for value in (centre - RADIUS, centre, centre + RADIUS)]
    breaks = [0.0, *joints[:3], 1e-3, *joints[3:], PACKAGE, length]
    return grid_lines(breaks, [refinement] * 8 + [refinement * round((length - PACKAGE) / 0.5e-3)])


def grid_lines(breaks: Sequence[float], counts: Sequence[int]) -> np.ndarray:
    """Return grid lines with equal elements between breaks, shape (k,) [m].

    Args:
        breaks: Increasing coordinates of the breaks [m].
        counts: Number of elements between each two successive breaks.
    """
    gaps = zip(pairwise(breaks), counts, strict=True)
    pieces = [np.linspace(low, high, count + 1)[:-1] for (low, high), count in gaps]
    return np.append(np.concatenate(pieces), breaks[-1])


def assign_parts(centre: np.ndarray, top: float) -> np.ndarray:
    """Return the name of each cell's part, such as "board" or "solder@A1", shape (c,); empty outside all parts.

    Args:
        centre: Centres of the cells, shape (c, 3) [m].
        top: Height of the package's underside above the board [m].
    """
    x, y, z = centre.T
    part = np.full(len(centre), "", dtype=object)
    part[z < 0.0] = "board"
    above = (x < PACKAGE) & (y < PACKAGE) & (z > top)
    part[above] = np.where(z[above] < top + LAYER, "substrate", "die")
    for name, (at_x, at_y) in JOINTS.items():
        inside = (np.abs(x - at_x) < RADIUS) & (np.abs(y - at_y) < RADIUS) & (z > 0.0) & (z < top)
        kind = np.select(
            [z < COPPER_THICKNESS, z > COPPER_THICKNESS + GAP], ["copper_board", "copper_package"], "solder"
        )
        part[inside] = [f"{role}@{name}" for role in kind[inside]]
    return part.astype(str)


def with_pads(mesh: MeshData) -> MeshData:
    """Return the mesh with the facet sets between solder and copper, ``pad_board@NAME`` and ``pad_package@NAME``."""
    facets = dict(mesh.facets)
    for name in JOINTS:
        solder = mesh.cells[mesh.in_parts(f"solder@{name}".__eq__)]
        outside = boundary_facets(solder)[:, CYCLIC]
        height = mesh.points[outside].mean(axis=1)[:, 2]
        for end, z in (("board", COPPER_THICKNESS), ("package", COPPER_THICKNESS + GAP)):
            facets[f"pad_{end}@{name}"] = outside[np.abs(height - z) < 1e-9]
    return replace(mesh, facets=facets)
