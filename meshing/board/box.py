"""Layered box as hexahedra or tetrahedra in one Gmsh file; layers are volumes, faces and hole walls named facets."""

from dataclasses import dataclass
from itertools import accumulate, chain, pairwise
from math import prod
from pathlib import Path

import gmsh

from reflowshock.meshing.board.blocks import (
    MILLI,
    TOLERANCE,
    RoundHole,
    Surfaces,
    check_elements,
    count_elements,
    extrude,
    lies_within_hole,
    plan_surfaces,
)
from reflowshock.meshing.board.box_plan import Box, box_plan
from reflowshock.meshing.core.gmsh_session import gmsh_model, name_groups, write_msh

EVERYWHERE = 1.0e9  # mm
SIDES = ("x_min", "x_max", "y_min", "y_max")


def write_box(box: Box, path: Path) -> dict[str, int]:
    """Mesh a layered box and write it as MSH 4.1 in metres.

    Args:
        box: Sizes, layers, holes and element type.
        path: The ``.msh`` file to write.

    Returns:
        Layer name -> number of elements.

    Raises:
        ValueError: An element is inverted.
    """
    with gmsh_model("structure"):
        thickness = [sum(layer.thickness for layer in stack.layers) for stack in box.stacks]
        bottoms = list(accumulate(thickness[:-1], initial=0.0))
        gap = sum(thickness)  # stacks are built apart, because Gmsh would merge coincident faces
        built = [
            _add_stack(stack, bottom + k * gap)
            for k, (stack, bottom) in enumerate(zip(box.stacks, bottoms, strict=True))
        ]
        gmsh.model.geo.synchronize()
        layers = {name: tags for stack in built for name, tags in stack.layers.items()}
        name_groups(3, layers)
        name_groups(2, _sides(box) | _faces(box, built))
        gmsh.model.mesh.generate(3)
        if box.element == "tetrahedron_quadratic":
            gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)  # straight edges: those of the linear tetrahedra
            gmsh.model.mesh.setOrder(2)
        check_elements("structure")
        for k, (bottom, height) in enumerate(zip(bottoms, thickness, strict=True)):
            _lower(k * gap, bottom + k * gap, height)
        write_msh(path, MILLI)
        return {name: count_elements(tags) for name, tags in layers.items()}


@dataclass(frozen=True, slots=True)
class _Stack:
    """Gmsh tags of a stack: volumes by layer name, lower and upper faces."""

    layers: dict[str, list[int]]
    bottom: list[int]
    top: list[int]


def _add_stack(stack: Box, height: float) -> _Stack:
    """Extrude the layers of a stack from z = height [m]."""
    recombine = stack.element == "hexahedron"
    hole = RoundHole(0.5 * stack.holes.diameter, stack.rings) if stack.holes else None
    bottom = top = plan_surfaces(box_plan(stack), height, hole, recombine)
    layers: dict[str, list[int]] = {}
    for layer in stack.layers:
        volumes, top = extrude(top, layer.thickness, layer.cells, recombine)
        layers[layer.name] = _flat(volumes)
    return _Stack(layers, _flat(bottom), _flat(top))


def _lower(distance: float, bottom: float, height: float) -> None:
    """Move the nodes of the stack between two heights down [m]."""
    low, high = (bottom - 0.5 * height) / MILLI, (bottom + 1.5 * height) / MILLI
    slab = gmsh.model.getEntitiesInBoundingBox(-EVERYWHERE, -EVERYWHERE, low, EVERYWHERE, EVERYWHERE, high)
    gmsh.model.mesh.affineTransform([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -distance / MILLI], slab)


def _faces(box: Box, built: list[_Stack]) -> dict[str, list[int]]:
    """Name the lowest and the highest face, and between two stacks the finer face as slave of the coarser one."""
    faces = {"z_min": built[0].bottom, "z_max": built[-1].top}
    for (lower, upper), (below, above) in zip(pairwise(box.stacks), pairwise(built), strict=True):
        pair = f"{lower.layers[-1].name}-{upper.layers[0].name}"
        lower_is_finer = prod(lower.cells) > prod(upper.cells)
        slave, master = (below.top, above.bottom) if lower_is_finer else (above.bottom, below.top)
        faces |= {f"slave@{pair}": slave, f"master@{pair}": master}
    return faces


def _sides(box: Box) -> dict[str, list[int]]:
    """Find lateral faces and hole walls by the positions of the surfaces."""
    names: dict[str, list[int]] = {name: [] for name in SIDES}
    if box.holes:
        names["mounting_holes"] = []
    low = [0.0 if box.is_halved(axis) else -0.5 * box.size[axis] for axis in (0, 1)]
    planes = ((0, low[0]), (0, 0.5 * box.size[0]), (1, low[1]), (1, 0.5 * box.size[1]))
    for _, tag in gmsh.model.getEntities(2):
        limits = [value * MILLI for value in gmsh.model.getBoundingBox(2, tag)]
        for name, (axis, position) in zip(SIDES, planes, strict=True):
            if max(abs(limits[axis] - position), abs(limits[axis + 3] - position)) < TOLERANCE:
                names[name].append(tag)
        if box.holes and _is_wall(limits) and lies_within_hole(tag, box.holes.places, box.holes.diameter):
            names["mounting_holes"].append(tag)
    return names


def _is_wall(limits: list[float]) -> bool:
    return limits[5] - limits[2] > TOLERANCE


def _flat(surfaces: Surfaces) -> list[int]:
    return list(chain.from_iterable(surfaces.values()))
