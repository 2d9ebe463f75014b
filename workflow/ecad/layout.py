"""Layout of a board as every ECAD reader returns it, in metres, seen from above with x to the right and y up."""

import math
from dataclasses import dataclass
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.units import from_si
from reflowshock.workflow.case.problems import CaseError

MAX_FILE_SIZE = 200_000_000  # bytes
MAX_ITEMS = 200_000  # pads, holes or lines of an outline
MILLI = 1.0e-3
MIN_SIDE, MIN_THICKNESS = 1.0e-3, 1.0e-5  # m: of a board
Point = tuple[float, float]


class EcadError(CaseError):
    """Error in an ECAD file, or missing data in it."""

    def __init__(self, path: Path, problem: Problem | str) -> None:
        """Take the file and its problem, or a message that concerns the file as a whole."""
        super().__init__(str(path), [Problem("", problem) if isinstance(problem, str) else problem])


@dataclass(frozen=True, slots=True)
class EcadPad:
    """Pad of a component.

    Attributes:
        name: Name of the pin, e.g. A1.
        at: Centre [m].
        diameter: Diameter of a circle with the area of the copper [m].
        mask_opening: Diameter of a circle with the area of the solder mask opening [m]; None if not in the file.
    """

    name: str
    at: Point
    diameter: float
    mask_opening: float | None = None


@dataclass(frozen=True, slots=True)
class Component:
    """Component on a board.

    Attributes:
        reference: Reference designator, e.g. U8.
        value: Value or part name.
        side: Side of the board, "top" or "bottom".
        pads: Pads.
        body: Length and width of the body along the board's axes [m]; None if not in the file.
    """

    reference: str
    value: str
    side: str
    pads: tuple[EcadPad, ...]
    body: Point | None = None

    @property
    def centre(self) -> Point:
        """Centre of the box around the pads [m]."""
        (x0, y0), (x1, y1) = box_around([pad.at for pad in self.pads])
        return 0.5 * (x0 + x1), 0.5 * (y0 + y1)


@dataclass(frozen=True, slots=True)
class Hole:
    """Drilled hole: centre and diameter [m]."""

    at: Point
    diameter: float


@dataclass(frozen=True, slots=True)
class Layout:
    """Board with its holes and components.

    Attributes:
        path: File or folder of the board.
        low: Lower left corner of the box around the outline [m].
        high: Upper right corner of the box around the outline [m].
        thickness: Thickness of the board [m]; None if not in the file.
        holes: All holes except vias.
        components: Components by reference; those without a reference are called ``_1``, ``_2`` and so on.
        notes: Simplifications of the file, for the user.
    """

    path: Path
    low: Point
    high: Point
    thickness: float | None
    holes: tuple[Hole, ...]
    components: dict[str, Component]
    notes: tuple[str, ...] = ()


def in_mm(length: float, digits: int = 10) -> str:
    """Format a length [m] in millimetres, with at most ``digits`` significant digits and the unit."""
    return from_si(length, "mm", digits)


def check_file(path: Path) -> Path:
    """Return the path of a file unchanged if the file exists and has at most ``MAX_FILE_SIZE`` (200 million) bytes.

    Args:
        path: File to check.

    Raises:
        EcadError: The file does not exist or is too large.
    """
    if not path.is_file():
        raise EcadError(path, "no such file")
    if path.stat().st_size > MAX_FILE_SIZE:
        raise EcadError(path, f"is larger than {MAX_FILE_SIZE / 1e6:.0f} MB")
    return path


def check_layout(layout: Layout) -> Layout:
    """Return a layout unchanged if its dimensions are plausible.

    Args:
        layout: Board with outline, holes and components.

    Raises:
        EcadError: A dimension is not positive, or the board is too small.
    """
    sides = [high - low for low, high in zip(layout.low, layout.high, strict=True)]
    if min(sides) < MIN_SIDE:
        raise EcadError(
            layout.path, f"the outline of {in_mm(sides[0], 4)} x {in_mm(sides[1], 4)} is too small for a board"
        )
    if layout.thickness is not None and not layout.thickness >= MIN_THICKNESS:
        raise EcadError(
            layout.path, f"thickness of {in_mm(layout.thickness, 4)}; allowed: at least {in_mm(MIN_THICKNESS)}"
        )
    for name, component in layout.components.items():
        sizes = [size for pad in component.pads for size in (pad.diameter, pad.mask_opening) if size is not None]
        if not all(size > 0.0 for size in sizes):
            raise EcadError(layout.path, f"the size of a pad of {name} is not positive")
    return layout


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file.

    Raises:
        EcadError: The file does not exist, is too large, or is not UTF-8.
    """
    try:
        return check_file(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise EcadError(path, f"cannot be read as text: {error}") from error


def checked_number(path: Path, what: str, text: object, largest: float = 10.0) -> float:
    """Convert text to a finite number.

    Args:
        path: File, for messages.
        what: Name of the number, for messages.
        text: Text, or number of a parsed file.
        largest: Largest allowed magnitude.

    Raises:
        EcadError: The text is not a number, or the number is too large.
    """
    try:
        value = float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise EcadError(path, f"{what} = {str(text)[:40]!r} is not a number") from None
    if not abs(value) <= largest:  # also nan
        raise EcadError(path, f"{what} = {value:g} is out of range; allowed: up to {largest:g} in magnitude")
    return value


def box_around(points: list[Point]) -> tuple[Point, Point]:
    """Return the lower left and upper right corners (x, y) of the bounding box of points, in their unit."""
    xs, ys = zip(*points, strict=True)
    return (min(xs), min(ys)), (max(xs), max(ys))


def round_diameter(shape: str, width: float, height: float) -> float:
    """Return the diameter of the circle that has the area of a pad or hole, in the unit of its sides.

    Args:
        shape: "circle", "oval", or anything else for a rectangle.
        width: Width of the shape.
        height: Height of the shape, in the unit of the width.
    """
    if shape == "circle":
        return width
    if shape == "oval":
        short, long = sorted((width, height))
        return 2.0 * math.sqrt((0.25 * math.pi * short**2 + short * (long - short)) / math.pi)
    return 2.0 * math.sqrt(width * height / math.pi)


def arc_about(centre: Point, start: Point, end: Point, clockwise: bool, pieces: int = 64) -> list[Point]:
    """Return points along an arc about a centre, equally spaced, ends included.

    Args:
        centre: Centre (x, y); all lengths are in one unit.
        start: First point of the arc.
        end: Last point of the arc; a full circle if it coincides with the first.
        clockwise: Direction of the arc.
        pieces: Number of segments of the arc; one more point is returned.
    """
    (x, y), radius = centre, math.dist(centre, start)
    first, last = (math.atan2(b - y, a - x) for a, b in (start, end))
    sweep = (first - last if clockwise else last - first) % math.tau or math.tau
    angles = (first + (-sweep if clockwise else sweep) * k / pieces for k in range(pieces + 1))
    return [(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles]


def outline_notes(points: list[Point], straight: bool) -> tuple[str, ...]:
    """Return a tuple with one note for the user if an outline is not a rectangle along the axes, else an empty one.

    Args:
        points: Corners (x, y) of the outline [m].
        straight: Whether the outline has no arcs.
    """
    (x0, y0), (x1, y1) = box_around(points)
    margin = 1e-6 + 1e-6 * max(x1 - x0, y1 - y0)
    on_corners = all(
        min(abs(x - x0), abs(x - x1)) < margin and min(abs(y - y0), abs(y - y1)) < margin for x, y in points
    )
    return () if straight and on_corners else ("the outline is not a rectangle: its bounding box is used",)


def components_by_reference(components: list[Component], path: Path) -> dict[str, Component]:
    """Return components by reference; a number is appended to repeated or empty references.

    Args:
        components: Components in the order of the file.
        path: File of the board, for messages.
    """
    if sum(len(component.pads) for component in components) > MAX_ITEMS:
        raise EcadError(path, f"the board has more than {MAX_ITEMS} pads")
    by_reference: dict[str, Component] = {}
    for component in components:
        name, count = component.reference, 1
        while not name or name in by_reference:
            name, count = f"{component.reference}_{count}", count + 1
        by_reference[name] = component
    return by_reference
