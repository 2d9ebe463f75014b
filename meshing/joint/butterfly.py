"""Butterfly (O-grid) meshes of the unit disc. Plain NumPy, because forecasts use the edge lengths without Gmsh."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from reflowshock.meshing.board.parameters import JointNumerics

# Half-diagonal and half-side of the core on the unit disc: between a circle (equal) and a square (ratio sqrt 2).
CORE_DIAGONAL, CORE_SIDE = 0.60, 0.50


@dataclass(frozen=True, slots=True)
class Butterfly:
    """Quadrilateral mesh of the unit disc.

    Attributes:
        points: Node coordinates, shape (n, 2).
        quads: Nodes of the quadrilaterals, counter-clockwise, shape (q, 4).
        rim: Nodes of the outline, counter-clockwise, shape (4 core,).
    """

    points: np.ndarray
    quads: np.ndarray
    rim: np.ndarray


def butterfly(core: int, rings: int, opening: float = 1.0, beyond: int = 0) -> Butterfly:
    """Mesh the unit disc by a core of ``core`` x ``core`` quadrilaterals inside rings of 4 ``core`` quadrilaterals.

    Args:
        core: Number of core elements along each side.
        rings: Number of rings around the core; with 0 the core fills the disc.
        opening: Radius that core and rings fill, relative to the unit circle.
        beyond: Number of further rings between this radius and the unit circle.

    Returns:
        Nodes, shape (n, 2), quadrilaterals, shape (q, 4), and nodes of the outline, shape (4 core,).
    """
    outline = _core_outline(core)
    inner = _core_points(core, CORE_DIAGONAL, CORE_SIDE) if rings else _core_points(core, 1.0, 1.0)
    if not rings:
        inner[outline] /= np.linalg.norm(inner[outline], axis=1, keepdims=True)
    angles = -0.75 * np.pi + 0.5 * np.pi * np.arange(4 * core) / core
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    layers = [inner[outline] + share * (circle - inner[outline]) for share in np.arange(1, rings + 1) / rings]
    inside = opening * np.vstack([inner, *layers])
    wider = [radius * circle for radius in np.linspace(opening, 1.0, beyond + 1)[1:]]
    ids = [outline] + [len(inner) + ring * len(outline) + np.arange(len(outline)) for ring in range(rings + beyond)]
    quads = [_core_quads(core)] + [
        np.column_stack([low, high, np.roll(high, -1), np.roll(low, -1)]) for low, high in pairwise(ids)
    ]
    return Butterfly(np.vstack([inside, *wider]), np.vstack(quads), ids[-1])


def circumradius(sides: int) -> float:
    """Return the circumradius of a regular polygon with the area of the unit disc.

    Args:
        sides: Number of sides of the polygon.
    """
    angle = 2.0 * np.pi / sides
    return float(np.sqrt(angle / np.sin(angle)))


def section_edges(numerics: JointNumerics, radius: float) -> np.ndarray:
    """Return two edge vectors (x, y) of each quadrilateral of a round section, at its centre, shape (q, 2, 2) [m].

    Args:
        numerics: Resolution of the section: elements of the core and rings around it.
        radius: Radius r of a disc with the area of the section, pi r^2 [m].
    """
    section = butterfly(numerics.core, numerics.rings)
    corners = (radius * circumradius(len(section.rim)) * section.points)[section.quads]
    first, second, third, fourth = (corners[:, k] for k in range(4))
    return 0.5 * np.stack([second - first + third - fourth, fourth - first + third - second], axis=1)


def _core_points(core: int, diagonal: float, side: float) -> np.ndarray:
    """Return a square grid whose sides bulge towards the circle, from its half-diagonal and half-side."""
    steps = np.linspace(-1.0, 1.0, core + 1)
    x, y = np.meshgrid(steps, steps)
    corner = diagonal / np.sqrt(2.0)
    bend = side - corner
    return np.column_stack([(x * (corner + bend * (1.0 - y**2))).ravel(), (y * (corner + bend * (1.0 - x**2))).ravel()])


def _core_outline(core: int) -> np.ndarray:
    """Return the outline nodes of the core, counter-clockwise from the corner at (-1, -1)."""
    grid = np.arange((core + 1) ** 2).reshape(core + 1, core + 1)
    return np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])


def _core_quads(core: int) -> np.ndarray:
    grid = np.arange((core + 1) ** 2).reshape(core + 1, core + 1)
    return np.column_stack([grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel(), grid[1:, 1:].ravel(), grid[1:, :-1].ravel()])
