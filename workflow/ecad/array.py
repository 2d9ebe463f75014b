"""The ball grid array among the pads of a component: rows, columns, pitch, which joints are missing, how it lies."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from reflowshock.meshing.board.pads import joint_name
from reflowshock.workflow.ecad.layout import Component, EcadError, EcadPad, Hole, Layout, Point, in_mm

OFF_GRID = 0.02  # of the pitch: how far a pad may lie from its place
ALIKE = 1e-6  # m: diameters that differ by more are not alike
LARGEST = 100  # rows or columns


@dataclass(frozen=True, slots=True)
class Array:
    """Joints of a component in the frame in which A1 is top left, with its centre as the origin.

    Attributes:
        rows, columns: of the whole array.
        pitch: between rows and between columns [m].
        depopulated: names of the joints that are missing.
        diameter: of the copper pads [m].
        mask_opening: of the solder mask [m]; none where the file does not say.
        turns: quarter turns (counterclockwise) from the board's frame to that of the array.
        is_named: whether the pins have the names of the joints.
    """

    rows: int
    columns: int
    pitch: float
    depopulated: tuple[str, ...]
    diameter: float
    mask_opening: float | None
    turns: int
    is_named: bool


def array_of(component: Component, path: Path) -> Array:
    """Find the array of a component.

    Raises:
        EcadError: its pads are not on a square grid along the board's axes, or differ.
    """
    pads, name = component.pads, component.reference
    if len(pads) < 4:
        raise EcadError(path, f"{name} has {len(pads)} pads, which is no array of solder balls")
    sizes = [pad.diameter for pad in pads]
    if max(sizes) - min(sizes) > ALIKE:
        raise EcadError(
            path, f"{name} has pads of {in_mm(min(sizes))} to {in_mm(max(sizes))}; those of an array are alike"
        )
    pitch = _pitch(pads)
    columns, rows = (_count([pad.at[axis] for pad in pads], pitch) for axis in (0, 1))
    if max(rows, columns) > LARGEST or min(rows, columns) < 2:
        raise EcadError(path, f"{name} is no array: {rows} x {columns} pads at {in_mm(pitch)}")
    places = {_place(pad, component.centre, (rows, columns), pitch): pad for pad in pads}
    worst = max(
        math.dist(pad.at, _point(place, component.centre, (rows, columns), pitch)) for place, pad in places.items()
    )
    if worst > OFF_GRID * pitch or len(places) < len(pads):
        raise EcadError(
            path, f"{name} has pads beside a grid of {in_mm(pitch)}, by up to {in_mm(worst)}; an array lies on one"
        )
    turns = _turns(places, (rows, columns))
    is_named, turns = turns is not None, turns or 0
    sides = (rows, columns) if turns % 2 == 0 else (columns, rows)
    taken = {_turned(place, (rows, columns), turns) for place in places}
    missing = [(row, column) for row in range(sides[0]) for column in range(sides[1]) if (row, column) not in taken]
    openings = [pad.mask_opening for pad in pads if pad.mask_opening is not None]
    return Array(
        *sides, pitch, tuple(joint_name(*place) for place in missing), sizes[0],
        openings[0] if openings else None, turns, is_named,
    )  # fmt: skip


def seen_from(layout: Layout, component: Component, turns: int = 0) -> Layout:
    """Return the board in the frame of a component: its centre is the origin, a component below is seen from below.

    Args:
        layout: the board.
        component: one of its components.
        turns: quarter turns, counterclockwise, of the board.
    """
    origin, flip = component.centre, -1.0 if component.side == "bottom" else 1.0
    c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[turns % 4]

    def moved(point: Point) -> Point:
        x, y = flip * (point[0] - origin[0]), point[1] - origin[1]
        return c * x - s * y, s * x + c * y

    def body_of(body: Point | None) -> Point | None:
        return body if body is None or turns % 2 == 0 else (body[1], body[0])

    corners = [moved(layout.low), moved(layout.high)]
    components = {
        name: replace(
            item,
            pads=tuple(replace(pad, at=moved(pad.at)) for pad in item.pads),
            body=body_of(item.body),
            side=item.side if flip > 0 else {"top": "bottom", "bottom": "top"}[item.side],
        )
        for name, item in layout.components.items()
    }
    return replace(
        layout,
        low=(min(x for x, _ in corners), min(y for _, y in corners)),
        high=(max(x for x, _ in corners), max(y for _, y in corners)),
        holes=tuple(Hole(moved(hole.at), hole.diameter) for hole in layout.holes),
        components=components,
    )


def _pitch(pads: tuple[EcadPad, ...]) -> float:
    """Return the smallest distance of two pads [m]: neighbours of a grid; of places along x or y, not across."""
    steps = []
    for axis in (0, 1):
        places = sorted(pad.at[axis] for pad in pads)
        steps += [b - a for a, b in pairwise(places) if b - a > ALIKE]
    return min(steps, default=0.0)


def _count(places: list[float], pitch: float) -> int:
    return round((max(places) - min(places)) / pitch) + 1 if pitch > 0.0 else 1


def _place(pad: EcadPad, centre: Point, sides: tuple[int, int], pitch: float) -> tuple[int, int]:
    """Return row and column of a pad, from the top left."""
    row = 0.5 * (sides[0] - 1) - (pad.at[1] - centre[1]) / pitch
    column = 0.5 * (sides[1] - 1) + (pad.at[0] - centre[0]) / pitch
    return round(row), round(column)


def _point(place: tuple[int, int], centre: Point, sides: tuple[int, int], pitch: float) -> Point:
    x = centre[0] + (place[1] - 0.5 * (sides[1] - 1)) * pitch
    return x, centre[1] - (place[0] - 0.5 * (sides[0] - 1)) * pitch


def _turned(place: tuple[int, int], sides: tuple[int, int], turns: int) -> tuple[int, int]:
    """Return row and column after quarter turns, counterclockwise, of the whole array."""
    row, column = place
    rows, columns = sides
    for _ in range(turns % 4):
        row, column = columns - 1 - column, row
        rows, columns = columns, rows
    return row, column


def _turns(places: dict[tuple[int, int], EcadPad], sides: tuple[int, int]) -> int | None:
    """Return the quarter turns after which every pin has the name of its place; none where no turn does that."""
    for turns in range(4):
        if all(joint_name(*_turned(place, sides, turns)) == pad.name.upper() for place, pad in places.items()):
            return turns
    return None
