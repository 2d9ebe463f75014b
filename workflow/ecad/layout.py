"""What an ECAD file says of a board, in metres, seen from above: x to the right, y up. Every reader returns this."""

import math
from dataclasses import dataclass
from pathlib import Path

from reflowshock.units import from_si

LARGEST_FILE = 200_000_000  # bytes
MOST_ITEMS = 200_000  # pads, holes or lines of an outline
MILLI = 1.0e-3
SMALLEST, SMALLEST_THICKNESS = 1.0e-3, 1.0e-5  # m: of a board
Point = tuple[float, float]


class EcadError(ValueError):
    """A file is not what it should be, or has not what was asked for."""

    def __init__(self, path: Path, message: str) -> None:
        """Name the file first."""
        super().__init__(f"{path}: {message}")


@dataclass(frozen=True, slots=True)
class EcadPad:
    """A pad of a component: its copper and, where the file knows it, the opening of the solder mask above it.

    Attributes:
        name: of the pin, e.g. A1.
        at: centre.
        diameter: of a circle as large as the copper.
        mask_opening: the same of the opening; none where the file does not say.
    """

    name: str
    at: Point
    diameter: float
    mask_opening: float | None = None


@dataclass(frozen=True, slots=True)
class Component:
    """A component: reference, value, side ("top" or "bottom"), pads, length and width of its body, if it is known."""

    reference: str
    value: str
    side: str
    pads: tuple[EcadPad, ...]
    body: Point | None = None

    @property
    def centre(self) -> Point:
        """Middle of the box around its pads."""
        (x0, y0), (x1, y1) = box_around([pad.at for pad in self.pads])
        return 0.5 * (x0 + x1), 0.5 * (y0 + y1)


@dataclass(frozen=True, slots=True)
class Hole:
    """A drilled hole."""

    at: Point
    diameter: float


@dataclass(frozen=True, slots=True)
class Layout:
    """A board.

    Attributes:
        path: the file, or the folder.
        low, high: corners of the box around its outline.
        thickness: of the board; none where the file does not say.
        holes: all but those of vias.
        components: by reference; those without one are ``_1``, ``_2`` and so on.
        notes: what of the file cannot be kept, in words.
    """

    path: Path
    low: Point
    high: Point
    thickness: float | None
    holes: tuple[Hole, ...]
    components: dict[str, Component]
    notes: tuple[str, ...] = ()


def in_mm(length: float, digits: int = 10) -> str:
    """Write a length [m] in millimetres."""
    return from_si(length, "mm", digits)


def checked_size(path: Path) -> Path:
    """Return the path of a file that can be read and is not too large; raise EcadError."""
    if not path.is_file():
        raise EcadError(path, "there is no such file")
    if path.stat().st_size > LARGEST_FILE:
        raise EcadError(path, f"is larger than {LARGEST_FILE / 1e6:.0f} MB")
    return path


def checked_layout(layout: Layout) -> Layout:
    """Return a layout that can be a board; raise EcadError where a size of it is not positive."""
    sides = [high - low for low, high in zip(layout.low, layout.high, strict=True)]
    if min(sides) < SMALLEST:
        raise EcadError(
            layout.path, f"has an outline of {in_mm(sides[0], 4)} x {in_mm(sides[1], 4)}, which is no board"
        )
    if layout.thickness is not None and not layout.thickness >= SMALLEST_THICKNESS:
        raise EcadError(layout.path, f"says that the board is {in_mm(layout.thickness, 4)} thick, which cannot be")
    for name, component in layout.components.items():
        sizes = [size for pad in component.pads for size in (pad.diameter, pad.mask_opening) if size is not None]
        if not all(size > 0.0 for size in sizes):
            raise EcadError(layout.path, f"has a pad of {name} with a size that is not positive")
    return layout


def text_of(path: Path) -> str:
    """Return the text of a file; raise EcadError."""
    try:
        return checked_size(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise EcadError(path, f"cannot be read as text: {error}") from error


def checked_number(path: Path, what: str, text: object, largest: float = 10.0) -> float:
    """Return a finite number whose magnitude is at most ``largest``; raise EcadError."""
    try:
        value = float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise EcadError(path, f"{what} is {str(text)[:40]!r}, which is no number") from None
    if not abs(value) <= largest:  # also nan
        raise EcadError(path, f"{what} is {value:g}, allowed: up to {largest:g} in magnitude")
    return value


def box_around(points: list[Point]) -> tuple[Point, Point]:
    """Return the lowest and the highest corner of a box around points."""
    xs, ys = zip(*points, strict=True)
    return (min(xs), min(ys)), (max(xs), max(ys))


def round_diameter(shape: str, width: float, height: float) -> float:
    """Return the diameter of a circle as large as a shape: circle, oval or, for anything else, rectangle."""
    if shape == "circle":
        return width
    if shape == "oval":
        short, long = sorted((width, height))
        return 2.0 * math.sqrt((0.25 * math.pi * short**2 + short * (long - short)) / math.pi)
    return 2.0 * math.sqrt(width * height / math.pi)


def arc_about(centre: Point, start: Point, end: Point, clockwise: bool, pieces: int = 64) -> list[Point]:
    """Return points of an arc, a whole circle where it ends at its start; x to the right, y up."""
    (x, y), radius = centre, math.dist(centre, start)
    first, last = (math.atan2(b - y, a - x) for a, b in (start, end))
    sweep = (first - last if clockwise else last - first) % math.tau or math.tau
    angles = (first + (-sweep if clockwise else sweep) * k / pieces for k in range(pieces + 1))
    return [(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles]


def outline_notes(points: list[Point], straight: bool) -> tuple[str, ...]:
    """Say that an outline is not the box around it, where it has other corners or curves."""
    (x0, y0), (x1, y1) = box_around(points)
    margin = 1e-6 + 1e-6 * max(x1 - x0, y1 - y0)
    on_corners = all(
        min(abs(x - x0), abs(x - x1)) < margin and min(abs(y - y0), abs(y - y1)) < margin for x, y in points
    )
    return () if straight and on_corners else ("the outline is not a rectangle: the box around it is taken",)


def named(components: list[Component], path: Path) -> dict[str, Component]:
    """Return components by reference; several of one reference, or of none, get a number."""
    if sum(len(component.pads) for component in components) > MOST_ITEMS:
        raise EcadError(path, f"has more than {MOST_ITEMS} pads")
    found: dict[str, Component] = {}
    for component in components:
        name, count = component.reference, 1
        while not name or name in found:
            name, count = f"{component.reference}_{count}", count + 1
        found[name] = component
    return found
