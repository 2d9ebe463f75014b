"""Detection of a ball grid array in the pads of a component: rows, columns, pitch, orientation, depopulated joints."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from reflowshock.meshing.board.pads import joint_name
from reflowshock.workflow.ecad.layout import Component, EcadError, EcadPad, Hole, Layout, Point, in_mm

GRID_TOLERANCE = 0.02  # largest distance of a pad from its grid point, as a fraction of the pitch
SIZE_TOLERANCE = 1e-6  # m: largest difference between diameters that count as equal
MAX_COUNT = 100  # rows or columns


@dataclass(frozen=True, slots=True)
class Array:
    """Ball grid array of a component, in a frame centred on the component with A1 at the top left.

    Attributes:
        rows: Number of rows of the full grid.
        columns: Number of columns of the full grid.
        pitch: Distance between neighbouring rows and columns [m].
        depopulated: Names of the missing joints.
        diameter: Diameter of the copper pads [m].
        mask_opening: Diameter of the solder mask openings [m]; None if the file does not give it.
        turns: Counterclockwise quarter turns from the board's frame to the array's frame.
        is_named: Whether the pin names are the JEDEC names of the joints.
    """

    rows: int
    columns: int
    pitch: float
    depopulated: tuple[str, ...]
    diameter: float
    mask_opening: float | None
    turns: int
    is_named: bool


def detect_array(component: Component, path: Path) -> Array:
    """Return the ball grid array that the pads of a component form.

    Args:
        component: Component to inspect.
        path: File of the board, for messages.

    Returns:
        Numbers of rows and columns, pitch [m], names of missing joints, diameters of pads and mask openings [m], and
        quarter turns from the board's frame to the frame of the array.

    Raises:
        EcadError: The pads differ in size or do not lie on a square grid along the board's axes.
    """
    pads, name = component.pads, component.reference
    if len(pads) < 4:
        raise EcadError(path, f"{name} has {len(pads)} pads; an array of solder balls has at least 4")
    sizes = [pad.diameter for pad in pads]
    if max(sizes) - min(sizes) > SIZE_TOLERANCE:
        raise EcadError(
            path, f"{name} has pads of {in_mm(min(sizes))} to {in_mm(max(sizes))}; all pads of an array have one size"
        )
    pitch = _pitch(pads)
    columns, rows = (_count([pad.at[axis] for pad in pads], pitch) for axis in (0, 1))
    if max(rows, columns) > MAX_COUNT or min(rows, columns) < 2:
        raise EcadError(path, f"{name} is not an array: {rows} x {columns} pads at {in_mm(pitch)}")
    pads_by_index = {_grid_index(pad, component.centre, (rows, columns), pitch): pad for pad in pads}
    largest_offset = max(
        math.dist(pad.at, _grid_point(index, component.centre, (rows, columns), pitch))
        for index, pad in pads_by_index.items()
    )
    if largest_offset > GRID_TOLERANCE * pitch or len(pads_by_index) < len(pads):
        raise EcadError(
            path, f"{name} has pads up to {in_mm(largest_offset)} off a square grid with a pitch of {in_mm(pitch)}"
        )
    turns = _quarter_turns(pads_by_index, (rows, columns))
    is_named, turns = turns is not None, turns or 0
    sides = (rows, columns) if turns % 2 == 0 else (columns, rows)
    populated = {_rotated_index(index, (rows, columns), turns) for index in pads_by_index}
    missing = [(row, column) for row in range(sides[0]) for column in range(sides[1]) if (row, column) not in populated]
    openings = [pad.mask_opening for pad in pads if pad.mask_opening is not None]
    return Array(
        *sides, pitch, tuple(joint_name(*index) for index in missing), sizes[0],
        openings[0] if openings else None, turns, is_named,
    )  # fmt: skip


def component_view(layout: Layout, component: Component, turns: int = 0) -> Layout:
    """Return a board in the frame of one component, mirrored if the component is on the bottom side.

    Args:
        layout: Board in its own frame.
        component: Component whose centre becomes the origin.
        turns: Counterclockwise quarter turns of the board, 0 to 3.

    Returns:
        Board whose positions are relative to the component.
    """
    origin, flip = component.centre, -1.0 if component.side == "bottom" else 1.0
    c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[turns % 4]

    def to_view(point: Point) -> Point:
        x, y = flip * (point[0] - origin[0]), point[1] - origin[1]
        return c * x - s * y, s * x + c * y

    def rotated_body(body: Point | None) -> Point | None:
        return body if body is None or turns % 2 == 0 else (body[1], body[0])

    corners = [to_view(layout.low), to_view(layout.high)]
    components = {
        name: replace(
            item,
            pads=tuple(replace(pad, at=to_view(pad.at)) for pad in item.pads),
            body=rotated_body(item.body),
            side=item.side if flip > 0 else {"top": "bottom", "bottom": "top"}[item.side],
        )
        for name, item in layout.components.items()
    }
    return replace(
        layout,
        low=(min(x for x, _ in corners), min(y for _, y in corners)),
        high=(max(x for x, _ in corners), max(y for _, y in corners)),
        holes=tuple(Hole(to_view(hole.at), hole.diameter) for hole in layout.holes),
        components=components,
    )


def _pitch(pads: tuple[EcadPad, ...]) -> float:
    """Return the smallest distance between two different pad coordinates along x or y [m]."""
    distances = []
    for axis in (0, 1):
        coordinates = sorted(pad.at[axis] for pad in pads)
        distances += [b - a for a, b in pairwise(coordinates) if b - a > SIZE_TOLERANCE]
    return min(distances, default=0.0)


def _count(coordinates: list[float], pitch: float) -> int:
    return round((max(coordinates) - min(coordinates)) / pitch) + 1 if pitch > 0.0 else 1


def _grid_index(pad: EcadPad, centre: Point, sides: tuple[int, int], pitch: float) -> tuple[int, int]:
    """Return row and column of a pad, counted from the top left."""
    row = 0.5 * (sides[0] - 1) - (pad.at[1] - centre[1]) / pitch
    column = 0.5 * (sides[1] - 1) + (pad.at[0] - centre[0]) / pitch
    return round(row), round(column)


def _grid_point(index: tuple[int, int], centre: Point, sides: tuple[int, int], pitch: float) -> Point:
    x = centre[0] + (index[1] - 0.5 * (sides[1] - 1)) * pitch
    return x, centre[1] - (index[0] - 0.5 * (sides[0] - 1)) * pitch


def _rotated_index(index: tuple[int, int], sides: tuple[int, int], turns: int) -> tuple[int, int]:
    """Return row and column after counterclockwise quarter turns of the whole array."""
    row, column = index
    rows, columns = sides
    for _ in range(turns % 4):
        row, column = columns - 1 - column, row
        rows, columns = columns, rows
    return row, column


def _quarter_turns(pads_by_index: dict[tuple[int, int], EcadPad], sides: tuple[int, int]) -> int | None:
    """Return the quarter turns after which every pin has the JEDEC name of its position, or None."""
    for turns in range(4):
        if all(
            joint_name(*_rotated_index(index, sides, turns)) == pad.name.upper() for index, pad in pads_by_index.items()
        ):
            return turns
    return None
