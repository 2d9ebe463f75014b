"""Meshing methods for a body of solder in order of preference; the first mesh that passes its checks is used.

Swept hexahedra come first. The joint is straightened between its pads (``pad_planes``) in proportion to the height, so
that its ends stay in both planes; the second attempt has more layers, the third a finer section as well. If all fail,
Gmsh remeshes the surface patch by patch, and each tetrahedron is split into four hexahedra. Bodies with voids or with
several pads are never swept, because sweeping would lose features between two levels. Both methods keep the volume
exactly. Split hexahedra are more accurate in bending and vibration than swept ones of the same size, but need about a
fifth of the time step. The record of a joint lists the failed attempts with their reasons.
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
from reflowshock.meshing.joint.tetrahedra import fill_in_process
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
FREE_FORM_SIZES = (1.0, 0.75, 1.25)  # edge length over two layer heights, since the split halves each edge
LARGEST_DEVIATION = 0.1  # of the radius of a sphere of equal volume; the polygon of a swept section adds its own


@dataclass(frozen=True, slots=True)
class Attempt:
    """Method and settings with which a body can be meshed.

    Attributes:
        record: Method and settings, for the record of the joint.
        make: Function that meshes the body.
        largest_deviation: Largest allowed deviation of the shape, relative to the radius of a sphere of equal volume.
    """

    record: dict[str, Any]
    make: Callable[[], Solder]
    largest_deviation: float


def attempts(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """Yield the meshing attempts for a body: swept if it is one piece between two pads, then free-form.

    Args:
        surface: Closed surface of the solder (vertices, triangles, labels), in its own frame: board's pad at z = 0.
        numerics: Resolution of the mesh: elements of the cross-section and layers.
        place: Function that maps points of the body's own frame to the assembly, shape (n, 3) [m] both.

    Yields:
        Method with its settings and a function that meshes the body, not yet called, in order of preference.
    """
    one_piece = len(pieces_of(surface)) == 1
    if one_piece and all(len(pieces_of(surface, pad)) == 1 for pad in (BOARD_PAD, PACKAGE_PAD)):
        yield from _swept(surface, numerics, place)
    yield from free_form(surface, numerics, place)


def free_form(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """Yield the meshing attempts that suit a body of any shape, best first: split tetrahedra of several sizes.

    Args:
        surface: Closed surface of the solder (vertices, triangles, labels), in its own frame: board's pad at z = 0.
        numerics: Number of element layers, which gives the sizes.
        place: Function that maps points of the body's own frame to the assembly, shape (n, 3) [m] both.

    Yields:
        Method with its settings and a function that meshes the body, not yet called, in order of preference.
    """
    element = 2.0 * pad_planes(surface).gap / numerics.layers
    for share in FREE_FORM_SIZES:
        for cut in (False, True):
            record = {"method": "free-form", "size": share * element, "cut_into_patches": cut}
            yield Attempt(record, partial(_fill, surface, share * element, cut, place), LARGEST_DEVIATION)


def _swept(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """Yield swept attempts: the requested resolution, then more layers, then a finer section as well."""
    taller = {"layers": min(2 * numerics.layers, MOST_LAYERS)}
    for finer in ({}, taller, taller | {"core": numerics.core + 1, "rings": numerics.rings + 1}):
        chosen = numerics.model_copy(update=finer)
        record = {"method": "swept", **chosen.model_dump()}
        corner = circumradius(4 * chosen.core) - 1.0
        yield Attempt(record, partial(swept_solder, surface, chosen, place), LARGEST_DEVIATION + corner)


def _fill(surface: ClosedSurface, size: float, cut_into_patches: bool, place: Placing) -> Solder:
    return free_form_solder(surface, fill_in_process(surface, size, cut_into_patches), place)


def first_valid_mesh(
    surface: ClosedSurface, candidates: Iterator[Attempt], name: str, build: Callable[[Solder], JointMesh]
) -> JointMesh:
    """Return the first mesh that passes its checks; its record lists why earlier attempts failed.

    Args:
        surface: Closed surface of the solder, against which the mesh is checked.
        candidates: Meshing attempts in order of preference; no more of them are made than necessary.
        name: Name of the joint, for the message.
        build: Function that takes the meshed solder, moves it into the assembly and adds copper pads.

    Returns:
        Mesh whose record has method and settings of the attempt, ``standoff_error``, ``contact_area_error``,
        ``shape_deviation`` [m], and ``tries``, the failed attempts with the reason in ``missed``.

    Raises:
        JointMeshError: All attempts fail; the message gives the reason of each.
    """
    radius = math.cbrt(0.75 * enclosed_volume(surface) / math.pi)
    failures: list[dict[str, Any]] = []
    for attempt in candidates:
        try:
            solder = attempt.make()
            mesh, errors = build(solder), shape_errors(surface, solder)
            check_errors(mesh, errors, attempt.largest_deviation * radius)
        except ValueError as error:
            failures.append({**attempt.record, "missed": str(error)})
            continue
        return replace(mesh, record={**attempt.record, **errors, **mesh.record, "tries": failures})
    reasons = dict.fromkeys(f"{failure['missed']} ({failure['method']})" for failure in failures)
    raise JointMeshError(f"joint {name}: {'; '.join(reasons)}")


def shape_errors(surface: ClosedSurface, solder: Solder) -> dict[str, float]:
    """Compare the solder mesh with the surface that it fills, both in the body's own frame.

    Args:
        surface: Closed surface of the solder, with labels of its pads.
        solder: Hexahedra with their wetted faces.

    Returns:
        ``standoff_error``, the relative error of the distance between the mean heights of the wetted faces;
        ``contact_area_error``, the larger relative error of the wetted areas of both sides; ``shape_deviation``, the
        largest distance between both surfaces [m]: from nodes and facet centres of the mesh to the closed surface, and
        from the vertices of the closed surface to the mesh. All are magnitudes.
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
    """Return area [m^2] and mean height [m] of the wetted faces of one side."""
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
