"""How a mesh of solder differs from the surface that it fills: standoff, contact areas, largest distance."""

import numpy as np

from reflowshock.meshing.core.hexahedra import boundary_quads, quad_areas
from reflowshock.meshing.core.nearest import nearest_on_triangles
from reflowshock.meshing.joint.solder import Solder
from reflowshock.meshing.surface.closed_surface import BOARD_PAD, PACKAGE_PAD, ClosedSurface, pad_area, pad_planes


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
