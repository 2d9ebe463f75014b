"""Questions of the command ``init``: five answers become a layout, and the layout a case file, as with ``import``."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from reflowshock.fem.problem.shock import ServiceCondition
from reflowshock.meshing.board.pads import joint_name
from reflowshock.units import UnitError, to_si
from reflowshock.workflow.case.names import NAMES, is_name
from reflowshock.workflow.ecad.case_text import BALL_RATIO, CaseRequest, case_text
from reflowshock.workflow.ecad.layout import Component, EcadPad, Hole, Layout, Point, in_mm

PACKAGE = "U1"
PAD_RATIO = 0.8  # pad diameter over ball diameter (0.48 mm for a ball of 0.6 mm)
MASK_CLEARANCE = 1.0e-4  # m: mask opening minus pad diameter
SCREW, SCREW_INSET = 3.0e-3, 4.0e-3  # m: diameter of a mounting hole, and its distance from the board's edges
JEDEC_BOARD = ((0.132, 0.077), (0.105, 0.071))  # m: board size and screw distances of JESD22-B111
MAX_COUNT = 100


class AnswerError(ValueError):
    """Invalid answer; the message gives the problem and the allowed answers."""


@dataclass(frozen=True, slots=True)
class Question:
    """Question to the user.

    Attributes:
        key: Name of the answer and of its option.
        prompt: Text of the question.
        default: Answer that the user gets by pressing Enter.
        read: Function that converts an answer and raises ``AnswerError`` if it is not valid.
    """

    key: str
    prompt: str
    default: str
    read: Callable[[str], object]


def case_from_answers(answers: dict[str, Any]) -> str:
    """Return the text of a case file from converted answers.

    Args:
        answers: Results of ``Question.read`` by ``Question.key``: ``array`` ((rows, columns), pitch [m]), ``ball`` [m]
            or None, ``board`` (length, width, thickness [m]), ``drop`` (service condition), ``name``.
    """
    (rows, columns), pitch = answers["array"]
    ball, (length, width, thickness) = answers["ball"] or BALL_RATIO * pitch, answers["board"]
    pads = [
        EcadPad(
            joint_name(row, column),
            ((column - 0.5 * (columns - 1)) * pitch, (0.5 * (rows - 1) - row) * pitch),
            PAD_RATIO * ball,
            PAD_RATIO * ball + MASK_CLEARANCE,
        )
        for row in range(rows)
        for column in range(columns)
    ]
    half = (0.5 * length, 0.5 * width)
    holes = tuple(Hole((x, y), SCREW) for x, y in _screws(half))
    component = Component(PACKAGE, "", "top", tuple(pads))
    name = str(answers["name"])
    layout = Layout(Path(name), (-half[0], -half[1]), half, thickness, holes, {PACKAGE: component})
    request = CaseRequest(
        name, PACKAGE, ball=ball, condition=str(answers["drop"]), title=f"{rows} x {columns} BGA at {in_mm(pitch)}"
    )
    return case_text(layout, request)


def _screws(half: Point) -> list[Point]:
    """Return the screw positions of a board, in JESD22-B111 positions if it has that size [m].

    Args:
        half: Half length and half width of the board [m].
    """
    size, distances = JEDEC_BOARD
    if max(abs(2.0 * half[0] - size[0]), abs(2.0 * half[1] - size[1])) < 1e-6:
        x, y = 0.5 * distances[0], 0.5 * distances[1]
    else:
        x, y = half[0] - SCREW_INSET, half[1] - SCREW_INSET
    return [(-x, -y), (-x, y), (x, -y), (x, y)]


def _name(text: str) -> str:
    if not is_name(text):
        raise AnswerError(f"is not a valid name; allowed: {NAMES}")
    return text


def _array(text: str) -> tuple[tuple[int, int], float]:
    match = re.fullmatch(r"\s*(\d+)\s*[x×*]\s*(\d+)\s*(?:at|@|,)\s*(.+)", text)
    if match is None:
        raise AnswerError('is not valid; allowed: rows x columns at pitch, e.g. "6 x 6 at 0.8 mm"')
    sides = int(match[1]), int(match[2])
    if not all(2 <= side <= MAX_COUNT for side in sides):
        raise AnswerError(f"has {sides[0]} x {sides[1]} joints; allowed: 2 x 2 to {MAX_COUNT} x {MAX_COUNT}")
    return sides, _length(match[3], 5e-5, 5e-3)


def _ball(text: str) -> float | None:
    return None if text.strip() in ("", "usual") else _length(text, 2e-5, 3e-3)


def _board(text: str) -> tuple[float, float, float]:
    sizes = re.split(r"\s*[x×*]\s*", text.strip())
    unit = re.sub(r"[-+0-9.eE\s]", "", sizes[-1])
    if len(sizes) != 3:
        raise AnswerError('is not valid; allowed: length x width x thickness, e.g. "132 x 77 x 1 mm"')
    length, width, thickness = (
        _length(size if re.search(r"[a-zµ]", size) else f"{size} {unit}", least, most)
        for size, least, most in zip(sizes, (5e-3, 5e-3, 1e-4), (1.0, 1.0, 1e-2), strict=True)
    )
    return length, width, thickness


def _condition(text: str) -> str:
    if text.strip().upper() not in get_args(ServiceCondition):
        raise AnswerError(
            f"is not a service condition of JESD22-B110B; allowed: {', '.join(get_args(ServiceCondition))}"
        )
    return text.strip().upper()


def _length(text: str, least: float, most: float) -> float:
    try:
        value = to_si(text, "mm")
    except UnitError as error:
        raise AnswerError(f"{error}") from error
    if not least <= value <= most:
        raise AnswerError(f"{in_mm(value, 4)} is out of range; allowed: {in_mm(least)} to {in_mm(most)}")
    return value


QUESTIONS = (
    Question("name", "Name of the case", "my_bga", _name),
    Question("array", "Joints: rows x columns at pitch", "6 x 6 at 0.8 mm", _array),
    Question("ball", "Diameter of a solder ball before reflow (usual: 0.6 of the pitch)", "usual", _ball),
    Question("board", "Board: length x width x thickness", "132 x 77 x 1 mm", _board),
    Question("drop", "Service condition of JESD22-B110B, A to H (B: 1500 G, 0.5 ms)", "B", _condition),
)
