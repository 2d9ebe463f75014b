"""The command ``init``: five questions to a case of a user's own package, written as one from ECAD is."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from reflowshock.fem.problem.shock import ServiceCondition
from reflowshock.meshing.board.pads import joint_name
from reflowshock.units import UnitError, to_si
from reflowshock.workflow.case.names import NAMES, is_name
from reflowshock.workflow.ecad.case_text import BALL, Wanted, case_text
from reflowshock.workflow.ecad.layout import Component, EcadPad, Hole, Layout, Point, in_mm

PACKAGE = "U1"
PAD = 0.8  # of a ball's diameter: copper of a pad that the mask leaves free (0.48 mm for 0.6 mm)
OPENING = 1.0e-4  # m: by how much wider the mask's opening is
SCREW, SCREW_INSET = 3.0e-3, 4.0e-3  # m: diameter of a mounting hole, and its distance from the board's edges
JEDEC_BOARD = ((0.132, 0.077), (0.105, 0.071))  # m: size of the board of JESD22-B111 and distances of its screws
MOST = 100


class AnswerError(ValueError):
    """An answer that cannot be, and what can."""


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked: key, words, the usual answer, and what reads an answer, which raises AnswerError."""

    key: str
    words: str
    usual: str
    read: Callable[[str], object]


def case_of(answers: dict[str, Any]) -> str:
    """Return the case file of answers that ``QUESTIONS`` have read."""
    (rows, columns), pitch = answers["array"]
    ball, (length, width, thickness) = answers["ball"] or BALL * pitch, answers["board"]
    pads = [
        EcadPad(
            joint_name(row, column),
            ((column - 0.5 * (columns - 1)) * pitch, (0.5 * (rows - 1) - row) * pitch),
            PAD * ball,
            PAD * ball + OPENING,
        )
        for row in range(rows)
        for column in range(columns)
    ]
    half = (0.5 * length, 0.5 * width)
    holes = tuple(Hole((x, y), SCREW) for x, y in _screws(half))
    component = Component(PACKAGE, "", "top", tuple(pads))
    name = str(answers["name"])
    layout = Layout(Path(name), (-half[0], -half[1]), half, thickness, holes, {PACKAGE: component})
    wanted = Wanted(
        name, PACKAGE, ball=ball, condition=str(answers["drop"]), title=f"{rows} x {columns} BGA at {in_mm(pitch)}"
    )
    return case_text(layout, wanted)


def _screws(half: Point) -> list[Point]:
    """Return where a board of half the sides ``half`` [m] is screwed on."""
    size, apart = JEDEC_BOARD
    if max(abs(2.0 * half[0] - size[0]), abs(2.0 * half[1] - size[1])) < 1e-6:
        x, y = 0.5 * apart[0], 0.5 * apart[1]
    else:
        x, y = half[0] - SCREW_INSET, half[1] - SCREW_INSET
    return [(-x, -y), (-x, y), (x, -y), (x, y)]


def _name(text: str) -> str:
    if not is_name(text):
        raise AnswerError(f"is not a valid name; allowed: {NAMES}")
    return text


def _array(text: str) -> tuple[tuple[int, int], float]:
    found = re.fullmatch(r"\s*(\d+)\s*[x×*]\s*(\d+)\s*(?:at|@|,)\s*(.+)", text)
    if found is None:
        raise AnswerError('is not understood; wanted: rows x columns at pitch, e.g. "6 x 6 at 0.8 mm"')
    sides = int(found[1]), int(found[2])
    if not all(2 <= side <= MOST for side in sides):
        raise AnswerError(f"has {sides[0]} x {sides[1]} joints; allowed: 2 x 2 to {MOST} x {MOST}")
    return sides, _length(found[3], 5e-5, 5e-3)


def _ball(text: str) -> float | None:
    return None if text.strip() in ("", "usual") else _length(text, 2e-5, 3e-3)


def _board(text: str) -> tuple[float, float, float]:
    sizes = re.split(r"\s*[x×*]\s*", text.strip())
    unit = re.sub(r"[-+0-9.eE\s]", "", sizes[-1])
    if len(sizes) != 3:
        raise AnswerError('is not understood; wanted: length x width x thickness, e.g. "132 x 77 x 1 mm"')
    length, width, thickness = (
        _length(size if re.search(r"[a-zµ]", size) else f"{size} {unit}", least, most)
        for size, least, most in zip(sizes, (5e-3, 5e-3, 1e-4), (1.0, 1.0, 1e-2), strict=True)
    )
    return length, width, thickness


def _condition(text: str) -> str:
    if text.strip().upper() not in get_args(ServiceCondition):
        raise AnswerError(f"is no service condition of JESD22-B110B; allowed: {', '.join(get_args(ServiceCondition))}")
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
