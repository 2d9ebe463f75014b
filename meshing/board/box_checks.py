"""Boxes that cannot be meshed: names, holes, symmetry. Pure Python."""

import re
from collections.abc import Iterator

from reflowshock.meshing.board.box_plan import Box
from reflowshock.meshing.board.checks import SMALLEST_INSET, Problem

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
FACETS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max", "mounting_holes")


def box_problems(box: Box) -> list[Problem]:
    """Find what cannot be built, before anything is meshed; keys are those of the table ``structure``."""
    return [*_layers(box), *_stacks(box), *_holes(box)]


def _layers(box: Box) -> Iterator[Problem]:
    for layer in box.layers:
        if NAME.fullmatch(layer.name) is None or layer.name in FACETS:
            allowed = f"letters, digits and _, a letter first; none of {', '.join(FACETS)}"
            yield Problem(f"structure.layers.{layer.name}", layer.name, allowed, "is not a valid name of a layer")


def _stacks(box: Box) -> Iterator[Problem]:
    """Layers whose elements do not match are tied: quadrilaterals on planes, outlines alike."""
    for stack in box.stacks[1:]:
        layer = stack.layers[0]
        key = next(
            f"structure.layers.{one.name}.in_plane"
            for one in (layer, *reversed(box.layers))
            if one.in_plane is not None
        )
        if box.element != "hexahedron":
            message = f"layers of different in_plane are tied, which needs hexahedra, the element is {box.element}"
            yield Problem(key, str(list(stack.cells)), "structure.element = hexahedron, or the same in_plane", message)
        if box.holes is not None:
            message = "the outlines of holes do not match between layers of different in_plane"
            yield Problem(key, str(list(stack.cells)), "no structure.holes, or the same in_plane", message)


def _holes(box: Box) -> Iterator[Problem]:
    """Holes lie inside the box, those of a pair apart."""
    if box.holes is None:
        return
    diameter = box.holes.diameter
    for size, spacing in zip(box.size, box.holes.spacing, strict=True):
        smallest, largest = 2.0 * diameter, size - 2.0 * SMALLEST_INSET * diameter
        if not smallest <= spacing <= largest:
            allowed = f"{1e3 * smallest:.4g} mm to {1e3 * largest:.4g} mm"
            message = "mounting holes reach beyond the box or into each other"
            yield Problem("structure.holes.spacing", f"{1e3 * spacing:.4g} mm", allowed, message)
