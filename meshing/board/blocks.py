"""Gmsh building blocks: transfinite rectangles in plan, O-grids around round holes, and extruded layers.

Gmsh models are built in millimetres, which suit its default tolerances, and scaled to metres when written.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import gmsh
import numpy as np

from reflowshock.meshing.board.plan import Interval, Plan

MILLI = 1.0e-3
TOLERANCE = 1.0e-9  # m, far below any length of a package
Block = tuple[int, int]
Surfaces = dict[Block, list[int]]


@dataclass(frozen=True, slots=True)
class RoundHole:
    """Round hole in a block of the plan.

    Attributes:
        radius: Radius of the hole [m].
        rings: Number of cells between the circle and the edge of the block.
    """

    radius: float
    rings: int


def plan_surfaces(plan: Plan, height: float, hole: RoundHole | None = None, recombine: bool = True) -> Surfaces:
    """Add the blocks of a plan to the Gmsh model as transfinite surfaces.

    Args:
        plan: Intervals along x and y that divide board, package or box into blocks, and the blocks with a hole.
        height: Coordinate z of the surfaces [m].
        hole: Round hole in the blocks ``plan.holes``: its radius [m] and its number of cell rings; None without holes.
        recombine: Whether surfaces are meshed by quadrilaterals instead of triangles.

    Returns:
        Block (i, j) -> Gmsh tags of its surfaces: one, or four around a hole. i counts intervals along x, j along y.
    """
    geo = gmsh.model.geo
    x, y = _breaks(plan.x), _breaks(plan.y)
    points = {(i, j): geo.addPoint(a, b, height / MILLI) for i, a in enumerate(x) for j, b in enumerate(y)}
    along_x = {
        (i, j): _line(points[i, j], points[i + 1, j], part) for i, part in enumerate(plan.x) for j in range(len(y))
    }
    along_y = {
        (i, j): _line(points[i, j], points[i, j + 1], part) for j, part in enumerate(plan.y) for i in range(len(x))
    }
    surfaces: Surfaces = {}
    for i in range(len(plan.x)):
        for j in range(len(plan.y)):
            sides = [along_x[i, j], along_y[i + 1, j], -along_x[i, j + 1], -along_y[i, j]]
            if hole and (i, j) in plan.holes:
                corners = [points[i, j], points[i + 1, j], points[i + 1, j + 1], points[i, j + 1]]
                counts = [plan.x[i].cells, plan.y[j].cells] * 2
                centre = (0.5 * (x[i] + x[i + 1]), 0.5 * (y[j] + y[j + 1]), height / MILLI)
                loops = _ring_around_hole(hole, centre, corners, list(zip(sides, counts, strict=True)))
            else:
                loops = [sides]
            surfaces[i, j] = [_transfinite_surface(loop, recombine) for loop in loops]
    return surfaces


def extrude(surfaces: Surfaces, thickness: float, elements: int, recombine: bool = True) -> tuple[Surfaces, Surfaces]:
    """Extrude surfaces of the current Gmsh model upwards, along z.

    Args:
        surfaces: Block (i, j) -> Gmsh tags of its surfaces, as ``plan_surfaces`` returns them.
        thickness: Thickness of the extrusion [m].
        elements: Number of element layers.
        recombine: Whether volumes are meshed by hexahedra instead of tetrahedra.

    Returns:
        Block (i, j) -> tags of its volumes, and block (i, j) -> tags of the upper surfaces, each in the order of the
        given tags.
    """
    volumes: Surfaces = {}
    tops: Surfaces = {}
    for block, tags in surfaces.items():
        results = [
            gmsh.model.geo.extrude([(2, tag)], 0.0, 0.0, thickness / MILLI, [elements], recombine=recombine)
            for tag in tags
        ]
        tops[block] = [result[0][1] for result in results]
        volumes[block] = [result[1][1] for result in results]
    return volumes, tops


def _breaks(axis: tuple[Interval, ...]) -> list[float]:
    return [part.start / MILLI for part in axis] + [axis[-1].end / MILLI]


def _line(start: int, end: int, part: Interval) -> int:
    line = gmsh.model.geo.addLine(start, end)
    gmsh.model.geo.mesh.setTransfiniteCurve(line, part.cells + 1, "Progression", part.ratio)
    return line


def lies_within_hole(surface: int, centres: Iterable[tuple[float, float]], diameter: float) -> bool:
    """Return whether a surface of the current Gmsh model lies within the bounding square of one of the holes, in plan.

    Args:
        surface: Gmsh tag of the surface.
        centres: Centres (x, y) of the holes in plan [m].
        diameter: Diameter of the holes [m].
    """
    x0, y0, _, x1, y1, _ = (value * MILLI for value in gmsh.model.getBoundingBox(2, surface))
    reach = 0.5 * diameter + TOLERANCE
    return any(x - reach <= x0 and x1 <= x + reach and y - reach <= y0 and y1 <= y + reach for x, y in centres)


def check_elements(name: str) -> None:
    """Check that no volume element of the current Gmsh mesh is inverted.

    Args:
        name: Name of the mesh for the message.

    Raises:
        ValueError: The smallest scaled Jacobian is not positive.
    """
    tags = np.concatenate(list(gmsh.model.mesh.getElements(3)[1]))
    worst = gmsh.model.mesh.getElementQualities(tags, "minSJ").min()
    if worst <= 0.0:
        raise ValueError(f"{name}: smallest scaled Jacobian {worst:.3g}, allowed > 0")


def count_elements(volumes: Iterable[int]) -> int:
    """Return the number of 3D elements in volumes of the current, meshed Gmsh model, given by their tags."""
    return sum(len(tags) for volume in volumes for tags in gmsh.model.mesh.getElements(3, volume)[1])


def _transfinite_surface(sides: list[int], recombine: bool) -> int:
    geo = gmsh.model.geo
    surface = geo.addPlaneSurface([geo.addCurveLoop(sides)])
    geo.mesh.setTransfiniteSurface(surface, "Left" if recombine else "AlternateLeft")
    if recombine:
        geo.mesh.setRecombine(2, surface)
    return surface


def _ring_around_hole(
    hole: RoundHole, centre: tuple[float, float, float], corners: list[int], sides: list[tuple[int, int]]
) -> list[list[int]]:
    """Return the outlines of four blocks between a circle and the square around it, divided along the diagonals."""
    geo = gmsh.model.geo
    middle, radius = geo.addPoint(*centre), hole.radius / MILLI
    angles = [math.pi * (1.25 + 0.5 * k) for k in range(4)]
    rim = [geo.addPoint(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a), centre[2]) for a in angles]
    spokes = [geo.addLine(rim[k], corners[k]) for k in range(4)]
    for spoke in spokes:
        geo.mesh.setTransfiniteCurve(spoke, hole.rings + 1)
    loops = []
    for k, (side, cells) in enumerate(sides):
        arc = geo.addCircleArc(rim[k], middle, rim[(k + 1) % 4])
        geo.mesh.setTransfiniteCurve(arc, cells + 1)
        loops.append([spokes[k], side, -spokes[(k + 1) % 4], -arc])
    return loops
