"""Checks of fittings and further packages: off the board, overlapping, or incompatible with the shock."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from reflowshock.fem.problem.attachment_checks import fitting_problems, position_problems
from reflowshock.fem.problem.fittings import BoardFittings, Neighbour, Place
from reflowshock.fem.problem.structure import Holes, Layer, Structure
from reflowshock.problem import Problem

if TYPE_CHECKING:
    from reflowshock.meshing.board.parameters import Board
    from reflowshock.workflow.package.case import BoardDropCase

ROUNDING = 1e-9
PACKAGE = "package"  # name of the acceleration of the package's centre


class DrawnHoles(Holes):
    """Mounting holes of the board of a drop at any positions."""

    at: tuple[tuple[float, float], ...]

    @property
    def places(self) -> tuple[tuple[float, float], ...]:
        """Positions of the axes, (x, y) of each hole [m]."""
        return self.at


class DrawnBoard(Structure):
    """Board of a drop as a structure, z = 0 at its upper face."""

    centre: tuple[float, float]
    holes: DrawnHoles | None

    @property
    def corners(self) -> tuple[Place, Place]:
        """Lowest and highest corner of the meshed part, (x, y, z) of each [m]."""
        (x, y, _), (length, width, thickness) = super().corners
        a, b = self.centre
        return (x + a, y + b, -thickness), (length + a, width + b, 0.0)

    @property
    def facet_sets(self) -> tuple[str, ...]:
        """Names of facet sets that supports may refer to."""
        return ("mounting_holes",)


def drawn_board(case: "BoardDropCase") -> DrawnBoard:
    """Return the mesh geometry of a case's board for geometric checks; its elements and material are placeholders."""
    board, holes = case.board, case.board.holes
    return DrawnBoard(
        centre=board.centre,
        length=board.length,
        width=board.width,
        cells=(1, 1),
        layers={"board": Layer(material="FR4", thickness=board.thickness)},
        symmetry=("x", "y") if board.symmetry == "quarter" else (),
        holes=DrawnHoles(spacing=spans(board), diameter=holes.diameter, at=board.hole_places),
    )


def problems(case: "BoardDropCase") -> Iterator[Problem]:
    """Yield problems of fittings off the board, and of supports that contradict the shock.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    board = drawn_board(case)
    yield from fitting_problems(case, board)
    yield from neighbour_problems(case, board)
    for table in ("watch", "gauges"):
        if PACKAGE in getattr(case, table):
            yield Problem(f"{table}.{PACKAGE}", "is reserved for the results of the package itself", PACKAGE)
    if case.shock.method == "large_mass" and case.supports:
        message = "needs mounting holes without supports"
        yield Problem("shock.method", message, "large_mass", "direct, or no supports")
    sprung = [name for name, support in case.supports.items() if support.bedding]
    if sprung and case.shock.coupling.scheme == "local_steps":
        message = f"does not support supports.{sprung[0]}.bedding"
        yield Problem("shock.coupling.scheme", message, "local_steps", "held_velocity, impulse, auto")


def neighbour_problems(case: "BoardDropCase", board: DrawnBoard) -> Iterator[Problem]:
    """Yield problems of further packages: off the board, over a hole or over another package.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    package = case.package.substrate
    footprints = {"package": ((0.0, 0.0), (package.length, package.width))}
    for name, item in case.packages.items():
        key = f"packages.{name}"
        yield from _layers(key, item)
        for neighbour, (centre, sides) in footprints.items():
            gaps = [
                abs(a - b) - 0.5 * (c + d) for a, b, c, d in zip(item.at, centre, item.substrate, sides, strict=False)
            ]
            if max(gaps) < 0.0:
                yield Problem(f"{key}.at", f"overlaps {neighbour}", None, f"{in_mm(-max(gaps))} farther away")
        footprints[key] = item.at, (item.substrate[0], item.substrate[1])
        for x in (-0.5, 0.5):
            for y in (-0.5, 0.5):
                corner = (item.at[0] + x * item.substrate[0], item.at[1] + y * item.substrate[1], 0.0)
                yield from position_problems(f"{key}.at", corner, board)
        yield from _over_holes(f"{key}.at", item, board)
    if case.packages and case.cooled:
        message = "does not support further packages, whose residual stress is not computed"
        yield Problem("thermal.effects.residual_stress", message, "on", "off, or no packages")


def _layers(key: str, item: Neighbour) -> Iterator[Problem]:
    """Yield problems of posts that overlap, and of posts or a die that reach beyond the substrate."""
    if item.post > item.pitch:
        yield Problem(f"{key}.post", "is wider than the pitch", in_mm(item.post), f"<= {in_mm(item.pitch)}")
    for axis, count, outer, inner in zip("xy", (item.columns, item.rows), item.substrate, item.die, strict=False):
        array = (count - 1) * item.pitch + item.post
        if max(array, inner) > outer * (1.0 + ROUNDING):
            message = f"is smaller along {axis} than its joints or its die"
            yield Problem(f"{key}.substrate", message, in_mm(outer), f">= {in_mm(max(array, inner))}")


def _over_holes(key: str, item: Neighbour, board: DrawnBoard) -> Iterator[Problem]:
    """Yield the problem of a package over a mounting hole."""
    assert board.holes is not None
    nearest = min(
        math.hypot(
            *(max(abs(a - b) - 0.5 * side, 0.0) for a, b, side in zip(item.at, hole, item.substrate, strict=False))
        )
        for hole in board.holes.places
    )
    if nearest < 0.5 * board.holes.diameter:
        yield Problem(key, "lies over a mounting hole", None, f">= {in_mm(0.5 * board.holes.diameter)} from its axis")


def spans(board: "Board") -> tuple[float, float]:
    """Return the distances between the outermost mounting holes of a board along x and y [m]."""
    x, y = (places[-1] - places[0] for places in board.hole_lines)
    return x, y


def in_mm(length: float) -> str:
    """Format a length [m] in millimetres."""
    return f"{1e3 * length:.4g} mm"


def fem_input(case: "BoardDropCase") -> dict:
    """Return the fittings of a case, such as masses, supports and gauges, as JSON data for the package ``fem``."""
    return case.model_dump(mode="json", include=set(BoardFittings.model_fields))
