"""Ways to mesh a body of solder, the most wanted first; the first whose mesh meets its bars is taken.

First come swept hexahedra: the joint is made straight between its pads (``pad_planes``), shares of the height kept, so
that its ends stay in both planes; then the same with more layers. Otherwise Gmsh remeshes the surface patch by patch,
and each tetrahedron is split into four hexahedra. Bodies with voids or with several pads are never swept, because a
section between two levels would be lost. The volume is exact either way. Split hexahedra bend and vibrate better than
swept ones of their size, but need about a fifth of their time step. The record of a joint says what earlier ways
missed.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from reflowshock.meshing.board.parameters import JointNumerics
from reflowshock.meshing.core.facets import nearest_on_triangles
from reflowshock.meshing.core.hexahedra import boundary_quads, quad_areas
from reflowshock.meshing.joint.butterfly import circumradius
from reflowshock.meshing.joint.free_form import free_form_solder
from reflowshock.meshing.joint.joint_mesh import JointMesh, JointMeshError, check_errors
from reflowshock.meshing.joint.solder import Solder
from reflowshock.meshing.joint.swept import Placing, swept_solder
from reflowshock.meshing.joint.tetrahedra import fill_apart
from reflowshock.meshing.surface.closed_surface import (
    BOARD_PAD,
    PACKAGE_PAD,
    ClosedSurface,
    enclosed_volume,
    pad_area,
    pad_planes,
    pieces_of,
)

MOST_LAYERS = 64
FREE_FORM_SIZES = (1.0, 0.75, 1.25)  # of two layers: split in two, an edge is as long as a layer is high
LARGEST_DEVIATION = 0.1  # of the radius of a ball of the same volume, beside that of the wanted polygon from a circle


@dataclass(frozen=True, slots=True)
class Attempt:
    """One way to mesh a body.

    Attributes:
        record: of it.
        make: makes the solder.
        largest_deviation: of its shape, over the radius of a ball of the same volume.
    """

    record: dict[str, Any]
    make: Callable[[], Solder]
    largest_deviation: float


def attempts(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """List the ways to mesh a body: swept, if it is one piece between two pads, then free-form."""
    one_piece = len(pieces_of(surface)) == 1
    if one_piece and all(len(pieces_of(surface, pad)) == 1 for pad in (BOARD_PAD, PACKAGE_PAD)):
        yield from _swept(surface, numerics, place)
    yield from free_form(surface, numerics, place)


def free_form(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """List the ways to mesh a body of any shape."""
    element = 2.0 * pad_planes(surface).gap / numerics.layers
    for share in FREE_FORM_SIZES:
        for cut in (False, True):
            record = {"method": "free-form", "size": share * element, "cut_into_patches": cut}
            yield Attempt(record, partial(_fill, surface, (share * element, cut), place), LARGEST_DEVIATION)


def _swept(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """The wanted resolution, with more layers, and with a finer section as well."""
    taller = {"layers": min(2 * numerics.layers, MOST_LAYERS)}
    for finer in ({}, taller, taller | {"core": numerics.core + 1, "rings": numerics.rings + 1}):
        chosen = numerics.model_copy(update=finer)
        record = {"method": "swept", **chosen.model_dump()}
        corner = circumradius(4 * chosen.core) - 1.0
        yield Attempt(record, partial(swept_solder, surface, chosen, place), LARGEST_DEVIATION + corner)


def _fill(surface: ClosedSurface, how: tuple[float, bool], place: Placing) -> Solder:
    return free_form_solder(surface, fill_apart(surface, *how), place)


def first_good(
    surface: ClosedSurface, ways: Iterator[Attempt], name: str, build: Callable[[Solder], JointMesh]
) -> JointMesh:
    """Return the first mesh that meets its bars; its record tells what others missed.

    Args:
        surface: that it fills.
        ways: to mesh it.
        name: of the joint.
        build: puts solder into its place.

    Raises:
        JointMeshError: none does; tells what each missed.
    """
    radius = math.cbrt(0.75 * enclosed_volume(surface) / math.pi)
    missed: list[dict[str, Any]] = []
    for way in ways:
        try:
            solder = way.make()
            mesh, errors = build(solder), shape_errors(surface, solder)
            check_errors(mesh, errors, way.largest_deviation * radius)
        except ValueError as error:
            missed.append({**way.record, "missed": str(error)})
            continue
        return replace(mesh, record={**way.record, **errors, **mesh.record, "tries": missed})
    reasons = dict.fromkeys(f"{way['missed']} ({way['method']})" for way in missed)
    raise JointMeshError(f"joint {name}: {'; '.join(reasons)}")


def shape_errors(surface: ClosedSurface, solder: Solder) -> dict[str, float]:
    """Compare solder with the surface that it fills, both in the body's own frame.

    Returns:
        standoff_error: between the mean heights of the wetted faces, relative; contact_area_error: the larger of both
        sides, relative; shape_deviation: largest distance between the surfaces [m], from the nodes and centres of the
        mesh's facets to the given surface, and from the vertices of that to the mesh's.
    """
    heights = {side: _wetted(solder, side) for side in ("board", "package")}
    standoff = heights["package"][1] - heights["board"][1]
    areas = [
        abs(heights[side][0] / pad_area(surface, pad) - 1.0)
        for side, pad in (("board", BOARD_PAD), ("package", PACKAGE_PAD))
    ]
    return {
        "standoff_error": abs(standoff / pad_planes(surface).gap - 1.0),
        "contact_area_error": float(np.max(areas)),
        "shape_deviation": _deviation(surface, solder),
    }


def _wetted(solder: Solder, side: str) -> tuple[float, float]:
    """Area [m^2] and mean height [m] of the wetted faces of one side."""
    quads = np.vstack([face.quads for face in solder.faces if face.side == side])
    areas = quad_areas(solder.points, quads)
    return float(areas.sum()), float(areas @ solder.points[quads, 2].mean(axis=1) / areas.sum())


def _deviation(surface: ClosedSurface, solder: Solder) -> float:
    quads = boundary_quads(solder.cells)
    triangles = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    samples = np.vstack([solder.points[np.unique(quads)], solder.points[quads].mean(axis=1)])
    there = nearest_on_triangles(surface.points, surface.triangles, samples)
    back = nearest_on_triangles(solder.points, triangles, surface.points)
    distances = [np.linalg.norm(there - samples, axis=1).max(), np.linalg.norm(back - surface.points, axis=1).max()]
    return float(np.max(distances))
