"""Solder of any shape as hexahedra: tetrahedra in its surface, each split into four, volume and wetted areas kept.

New nodes go to the surface, and nodes slide until the corners are good (``core.hexahedra``). Outlines are scaled to the
areas of their sections, and what is free by one factor (``section_scale``), which is reported.
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
    """Make hexahedra of tetrahedra in a surface.

    The new nodes of the surface go to where it is: those on contact lines to these lines, others along it. Wetted faces
    are scaled about their centres to their areas, then the free surface moves along its normals to the volume.

    Args:
        surface: the body in its own frame.
        tetrahedra: in it.
        place: moves points (n, 3) [m] to where the body will be, where its volume is kept.

    Raises:
        ValueError: the free surface would have to move too far to keep the volume.
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
    """Make a face of outward quadrilaterals: those on the board are seen from below."""
    upward = quads[:, ::-1] if side == "board" else quads
    return WettedFace(side, upward, outlines(upward)[0])


def _fit_pad(points: np.ndarray, surface: ClosedSurface, label: int, quads: np.ndarray) -> np.ndarray:
    """Move the rims of a wetted face to the contact lines and scale the face to the wetted area."""
    centre = points[np.unique(quads)].mean(axis=0)
    own = min(
        pieces_of(surface, label), key=lambda pad: np.linalg.norm(surface.points[np.unique(pad)].mean(axis=0) - centre)
    )
    lines = [surface.points[line] for line in outlines(own)]
    result = points.copy()
    for rim in outlines(quads):
        line = min(lines, key=lambda line: np.linalg.norm(line.mean(axis=0) - points[rim].mean(axis=0)))
        result[rim] = nearest_on_line(line, points[rim])
    wetted = np.linalg.norm(area_vectors(surface.points, own), axis=1).sum()
    stretch = np.sqrt(wetted / quad_areas(result, quads).sum())
    nodes = np.unique(quads)
    result[nodes] = centre + stretch * (result[nodes] - centre)
    return result


def _fit_free(points: np.ndarray, surface: ClosedSurface, quads: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Move the nodes of the free surface, but those of contact lines, to the nearest points of the given one."""
    nodes = np.setdiff1d(quads, fixed)
    result = points.copy()
    result[nodes] = nearest_on_triangles(surface.points, surface.triangles[surface.boundary == FREE], points[nodes])
    return result


def _normals(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Unit normals at the nodes of outward quadrilaterals (n, 3); zero elsewhere."""
    corners = points[quads]
    areas = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    sums = np.stack([np.bincount(quads.ravel(), np.repeat(areas[:, k], 4), len(points)) for k in range(3)], axis=1)
    sizes = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.divide(sums, sizes, out=np.zeros_like(sums), where=sizes > 0.0)


def _sliding(points: np.ndarray, quads: dict[int, np.ndarray], fixed: np.ndarray) -> Freedom:
    """All nodes but those of contact lines move, those of the surface along it."""
    free = np.ones(len(points), dtype=bool)
    free[fixed] = False
    return Freedom(free, _normals(points, np.concatenate(list(quads.values()))))


def _inside(points: np.ndarray, quads: dict[int, np.ndarray]) -> Freedom:
    """Only nodes inside move."""
    free = np.ones(len(points), dtype=bool)
    free[np.concatenate(list(quads.values()))] = False
    return Freedom(free, np.zeros_like(points))


def _keep_volume(
    points: np.ndarray, normals: np.ndarray, volume_of: Callable[[np.ndarray], float], volume: float
) -> tuple[np.ndarray, float]:
    """Move points along normals (n, 3) to a volume [m^3]: by a share of the radius of a ball that has it."""
    radius = np.cbrt(0.75 * volume / np.pi)

    def moved(scale: float) -> np.ndarray:
        return points + (scale - 1.0) * radius * normals

    scale = volume_keeping_scale(lambda value: float(volume_of(moved(value))), volume)
    return moved(scale), scale
