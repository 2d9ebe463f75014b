"""Assembly of board and package: structured hexahedra with named parts and facet sets in one Gmsh file.

The assembly is flat, as drawn; ``displaced_assembly.py`` moves the package to its position after reflow. Joints are
meshed separately after reflow and tied to ``board_side`` and ``package_side``.
"""

from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import gmsh

from reflowshock.meshing.board.blocks import (
    MILLI,
    TOLERANCE,
    Block,
    RoundHole,
    Surfaces,
    check_elements,
    count_elements,
    extrude,
    lies_within_hole,
    plan_surfaces,
)
from reflowshock.meshing.board.package_side import underside
from reflowshock.meshing.board.parameters import Board, Package
from reflowshock.meshing.board.plan import blocks_within, board_plan, footprint, hole_rings, package_plan, patch
from reflowshock.meshing.core.gmsh_session import gmsh_model, name_groups, write_msh

COARSE = 2.0  # thicknesses of the board


def write_assembly(package: Package, board: Board, path: Path) -> dict[str, int]:
    """Mesh board and package, both flat and without joints, and write them to one file, MSH 4.1 in metres.

    Args:
        package: Array, pads and layers of the package.
        board: Sizes, holes and symmetry of the board.
        path: The ``.msh`` file to write.

    Returns:
        Part name -> number of hexahedra.

    Raises:
        ValueError: An element is inverted.
    """
    with gmsh_model("assembly"):
        parts = _board_parts(package, board)
        parts |= _package_parts(package, board)
        gmsh.model.geo.synchronize()
        facets = {name: tags for name, tags in parts.items() if name.endswith("_side") or name == "board_bottom"}
        volumes = {name: tags for name, tags in parts.items() if name not in facets}
        facets |= _planes_and_holes(board)
        name_groups(3, volumes)
        name_groups(2, facets)
        gmsh.model.mesh.generate(3)
        check_elements("assembly")
        write_msh(path, MILLI)
        return {name: count_elements(tags) for name, tags in volumes.items()}


def _board_parts(package: Package, board: Board) -> dict[str, list[int]]:
    """Extrude the board from its lower face; its uppermost layers around the package form the meso model's patch."""
    plan, numerics = board_plan(package, board), board.numerics
    hole = RoundHole(0.5 * board.holes.diameter, hole_rings(board))
    layer = board.thickness / numerics.layers
    bottom = plan_surfaces(plan, -board.thickness, hole)
    deep = numerics.layers - numerics.patch_layers
    lower, middle = extrude(bottom, deep * layer, deep)
    upper, top = extrude(middle, numerics.patch_layers * layer, numerics.patch_layers)
    meso = patch(plan, package)
    rest = _select(upper, upper.keys() - meso)
    parts = {
        "board": _flat(lower) + _flat(rest),
        "board_patch": _flat(_select(upper, meso)),
        "board_bottom": _flat(bottom),
    }
    seat = _select(top, footprint(plan, package))
    if package.copper.layout == "plate":
        plate, seat = extrude(seat, package.copper.thickness, 1)
        parts["copper_board"] = _flat(plate)
    return parts | {"board_side": _flat(seat)}


def _package_parts(package: Package, board: Board) -> dict[str, list[int]]:
    """Extrude copper plate (if any), substrate and die upwards from the package's underside."""
    plan, copper = package_plan(package, board), package.copper
    faces = plan_surfaces(plan, underside(package))
    parts = {"package_side": _flat(faces)}
    seat = faces
    if copper.layout == "plate":
        volumes, seat = extrude(seat, copper.thickness, 1)
        parts["copper_package"] = _flat(volumes)
    volumes, top = extrude(seat, package.substrate.thickness, package.substrate.elements)
    parts["substrate"] = _flat(volumes)
    under_die = _select(top, blocks_within(plan, package.die.length, package.die.width))
    volumes, _ = extrude(under_die, package.die.thickness, package.die.elements)
    return parts | {"die": _flat(volumes)}


def _planes_and_holes(board: Board) -> dict[str, list[int]]:
    """Find symmetry planes and hole walls by the positions of the surfaces."""
    names: dict[str, list[int]] = {"mounting_holes": []}
    if board.symmetry == "quarter":
        names |= {"symmetry_x": [], "symmetry_y": []}
    for _, tag in gmsh.model.getEntities(2):
        x0, y0, _, x1, y1, _ = (value * MILLI for value in gmsh.model.getBoundingBox(2, tag))
        if board.symmetry == "quarter" and max(abs(x0), abs(x1)) < TOLERANCE:
            names["symmetry_x"].append(tag)
        elif board.symmetry == "quarter" and max(abs(y0), abs(y1)) < TOLERANCE:
            names["symmetry_y"].append(tag)
        elif lies_within_hole(tag, board.hole_places, board.holes.diameter):
            names["mounting_holes"].append(tag)
    return names


def _select(surfaces: Surfaces, blocks: Iterable[Block]) -> Surfaces:
    return {block: surfaces[block] for block in sorted(blocks)}


def _flat(surfaces: Surfaces) -> list[int]:
    return list(chain.from_iterable(surfaces.values()))


def write_heated_assembly(package: Package, board: Board, path: Path) -> dict[str, int]:
    """Mesh board and package for a reflow simulation: MSH 4.1 in metres, both flat, with a coarser board.

    A shock needs up to a hundred thousand board elements to resolve waves; a reflow only needs the motion of the pads.
    With two layers, and coarse cells away from the package, the gaps of hu_bga_drop differ by a tenth of a nanometre
    from the gaps with its board for the shock (0.5 mm everywhere, six layers), with a twentieth of the equations.

    Args:
        package: Array, pads and layers of the package.
        board: Board as for the shock; its numbers of layers and coarse cells are replaced.
        path: The ``.msh`` file to write.

    Returns:
        Part name -> number of hexahedra.

    Raises:
        ValueError: An element is inverted.
    """
    coarse = max(board.numerics.coarse_size, COARSE * board.thickness)
    numerics = board.numerics.model_copy(update={"layers": 2, "patch_layers": 1, "coarse_size": coarse})
    return write_assembly(package, board.model_copy(update={"numerics": numerics}), path)
