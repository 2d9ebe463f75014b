"""What is fitted to the board of a drop: places off it, supports that do not go with the shock."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from reflowshock.fem.problem.attachment_checks import fitting_problems
from reflowshock.fem.problem.fittings import Fittings, Place
from reflowshock.fem.problem.structure import Holes, Layer, Structure
from reflowshock.problem import Problem

if TYPE_CHECKING:
    from reflowshock.workflow.package.case import BoardDropCase

PACKAGE = "package"  # name of the acceleration of the package's centre


class DrawnBoard(Structure):
    """The board of a drop as a structure, z = 0 at its upper face."""

    @property
    def corners(self) -> tuple[Place, Place]:
        """Return the lowest and the highest corner of the meshed part [m]."""
        (x, y, _), (length, width, thickness) = super().corners
        return (x, y, -thickness), (length, width, 0.0)

    @property
    def facet_sets(self) -> tuple[str, ...]:
        """Return the names that supports may refer to."""
        return ("mounting_holes",)


def drawn_board(case: "BoardDropCase") -> DrawnBoard:
    """Return the board of a case; its elements and material are of no account."""
    board, holes = case.board, case.board.holes
    spacing = (board.length - 2.0 * holes.inset_x, board.width - 2.0 * holes.inset_y)
    return DrawnBoard(
        length=board.length,
        width=board.width,
        cells=(1, 1),
        layers={"board": Layer(material="FR4", thickness=board.thickness)},
        symmetry=("x", "y") if board.symmetry == "quarter" else (),
        holes=Holes(spacing=spacing, diameter=holes.diameter),
    )


def problems(case: "BoardDropCase") -> Iterator[Problem]:
    """Find what cannot be fitted to the board, and supports that do not go with the shock."""
    yield from fitting_problems(case, drawn_board(case))
    for table in ("watch", "gauges"):
        if PACKAGE in getattr(case, table):
            yield Problem(f"{table}.{PACKAGE}", "has the name of what is told of the package itself", PACKAGE)
    if case.shock.method == "large_mass" and case.supports:
        message = "moves holes that nothing else holds"
        yield Problem("shock.method", message, "large_mass", "direct, or no supports")
    sprung = [name for name, support in case.supports.items() if support.bedding]
    if sprung and case.shock.coupling.scheme == "local_steps":
        message = f"does not go with supports.{sprung[0]}.bedding: springs take no local steps"
        yield Problem("shock.coupling.scheme", message, "local_steps", "held_velocity, impulse, auto")


def given(case: "BoardDropCase") -> dict:
    """Return what is fitted as the package fem reads it."""
    return case.model_dump(mode="json", include=set(Fittings.model_fields))
