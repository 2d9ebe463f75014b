"""Case file of a component on a board: data of the layout, and values marked ASSUMED where the layout has none."""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment, StrictUndefined, Template

from reflowshock.meshing.board.checks import LEAST_ROOM, problems
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.units import from_si
from reflowshock.workflow.ecad.array import Array, component_view, detect_array
from reflowshock.workflow.ecad.board_features import board_table, lumped_masses, mounting_holes
from reflowshock.workflow.ecad.layout import Component, EcadError, Layout, in_mm

BALL_RATIO = 0.6  # nominal ball diameter over pitch (0.6 mm at 1 mm, 0.5 mm at 0.8 mm; JEDEC design guide 4.5)
PAD_RATIO = 1.2  # copper over mask opening of a package pad
DIE_RATIO = 0.6  # die over substrate length
MIN_HOLE = 2.0e-3  # m: smallest diameter of mounting holes


@dataclass(frozen=True, slots=True)
class CaseRequest:
    """Choices of a user for a case written from a board.

    Attributes:
        name: Name of the case.
        component: Reference of the component whose joints are computed.
        thickness: Thickness of the board where its file gives none [m].
        ball: Diameter of a solder ball before reflow [m]; None for 0.6 times the pitch.
        min_hole: Smallest diameter of a mounting hole [m].
        condition: Service condition of JESD22-B110B; None for the default.
        title: Title of the case; None for one made of component and file.
    """

    name: str
    component: str
    thickness: float | None = None
    ball: float | None = None
    min_hole: float = MIN_HOLE
    condition: str | None = None
    title: str | None = None


def case_text(layout: Layout, request: CaseRequest) -> str:
    """Return the text of a case file for one component of a board.

    Args:
        layout: Board as its file describes it.
        request: Component, and values that the file does not give.

    Raises:
        EcadError: The pads form no array, or the board has no thickness or no mounting holes.
    """
    component = layout.components[request.component]
    array = detect_array(component, layout.path)
    board = component_view(layout, component, array.turns)
    thickness = layout.thickness or request.thickness
    if thickness is None:
        raise EcadError(layout.path, "the thickness of the board is missing; try --thickness '1.6 mm'")
    package = _package(array, board.components[request.component], request)
    holes, notes = mounting_holes(board, package, thickness, request.min_hole)
    masses, left_out = lumped_masses(board, request.component, thickness)
    table = board_table(board, thickness, holes)
    if not masses and not problems(package, Board.model_validate(table | {"symmetry": "quarter"}), Warpage()):
        table["symmetry"] = "quarter"
    ball = request.ball or BALL_RATIO * array.pitch
    return _template().render(
        request=request,
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
    environment.filters |= {"mm": in_mm, "plain_text": plain_text}
    return environment.from_string((Path(__file__).parent / "templates/case.toml").read_text(encoding="utf-8"))


def _package(array: Array, component: Component, request: CaseRequest) -> Package:
    """Return the package parameters: array and pads as measured, the other dimensions assumed."""
    opening = array.mask_opening or array.diameter
    wetted = min(array.diameter, opening)
    pad = max(array.diameter, PAD_RATIO * wetted)
    arrays = [(count - 1) * array.pitch for count in (array.columns, array.rows)]
    body = component.body or [side + array.pitch for side in arrays]
    length, width = (max(size, side + pad) for size, side in zip(body, arrays, strict=True))
    column = min(array.pitch, length - arrays[0], width - arrays[1])
    imprint = {"size": column} if column < (1.0 - 1e-6) * array.pitch else {}  # else it follows the pitch
    smd = opening < array.diameter
    if not smd and opening <= array.diameter * (1.0 + 1e-6):
        opening = 1.2 * array.diameter
    volume = math.pi / 6.0 * (request.ball or BALL_RATIO * array.pitch) ** 3
    return Package.model_validate(
        {
            "rows": array.rows, "columns": array.columns, "pitch": array.pitch, "depopulated": array.depopulated,
            "standoff": standoff(volume, 0.5 * wetted),
            "board_pad": {"definition": "SMD" if smd else "NSMD", "diameter": array.diameter, "mask_opening": opening},
            "package_pad": {"definition": "SMD", "diameter": PAD_RATIO * wetted, "mask_opening": wetted},
            "substrate": {"length": length, "width": width, "thickness": 4e-4},
            "die": {"length": DIE_RATIO * length, "width": DIE_RATIO * width, "thickness": 4e-4},
            "numerics": {"element_size": 0.25 * array.pitch},
            "imprint": imprint if column > LEAST_ROOM * pad else None,
        }
    )  # fmt: skip


def standoff(volume: float, radius: float) -> float:
    """Return the height of a truncated sphere between two equal discs [m].

    Solves V = pi H (6 a^2 + H^2) / 6. No axial force acts on a joint of this height.

    Args:
        volume: Volume of the solder V [m^3].
        radius: Radius of the discs a [m].
    """
    roots = np.roots([1.0, 0.0, 6.0 * radius**2, -6.0 * volume / math.pi])
    return float(roots[np.argmin(np.abs(roots.imag))].real)


def plain_text(text: str) -> str:
    """Return text with every character replaced that could end a TOML comment or string, at most 400 characters."""
    return re.sub(r"[^\w .,:;()+\-/%°µ×]", "_", text)[:400]
