"""Gmsh building blocks: a plan of transfinite rectangles, O-grids around round holes, layers extruded from it.

Gmsh models are built in millimetres (its default tolerances suit them) and scaled to metres when written.
"""

import math
from dataclasses import dataclass

import gmsh

from meshing.plan import Interval, Plan

MILLI = 1.0e-3
Block = tuple[int, int]
Surfaces = dict[Block, list[int]]


@dataclass(frozen=True, slots=True)
class RoundHole:
    """A round hole in a block of the plan [m]; ``rings`` cells between the circle and the block's edge."""

    radius: float
    rings: int


def plan_surfaces(plan: Plan, height: float, hole: RoundHole | None = None) -> Surfaces:
    """Add the plan as recombined transfinite surfaces at z = height [m].

    Returns:
        Block (i, j) -> surface tags: one, or four around a hole.
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
            if hole and i in plan.hole_x and j in plan.hole_y:
                corners = [points[i, j], points[i + 1, j], points[i + 1, j + 1], points[i, j + 1]]
                counts = [plan.x[i].cells, plan.y[j].cells] * 2
                centre = (0.5 * (x[i] + x[i + 1]), 0.5 * (y[j] + y[j + 1]), height / MILLI)
                surfaces[i, j] = _ring_around_hole(hole, centre, corners, list(zip(sides, counts, strict=True)))
            else:
                surfaces[i, j] = [_transfinite_surface(sides)]
    return surfaces


def extrude(surfaces: Surfaces, thickness: float, elements: int) -> tuple[Surfaces, Surfaces]:
    """Extrude surfaces upwards by ``thickness`` [m] in ``elements`` layers of hexahedra.

    Returns:
        Volumes and upper surfaces, by block.
    """
    volumes: Surfaces = {}
    tops: Surfaces = {}
    for block, tags in surfaces.items():
        results = [
            gmsh.model.geo.extrude([(2, tag)], 0.0, 0.0, thickness / MILLI, [elements], recombine=True) for tag in tags
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


def _transfinite_surface(sides: list[int]) -> int:
    geo = gmsh.model.geo
    surface = geo.addPlaneSurface([geo.addCurveLoop(sides)])
    geo.mesh.setTransfiniteSurface(surface)
    geo.mesh.setRecombine(2, surface)
    return surface


def _ring_around_hole(
    hole: RoundHole, centre: tuple[float, float, float], corners: list[int], sides: list[tuple[int, int]]
) -> list[int]:
    """Four blocks between the circle and the square: spokes from the circle's diagonals to the corners."""
    geo = gmsh.model.geo
    middle, radius = geo.addPoint(*centre), hole.radius / MILLI
    angles = [math.pi * (1.25 + 0.5 * k) for k in range(4)]
    rim = [geo.addPoint(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a), centre[2]) for a in angles]
    spokes = [geo.addLine(rim[k], corners[k]) for k in range(4)]
    for spoke in spokes:
        geo.mesh.setTransfiniteCurve(spoke, hole.rings + 1)
    surfaces = []
    for k, (side, cells) in enumerate(sides):
        arc = geo.addCircleArc(rim[k], middle, rim[(k + 1) % 4])
        geo.mesh.setTransfiniteCurve(arc, cells + 1)
        surfaces.append(_transfinite_surface([spokes[k], side, -spokes[(k + 1) % 4], -arc]))
    return surfaces
