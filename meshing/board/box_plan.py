"""Layered box as data: intervals in plan, element counts without a mesh, and input checks. Pure Python."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from reflowshock.meshing.board.checks import SMALLEST_INSET
from reflowshock.meshing.board.estimate import PartEstimate
from reflowshock.meshing.board.plan import Interval, Plan, blocks_at, uniform
from reflowshock.problem import Problem

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
FACETS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max", "mounting_holes")
ElementKind = Literal["hexahedron", "tetrahedron", "tetrahedron_quadratic"]
TETRAHEDRA = 6  # per box: two prisms of three tetrahedra each
RING_SQUARE = 2.0  # side of the square around a hole that is meshed as an O-grid, in diameters, if it fits
ROOM = 1.6  # the same side, over the distance from the hole's axis to the nearest edge


@dataclass(frozen=True, slots=True)
class BoxLayer:
    """Layer of a box.

    Attributes:
        name: Name of the layer.
        thickness: Thickness [m].
        cells: Number of elements through the thickness.
        in_plane: Number of elements along x and y, if they differ from the box.
    """

    name: str
    thickness: float
    cells: int
    in_plane: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class BoxHoles:
    """Four round holes through all layers, at (+-spacing / 2) [m]."""

    spacing: tuple[float, float]
    diameter: float

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Positions of the hole axes in plan [m]."""
        x, y = (0.5 * spacing for spacing in self.spacing)
        return (-x, -y), (-x, y), (x, -y), (x, y)


@dataclass(frozen=True, slots=True)
class Box:
    """Stack of layers from z = 0 upwards, centred on the z axis; with planes of symmetry, the part at x, y >= 0.

    Attributes:
        size: Length along x and width along y of the whole box [m].
        cells: Numbers of elements along x and y of the meshed part; approximate if there are holes.
        layers: Layers from bottom to top.
        symmetry: Axes normal to planes of symmetry.
        element: Element type.
        holes: Holes, if any.
    """

    size: tuple[float, float]
    cells: tuple[int, int]
    layers: tuple[BoxLayer, ...]
    symmetry: tuple[str, ...] = ()
    element: ElementKind = "hexahedron"
    holes: BoxHoles | None = None

    @property
    def square(self) -> float:
        """Side of the square around a hole [m]."""
        if self.holes is None:
            return 0.0
        insets = [0.5 * (size - spacing) for size, spacing in zip(self.size, self.holes.spacing, strict=True)]
        return min(RING_SQUARE * self.holes.diameter, ROOM * min(insets))

    @property
    def rings(self) -> int:
        """Number of elements between a hole and the edge of its square."""
        if self.holes is None:
            return 0
        meshed = min(self.extent(axis) / self.cells[axis] for axis in (0, 1))
        return max(1, round(0.5 * (self.square - self.holes.diameter) / meshed))

    @property
    def stacks(self) -> tuple["Box", ...]:
        """Stacks of neighbouring layers with matching elements, bottom to top; different stacks share no node."""
        stacks: list[Box] = []
        for layer in self.layers:
            cells = layer.in_plane or self.cells
            if stacks and stacks[-1].cells == cells:
                stacks[-1] = replace(stacks[-1], layers=(*stacks[-1].layers, layer))
            else:
                stacks.append(replace(self, cells=cells, layers=(layer,)))
        return tuple(stacks)

    def is_halved(self, axis: int) -> bool:
        """Return whether the plane normal to an axis (0 or 1) is a plane of symmetry."""
        return "xy"[axis] in self.symmetry

    def extent(self, axis: int) -> float:
        """Return the length of the meshed part along an axis (0 or 1) [m]."""
        return self.size[axis] * (0.5 if self.is_halved(axis) else 1.0)


def box_plan(box: Box) -> Plan:
    """Divide the box along x and y into intervals with equal cells, except for the squares around holes.

    Args:
        box: Sizes, numbers of elements, symmetry and holes; only the meshed part (x, y >= 0 with symmetry) is divided.

    Returns:
        Intervals along x and y, and the blocks (i, j) that contain a hole.
    """
    x, y = _axis(box, 0), _axis(box, 1)
    return Plan(x, y, blocks_at(box.holes.places, x, y) if box.holes else frozenset())


def count_box(box: Box) -> dict[str, PartEstimate]:
    """Count the elements of every layer exactly, and estimate the edge lengths of the smallest element.

    Args:
        box: Sizes, layers, numbers of elements, symmetry and holes.

    Returns:
        Layer name -> number of its elements, and edge lengths along x, y and z of the smallest box [m].
    """
    return {name: part for stack in box.stacks for name, part in _count_stack(stack).items()}


def _count_stack(box: Box) -> dict[str, PartEstimate]:
    plan = box_plan(box)
    cells = sum(part.cells for part in plan.x) * sum(part.cells for part in plan.y)
    for i, j in plan.holes:
        cells += 2 * (plan.x[i].cells + plan.y[j].cells) * box.rings - plan.x[i].cells * plan.y[j].cells
    smallest = [min(part.smallest() for part in axis) for axis in (plan.x, plan.y)]
    if box.holes is not None:
        smallest = [min(length, _smallest_in_ring(box, plan)) for length in smallest]
    each = 1 if box.element == "hexahedron" else TETRAHEDRA
    return {
        layer.name: PartEstimate(each * cells * layer.cells, (smallest[0], smallest[1], layer.thickness / layer.cells))
        for layer in box.layers
    }


def _axis(box: Box, axis: int) -> tuple[Interval, ...]:
    half = 0.5 * box.size[axis]
    if box.holes is None:
        return (Interval(0.0 if box.is_halved(axis) else -half, half, box.cells[axis]),)
    size, hole = box.extent(axis) / box.cells[axis], 0.5 * box.holes.spacing[axis]
    low, high = hole - 0.5 * box.square, hole + 0.5 * box.square
    square = Interval(low, high, max(2, round(box.square / size)))
    positive = (uniform(0.0, low, size), square, uniform(high, half, size))
    return positive if box.is_halved(axis) else (*(part.mirrored() for part in reversed(positive)), *positive)


def _smallest_in_ring(box: Box, plan: Plan) -> float:
    """Return the shortest edge around a hole, radial or along the circle [m]."""
    assert box.holes is not None
    radial = 0.5 * (box.square - box.holes.diameter) / box.rings
    i, j = max(plan.holes)
    around = 2 * (plan.x[i].cells + plan.y[j].cells)
    return min(radial, math.pi * box.holes.diameter / around)


def box_problems(box: Box) -> list[Problem]:
    """Return the input errors of a box before it is meshed; keys refer to the table ``structure`` of a case file.

    Args:
        box: Sizes, layers, numbers of elements, symmetry and holes.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error; empty for a box that can be meshed.
    """
    return [*_layer_problems(box), *_stack_problems(box), *_hole_problems(box)]


def _layer_problems(box: Box) -> Iterator[Problem]:
    for layer in box.layers:
        if NAME.fullmatch(layer.name) is None or layer.name in FACETS:
            allowed = f"letters, digits and _, a letter first; none of {', '.join(FACETS)}"
            yield Problem(f"structure.layers.{layer.name}", "is not a valid name of a layer", layer.name, allowed)


def _stack_problems(box: Box) -> Iterator[Problem]:
    """Check that layers with different elements can be tied: they need quadrilaterals and equal outlines."""
    for stack in box.stacks[1:]:
        layer = stack.layers[0]
        key = next(
            f"structure.layers.{candidate.name}.in_plane"
            for candidate in (layer, *reversed(box.layers))
            if candidate.in_plane is not None
        )
        if box.element != "hexahedron":
            message = f"layers of different in_plane are tied, which needs hexahedra, the element is {box.element}"
            yield Problem(key, message, str(list(stack.cells)), "structure.element = hexahedron, or the same in_plane")
        if box.holes is not None:
            message = "the outlines of holes do not match between layers of different in_plane"
            yield Problem(key, message, str(list(stack.cells)), "no structure.holes, or the same in_plane")


def _hole_problems(box: Box) -> Iterator[Problem]:
    """Check that holes lie inside the box and do not overlap."""
    if box.holes is None:
        return
    diameter = box.holes.diameter
    for size, spacing in zip(box.size, box.holes.spacing, strict=True):
        smallest, largest = 2.0 * diameter, size - 2.0 * SMALLEST_INSET * diameter
        if not smallest <= spacing <= largest:
            allowed = f"{1e3 * smallest:.4g} mm to {1e3 * largest:.4g} mm"
            message = "mounting holes reach beyond the box or into each other"
            yield Problem("structure.holes.spacing", message, f"{1e3 * spacing:.4g} mm", allowed)
