"""A box of layers as hexahedra or tetrahedra in one Gmsh file: layers are volumes, its faces and holes named facets."""

from itertools import chain
from pathlib import Path

import gmsh

from meshing.blocks import (
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
from meshing.box_plan import Box, box_plan
from meshing.gmsh_session import gmsh_model, name_groups, write_msh

SIDES = ("x_min", "x_max", "y_min", "y_max")


def write_box(box: Box, path: Path) -> dict[str, int]:
    """Mesh the box and write it as Gmsh 4.1 in metres.

    Args:
        box: sizes, layers, holes, kind of element.
        path: the ``.msh`` file to write.

    Returns:
        Number of elements of every layer.

    Raises:
        ValueError: an element is inside out.
    """
    recombine = box.element == "hexahedron"
    hole = RoundHole(0.5 * box.holes.diameter, box.rings) if box.holes else None
    with gmsh_model("structure"):
        bottom = top = plan_surfaces(box_plan(box), 0.0, hole, recombine)
        layers: dict[str, list[int]] = {}
        for layer in box.layers:
            volumes, top = extrude(top, layer.thickness, layer.cells, recombine)
            layers[layer.name] = _flat(volumes)
        gmsh.model.geo.synchronize()
        name_groups(3, layers)
        name_groups(2, _sides(box) | {"z_min": _flat(bottom), "z_max": _flat(top)})
        gmsh.model.mesh.generate(3)
        if box.element == "tetrahedron_quadratic":
            gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)  # straight edges: those of the linear tetrahedra
            gmsh.model.mesh.setOrder(2)
        check_elements("structure")
        write_msh(path, MILLI)
        return {name: count_elements(tags) for name, tags in layers.items()}


def _sides(box: Box) -> dict[str, list[int]]:
    """Find faces and hole walls by where the surfaces lie."""
    names: dict[str, list[int]] = {name: [] for name in SIDES}
    if box.holes:
        names["mounting_holes"] = []
    low = [0.0 if box.is_halved(axis) else -0.5 * box.size[axis] for axis in (0, 1)]
    planes = ((0, low[0]), (0, 0.5 * box.size[0]), (1, low[1]), (1, 0.5 * box.size[1]))
    for _, tag in gmsh.model.getEntities(2):
        limits = [value * MILLI for value in gmsh.model.getBoundingBox(2, tag)]
        for name, (axis, place) in zip(SIDES, planes, strict=True):
            if max(abs(limits[axis] - place), abs(limits[axis + 3] - place)) < TOLERANCE:
                names[name].append(tag)
        if box.holes and _is_wall(limits):
            centre = (0.5 * box.holes.spacing[0], 0.5 * box.holes.spacing[1])
            if lies_within_hole(tag, centre, box.holes.diameter):
                names["mounting_holes"].append(tag)
    return names


def _is_wall(limits: list[float]) -> bool:
    return limits[5] - limits[2] > TOLERANCE


def _flat(surfaces: Surfaces) -> list[int]:
    return list(chain.from_iterable(surfaces.values()))
