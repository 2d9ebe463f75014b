"""A case file from a board's layout: what the layout knows as it is, what it cannot know assumed, and marked so."""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment, StrictUndefined, Template

from reflowshock.meshing.board.checks import LEAST_ROOM, problems
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.units import from_si
from reflowshock.workflow.ecad.array import Array, array_of, seen_from
from reflowshock.workflow.ecad.fitted import board_table, masses_of, mounting_holes
from reflowshock.workflow.ecad.layout import Component, EcadError, Layout, in_mm

BALL = 0.6  # of the pitch: nominal diameter of solder balls (0.6 mm at 1 mm, 0.5 mm at 0.8 mm; JEDEC design guide 4.5)
RIM = 1.2  # copper of a package's pad over its opening
DIE = 0.6  # of the substrate
LEAST_HOLE = 2.0e-3  # m


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the case is to be made of.

    Attributes:
        name: of the case.
        component: its reference, that of the package whose joints are computed.
        thickness: of the board [m], where the file does not say it.
        ball: diameter of a solder ball before reflow [m]; none for what is usual at the pitch.
        least_hole: smallest diameter [m] of holes that are taken for mounting holes.
        condition: service condition of JESD22-B110B; none for what is usual.
        title: of the case; none for that of the file.
    """

    name: str
    component: str
    thickness: float | None = None
    ball: float | None = None
    least_hole: float = LEAST_HOLE
    condition: str | None = None
    title: str | None = None


def case_text(layout: Layout, wanted: Wanted) -> str:
    """Return a case file.

    Args:
        layout: the board.
        wanted: which of its components, and what it does not say.

    Raises:
        EcadError: there is no such component, it is no array, or the board has no thickness or no holes.
    """
    component = layout.components[wanted.component]
    array = array_of(component, layout.path)
    board = seen_from(layout, component, array.turns)
    thickness = layout.thickness or wanted.thickness
    if thickness is None:
        raise EcadError(layout.path, "does not say how thick the board is: give --thickness, e.g. --thickness '1.6 mm'")
    package = _package(array, board.components[wanted.component], wanted)
    holes, notes = mounting_holes(board, package, thickness, wanted.least_hole)
    masses, left_out = masses_of(board, wanted.component, thickness)
    table = board_table(board, thickness, holes)
    if not masses and not problems(package, Board.model_validate(table | {"symmetry": "quarter"}), Warpage()):
        table["symmetry"] = "quarter"
    ball = wanted.ball or BALL * array.pitch
    return _template().render(
        wanted=wanted,
        file=layout.path.name,
        below=component.side == "bottom",
        array=array,
        package=package,
        board=table,
        has_body=component.body is not None,
        masses=masses,
        notes=[*layout.notes, *notes, *left_out],
        ball=ball,
        volume=from_si(math.pi / 6.0 * ball**3, "mm^3", 5),
    )


def _template() -> Template:
    environment = Environment(undefined=StrictUndefined, keep_trailing_newline=True)
    environment.filters |= {"mm": in_mm, "plain": plain}
    return environment.from_string((Path(__file__).parent / "templates/case.toml").read_text(encoding="utf-8"))


def _package(array: Array, component: Component, wanted: Wanted) -> Package:
    """Return the package as far as its pads tell it."""
    opening = array.mask_opening or array.diameter
    wetted = min(array.diameter, opening)
    pad = max(array.diameter, RIM * wetted)
    arrays = [(count - 1) * array.pitch for count in (array.columns, array.rows)]
    body = component.body or [side + array.pitch for side in arrays]
    length, width = (max(size, side + pad) for size, side in zip(body, arrays, strict=True))
    column = min(array.pitch, length - arrays[0], width - arrays[1])
    imprint = {"size": column} if column < (1.0 - 1e-6) * array.pitch else {}  # else it follows the pitch
    smd = opening < array.diameter
    if not smd and opening <= array.diameter * (1.0 + 1e-6):
        opening = 1.2 * array.diameter
    volume = math.pi / 6.0 * (wanted.ball or BALL * array.pitch) ** 3
    return Package.model_validate(
        {
            "rows": array.rows, "columns": array.columns, "pitch": array.pitch, "depopulated": array.depopulated,
            "standoff": standoff(volume, 0.5 * wetted),
            "board_pad": {"definition": "SMD" if smd else "NSMD", "diameter": array.diameter, "mask_opening": opening},
            "package_pad": {"definition": "SMD", "diameter": RIM * wetted, "mask_opening": wetted},
            "substrate": {"length": length, "width": width, "thickness": 4e-4},
            "die": {"length": DIE * length, "width": DIE * width, "thickness": 4e-4},
            "numerics": {"element_size": 0.25 * array.pitch},
            "imprint": imprint if column > LEAST_ROOM * pad else None,
        }
    )  # fmt: skip


def standoff(volume: float, radius: float) -> float:
    """Return the height [m] of a truncated sphere of a volume [m^3] between two discs of a radius [m].

    V = pi H (6 a^2 + H^2) / 6: no force acts along the axis of such a joint.
    """
    roots = np.roots([1.0, 0.0, 6.0 * radius**2, -6.0 * volume / math.pi])
    return float(roots[np.argmin(np.abs(roots.imag))].real)


def plain(text: str) -> str:
    """Return text of a file without what could end a comment or a string."""
    return re.sub(r"[^\w .,:;()+\-/%°µ×]", "_", text)[:400]
