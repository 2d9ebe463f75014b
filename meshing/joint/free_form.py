"""Hexahedral meshes of solder of any shape: tetrahedra, each split into four hexahedra.

New surface nodes are projected onto the closed surface, and nodes are relaxed until the element corners are well shaped
(``core.hexahedra``). Wetted faces are scaled to their exact areas; the free surface moves along its normals to the
exact volume, by a factor that is reported (``section_scale``).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from reflowshock.meshing.core.facets import nearest_on_line, nearest_on_triangles, outlines, pieces
from reflowshock.meshing.core.hexahedra import Freedom, quad_areas, relax_hexahedra, volumes
from reflowshock.meshing.core.quadratic_tetrahedra import curved_volume, quadratic_tetrahedra
from reflowshock.meshing.core.split_tetrahedra import split_tetrahedra
from reflowshock.meshing.joint.solder import Side, Solder, WettedFace
from reflowshock.meshing.joint.swept import Placing, volume_keeping_scale
from reflowshock.meshing.joint.tetrahedra import Tetrahedra
from reflowshock.meshing.surface.closed_surface import (
    BOARD_PAD,
    FREE,
    PACKAGE_PAD,
    ClosedSurface,
    area_vectors,
    enclosed_volume,
    pad_planes,
    pieces_of,
)

SIDES: dict[int, Side] = {BOARD_PAD: "board", PACKAGE_PAD: "package"}


def free_form_solder(surface: ClosedSurface, tetrahedra: Tetrahedra, place: Placing) -> Solder:
    """Split tetrahedra into hexahedra and fit these to the closed surface, keeping volume and wetted areas.

    New nodes on contact lines are projected onto these lines, other surface nodes onto the free surface. Wetted faces
    are scaled about their centres to their areas, then the free surface moves along its normals until the volume fits.

    Args:
        surface: Closed surface in the body's own frame.
        tetrahedra: Tetrahedra that fill it, with labels of its surface triangles.
        place: Map from the own frame to the assembly, where the volume is kept; points of shape (n, 3) [m].

    Returns:
        Hexahedra in the body's own frame, with wetted faces, exact volume, and ten-node tetrahedra of the same shape.

    Raises:
        ValueError: The free surface would have to move too far to keep the volume.
    """
    split = split_tetrahedra(tetrahedra.points, tetrahedra.cells)
    triangles = {label: tetrahedra.triangles[tetrahedra.boundary == label] for label in (FREE, *SIDES)}
    quads = {label: split.quads_of(triangles[label]) for label in triangles}
    wetted = [(label, quads[label][rows]) for label in SIDES for rows in pieces(quads[label])]
    fixed = np.intersect1d(quads[FREE], np.concatenate([part for _, part in wetted]))
    points, volume = split.points, enclosed_volume(surface)
    for label, part in wetted:
        points = _fit_pad(points, surface, label, part)
    points = _fit_free(points, surface, quads[FREE], fixed)
    points = relax_hexahedra(points, split.cells, _sliding(points, quads, fixed))
    points = _fit_free(points, surface, quads[FREE], fixed)
    normals = _normals(points, quads[FREE])
    normals[fixed] = 0.0
    points, scale = _keep_volume(points, normals, lambda moved: volumes(place(moved), split.cells).sum(), volume)
    points = relax_hexahedra(points, split.cells, _inside(points, quads))
    named = {f"pad_{side}": triangles[label] for label, side in SIDES.items()} | {"free": triangles[FREE]}
    quadratic = quadratic_tetrahedra(split, points, tetrahedra.cells, named)
    curved, _ = _keep_volume(
        quadratic.points,
        normals[: len(quadratic.points)],
        lambda moved: curved_volume(place(moved), quadratic.cells),
        volume,
    )
    faces = tuple(_wetted_face(SIDES[label], part) for label, part in wetted)
    quadratic = replace(quadratic, points=curved)
    return Solder(points, split.cells, faces, volume, scale, pad_planes(surface), quadratic)


def _wetted_face(side: Side, quads: np.ndarray) -> WettedFace:
    """Build a wetted face from outward quadrilaterals; those on the board are reversed, to be seen from above."""
    upward = quads[:, ::-1] if side == "board" else quads
    return WettedFace(side, upward, outlines(upward)[0])


def _fit_pad(points: np.ndarray, surface: ClosedSurface, label: int, quads: np.ndarray) -> np.ndarray:
    """Move the rims of a wetted face to the contact lines and scale the face to the wetted area."""
    centre = points[np.unique(quads)].mean(axis=0)
    pad_triangles = min(
        pieces_of(surface, label), key=lambda pad: np.linalg.norm(surface.points[np.unique(pad)].mean(axis=0) - centre)
    )
    lines = [surface.points[line] for line in outlines(pad_triangles)]
    result = points.copy()
    for rim in outlines(quads):
        line = min(lines, key=lambda line: np.linalg.norm(line.mean(axis=0) - points[rim].mean(axis=0)))
        result[rim] = nearest_on_line(line, points[rim])
    wetted = np.linalg.norm(area_vectors(surface.points, pad_triangles), axis=1).sum()
    stretch = np.sqrt(wetted / quad_areas(result, quads).sum())
    nodes = np.unique(quads)
    result[nodes] = centre + stretch * (result[nodes] - centre)
    return result


def _fit_free(points: np.ndarray, surface: ClosedSurface, quads: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Project the nodes of the free surface, except those of contact lines, onto the closed surface."""
    nodes = np.setdiff1d(quads, fixed)
    result = points.copy()
    result[nodes] = nearest_on_triangles(surface.points, surface.triangles[surface.boundary == FREE], points[nodes])
    return result


def _normals(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Return unit normals at the nodes of outward quadrilaterals, zero elsewhere, shape (n, 3)."""
    corners = points[quads]
    areas = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    sums = np.stack([np.bincount(quads.ravel(), np.repeat(areas[:, k], 4), len(points)) for k in range(3)], axis=1)
    sizes = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.divide(sums, sizes, out=np.zeros_like(sums), where=sizes > 0.0)


def _sliding(points: np.ndarray, quads: dict[int, np.ndarray], fixed: np.ndarray) -> Freedom:
    """Return the freedom of nodes that slide: all except those of contact lines, surface nodes along the surface."""
    free = np.ones(len(points), dtype=bool)
    free[fixed] = False
    return Freedom(free, _normals(points, np.concatenate(list(quads.values()))))


def _inside(points: np.ndarray, quads: dict[int, np.ndarray]) -> Freedom:
    """Return the freedom of nodes of which only interior ones move."""
    free = np.ones(len(points), dtype=bool)
    free[np.concatenate(list(quads.values()))] = False
    return Freedom(free, np.zeros_like(points))


def _keep_volume(
    points: np.ndarray, normals: np.ndarray, volume_of: Callable[[np.ndarray], float], volume: float
) -> tuple[np.ndarray, float]:
    """Move points along normals (n, 3) until they enclose a volume [m^3].

    Returns:
        Moved points, shape (n, 3) [m], and 1 plus the distance over the radius of a sphere of that volume.
    """
    radius = np.cbrt(0.75 * volume / np.pi)

    def moved(scale: float) -> np.ndarray:
        return points + (scale - 1.0) * radius * normals

    scale = volume_keeping_scale(lambda value: float(volume_of(moved(value))), volume)
    return moved(scale), scale
