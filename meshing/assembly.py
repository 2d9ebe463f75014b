"""The assembly: board with holes, package above it, as named structured hexahedra in one Gmsh file.

Joints are not in it: they are meshed after reflow and tied to ``board_side`` and ``package_side``.
"""

from contextlib import contextmanager
from itertools import chain
from pathlib import Path

import gmsh
import numpy as np

from meshing.blocks import MILLI, RoundHole, Surfaces, extrude, plan_surfaces
from meshing.pads import lift
from meshing.parameters import Board, Package, Warpage
from meshing.plan import Plan, board_plan, hole_square, in_patch, package_plan, under_package

HEXAHEDRON = 5
TOLERANCE = 1.0e-6  # mm, far below any length of a package


def write_assembly(package: Package, board: Board, warpage: Warpage, path: Path) -> dict[str, int]:
    """Mesh board and package and write them as Gmsh 4.1 in metres.

    Args:
        package: array, pads, layers.
        board: sizes, holes, symmetry.
        warpage: lift of the package.
        path: the ``.msh`` file to write.

    Returns:
        Number of hexahedra of every part.

    Raises:
        ValueError: an element is inside out.
    """
    with _gmsh_model("assembly"):
        parts = _board_parts(package, board)
        first_of_package = gmsh.model.geo.getMaxTag(3) + 1
        parts |= _package_parts(package, board, parts)
        gmsh.model.geo.synchronize()
        facets = {name: tags for name, tags in parts.items() if name.endswith("_side") or name == "board_bottom"}
        volumes = {name: tags for name, tags in parts.items() if name not in facets}
        facets |= _planes_and_holes(board)
        _name(3, volumes)
        _name(2, facets)
        gmsh.model.mesh.generate(3)
        _lift_package(package, warpage, [tag for _, tag in gmsh.model.getEntities(3) if tag >= first_of_package])
        _check_elements()
        _write(path)
        return {name: sum(_count(tag) for tag in tags) for name, tags in volumes.items()}


def _board_parts(package: Package, board: Board) -> dict[str, list[int]]:
    """Extrude the board from its lower face; its uppermost layers around the package are the meso model's patch."""
    plan, numerics = board_plan(package, board), board.numerics
    ring = 0.5 * (hole_square(board) - board.holes.diameter)
    hole = RoundHole(0.5 * board.holes.diameter, max(1, round(ring / numerics.coarse_size)))
    layer = board.thickness / numerics.layers
    bottom = plan_surfaces(plan, -board.thickness, hole)
    deep = numerics.layers - numerics.patch_layers
    lower, middle = extrude(bottom, deep * layer, deep)
    upper, top = extrude(middle, numerics.patch_layers * layer, numerics.patch_layers)
    inside = _selection(*in_patch(plan, package))
    patch = {block: tags for block, tags in upper.items() if block in inside}
    rest = {block: tags for block, tags in upper.items() if block not in inside}
    parts = {"board": _flat(lower) + _flat(rest), "board_patch": _flat(patch), "board_bottom": _flat(bottom)}
    footprint = _selection(*under_package(plan, package))
    seat = {block: tags for block, tags in top.items() if block in footprint}
    if package.copper.layout == "plate":
        plate, seat = extrude(seat, package.copper.thickness, 1)
        parts["copper_board"] = _flat(plate)
    return parts | {"board_side": _flat(seat)}


def _package_parts(package: Package, board: Board, board_parts: dict[str, list[int]]) -> dict[str, list[int]]:
    """Extrude copper plate (if any), substrate and die upwards from the package's underside."""
    plan, copper = package_plan(package, board), package.copper
    plate = copper.layout == "plate"
    underside = plan_surfaces(plan, package.standoff + (1 if plate else 2) * copper.thickness)
    parts = {"package_side": _flat(underside)}
    seat = underside
    if plate:
        volumes, seat = extrude(seat, copper.thickness, 1)
        parts["copper_package"] = _flat(volumes)
    volumes, top = extrude(seat, package.substrate.thickness, package.substrate.elements)
    parts["substrate"] = _flat(volumes)
    under_die = _selection(*_die_intervals(plan, package))
    volumes, _ = extrude(
        {block: tags for block, tags in top.items() if block in under_die}, package.die.thickness, package.die.elements
    )
    return parts | {"die": _flat(volumes)}


def _die_intervals(plan: Plan, package: Package) -> tuple[set[int], set[int]]:
    return tuple(
        {index for index, part in enumerate(axis) if max(abs(part.start), abs(part.end)) <= 0.5 * size * (1 + 1e-9)}
        for axis, size in zip((plan.x, plan.y), (package.die.length, package.die.width), strict=True)
    )  # type: ignore[return-value]


def _planes_and_holes(board: Board) -> dict[str, list[int]]:
    """Find symmetry planes and hole walls by where the surfaces lie."""
    names: dict[str, list[int]] = {"mounting_holes": []}
    if board.symmetry == "quarter":
        names |= {"symmetry_x": [], "symmetry_y": []}
    holes, radius = board.holes, 0.5 * board.holes.diameter / MILLI
    centre = (0.5 * board.length - holes.inset_x) / MILLI, (0.5 * board.width - holes.inset_y) / MILLI
    for _, tag in gmsh.model.getEntities(2):
        x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(2, tag)
        off_centre = max(abs(abs(value) - c) for value, c in ((x0, centre[0]), (x1, centre[0]), (y0, centre[1]), (y1, centre[1])))
        if board.symmetry == "quarter" and max(abs(x0), abs(x1)) < TOLERANCE:
            names["symmetry_x"].append(tag)
        elif board.symmetry == "quarter" and max(abs(y0), abs(y1)) < TOLERANCE:
            names["symmetry_y"].append(tag)
        elif off_centre <= radius + TOLERANCE:
            names["mounting_holes"].append(tag)
    return names


def _lift_package(package: Package, warpage: Warpage, volumes: list[int]) -> None:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = dict(zip(tags, coordinates.reshape(-1, 3), strict=True))
    of_package: set[int] = set()
    for volume in volumes:
        of_package.update(gmsh.model.mesh.getNodes(3, volume, includeBoundary=True)[0])
    for tag in of_package:
        x, y, z = points[tag]
        gmsh.model.mesh.setNode(tag, [x, y, z + lift(package, warpage, x * MILLI, y * MILLI) / MILLI], [])


def _check_elements() -> None:
    tags = np.concatenate(list(gmsh.model.mesh.getElements(3)[1]))
    worst = gmsh.model.mesh.getElementQualities(tags, "minSJ").min()
    if worst <= 0.0:
        raise ValueError(f"assembly: smallest scaled Jacobian {worst:.3g}, allowed > 0")


def _selection(columns: set[int], rows: set[int]) -> set[tuple[int, int]]:
    return {(i, j) for i in columns for j in rows}


def _flat(surfaces: Surfaces) -> list[int]:
    return list(chain.from_iterable(surfaces.values()))


def _count(volume: int) -> int:
    return sum(len(tags) for tags in gmsh.model.mesh.getElements(3, volume)[1])


def _name(dimension: int, groups: dict[str, list[int]]) -> None:
    for name, tags in groups.items():
        gmsh.model.addPhysicalGroup(dimension, tags, name=name)


def _write(path: Path) -> None:
    gmsh.option.setNumber("Mesh.ScalingFactor", MILLI)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(str(path))


@contextmanager
def _gmsh_model(name: str):
    """A fresh, silent Gmsh session that is closed whatever happens."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(name)
        yield
    finally:
        gmsh.finalize()
