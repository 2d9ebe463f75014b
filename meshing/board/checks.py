"""Consistency checks of package, board and warpage parameters that are valid individually. Pure Python."""

import difflib
import math
from collections.abc import Iterator
from itertools import pairwise

from reflowshock.meshing.board.pads import joint_name, lift, pad_table
from reflowshock.meshing.board.parameters import IN_LINE, Board, Package, Pad, Warpage
from reflowshock.meshing.board.plan import WIDEST_SQUARE, hole_square, square_around, uniform
from reflowshock.problem import Problem

LEAST_ROOM = 1.1  # least ratio of a column's side and the diameter of its pad
ROUNDING = 1.0e-9
SMALLEST_INSET = 0.75  # hole diameters from its axis to the edge, so that a quarter of a diameter remains as wall
WIDE_HOLE = 0.25  # share of a side of the board; for a wider hole the message names the hole instead of the board
SMALLEST_ROOM = SMALLEST_INSET * (1.0 + 0.5 * WIDEST_SQUARE)  # hole diameters from the edge to the end of its block


def problems(package: Package, board: Board, warpage: Warpage) -> list[Problem]:
    """Return the contradictions between parameters of an assembly, before it is meshed; empty if there are none.

    Args:
        package: Array, pads and layers of the package.
        board: Sizes, holes and symmetry of the board.
        warpage: Prescribed warpage of the package.

    Returns:
        Input errors with dotted keys of the case file, allowed ranges and hints.
    """
    return [
        *_array(package),
        *_symmetry(package, board),
        *_pad("package.board_pad", package.board_pad, package),
        *_pad("package.package_pad", package.package_pad, package),
        *_layers(package, board),
        *_which_holes(board),
        *_free_rotation(board),
        *hole_problems(package, board),
        *_gaps(package, board, warpage),
        *_numerics(board),
        *_imprint(package),
    ]


def hole_problems(package: Package, board: Board) -> Iterator[Problem]:
    """Yield problems of mounting holes that cannot be meshed: beyond the board, near the package or each other.

    Args:
        package: Package, whose substrate the holes must not touch.
        board: Sizes, mounting holes and symmetry of the board.

    Yields:
        Input errors with dotted keys of the case file, allowed ranges and hints.
    """
    return _hole_places(package, board) if _has_positions(board) else _holes(package, board)


def _has_positions(board: Board) -> bool:
    """Return whether holes are at given positions, or at insets of a board that is not centred on the package."""
    return bool(board.holes.at) or any(board.centre)


def _free_rotation(board: Board) -> Iterator[Problem]:
    """Check that a board with holes at positions cannot rotate about the only one."""
    if not _has_positions(board) or not board.hole_places:
        return
    if not any(places[-1] > places[0] for places in board.hole_lines):
        message = "a board with one hole could rotate about it"
        yield Problem("board.holes.at", message, str(len(board.holes.at)), ">= 2 positions")


def _array(package: Package) -> Iterator[Problem]:
    """Check that depopulated joints exist and that a joint is left."""
    names = [joint_name(row, column) for row in range(package.rows) for column in range(package.columns)]
    for name in sorted(set(package.depopulated) - set(names)):
        near = difflib.get_close_matches(name.upper(), names, n=1, cutoff=0.0)[0]
        message = f"no such joint, the nearest is {near}"
        yield Problem("package.depopulated", message, name, f"{names[0]} to {names[-1]}")
    if set(names) <= set(package.depopulated):
        yield Problem("package.depopulated", "no joint is left", f"{len(names)} joints", f"< {len(names)}")


def _symmetry(package: Package, board: Board) -> Iterator[Problem]:
    """Check that the array of a quarter model is symmetric and that no joint lies on a plane of symmetry."""
    if board.symmetry == "full":
        return
    for key, count in (("package.rows", package.rows), ("package.columns", package.columns)):
        if count % 2:
            message = "a joint would be cut by the symmetry plane of a quarter model"
            yield Problem(key, message, str(count), 'even, or board.symmetry = "full"')
    gone = set(package.depopulated)
    for row in range(package.rows):
        for column in range(package.columns):
            name = joint_name(row, column)
            mirrored = {joint_name(package.rows - 1 - row, column), joint_name(row, package.columns - 1 - column)}
            if name in gone and not mirrored <= gone:
                allowed = f'{", ".join(sorted(mirrored - gone))} too, or board.symmetry = "full"'
                yield Problem("package.depopulated", "a quarter model needs symmetric depopulation", name, allowed)


def _pad(key: str, pad: Pad, package: Package) -> Iterator[Problem]:
    """Check that neighbouring pads do not overlap and that the mask opening suits the definition (SMD or NSMD)."""
    several = package.rows * package.columns > 1
    for name, diameter in (("diameter", pad.diameter), ("mask_opening", pad.mask_opening)):
        if several and diameter >= package.pitch:
            message = "pads overlap" if name == "diameter" else "mask openings overlap"
            yield Problem(f"{key}.{name}", message, _mm(diameter), f"< {_mm(package.pitch)}, the pitch")
    if pad.definition == "SMD" and pad.mask_opening >= pad.diameter:
        message = "a solder mask that defines the pad (SMD) covers its edge"
        yield Problem(f"{key}.mask_opening", message, _mm(pad.mask_opening), f"< {_mm(pad.diameter)}, the diameter")
    if pad.definition == "NSMD" and pad.mask_opening <= pad.diameter:
        message = "a solder mask that does not define the pad (NSMD) leaves its edge free"
        yield Problem(f"{key}.mask_opening", message, _mm(pad.mask_opening), f"> {_mm(pad.diameter)}, the diameter")


def _layers(package: Package, board: Board) -> Iterator[Problem]:
    """Check that the array and the die lie inside the substrate, and the substrate inside the board."""
    widest_pad = max(package.board_pad.diameter, package.package_pad.diameter)
    for side, count in (("length", package.columns), ("width", package.rows)):
        substrate, die, whole = getattr(package.substrate, side), getattr(package.die, side), getattr(board, side)
        array = (count - 1) * package.pitch + widest_pad
        if substrate < array:
            message = "the array of pads reaches beyond the substrate"
            yield Problem(f"package.substrate.{side}", message, _mm(substrate), f">= {_mm(array)}")
        if die > substrate:
            message = "the die is larger than its substrate"
            yield Problem(f"package.die.{side}", message, _mm(die), f"<= {_mm(substrate)}")
        low, high = board.ends[side == "width"]
        if substrate >= whole:
            message = "the package is larger than the board"
            yield Problem(f"package.substrate.{side}", message, _mm(substrate), f"< {_mm(whole)}, the board's")
        elif 0.5 * substrate >= min(-low, high):
            away = 0.5 * (whole - substrate)
            message = f"the package at the origin reaches beyond the board along its {side}"
            yield Problem("board.centre", message, _point(board.centre), f"within {_mm(away)} of the origin")


def _holes(package: Package, board: Board) -> Iterator[Problem]:
    """Check that holes given by insets lie inside the board, with their blocks beyond the package along both axes."""
    diameter, x, y = board.holes.diameter, board.holes.inset_x, board.holes.inset_y
    if x is None or y is None:
        return
    for axis, side, inset, inset_across in (("x", "length", x, y), ("y", "width", y, x)):
        whole = getattr(board, side)
        room = 0.5 * whole - _half_of_package(getattr(package.substrate, side), board)
        missing = SMALLEST_ROOM * diameter - room
        # A block grows with its inset, until the inset along the other axis, or the hole, limits it.
        largest = max(room - 0.5 * square_around(diameter, inset_across), room / (1.0 + 0.5 * WIDEST_SQUARE))
        key, allowed = f"board.holes.inset_{axis}", f"{_mm(SMALLEST_INSET * diameter)} to {_mm(largest)}"
        if missing > 0.0:
            yield _no_room(side, whole + 2.0 * missing, room, board)
        elif inset < SMALLEST_INSET * diameter:
            yield Problem(key, "a mounting hole reaches beyond the board", _mm(inset), allowed)
        elif inset > largest:
            message = "a mounting hole lies under or next to the package: it needs separate strips of the board"
            yield Problem(key, message, _mm(inset), allowed)


def _which_holes(board: Board) -> Iterator[Problem]:
    """Check that holes are given by insets or by positions, and that the holes of a quarter model are symmetric."""
    holes = board.holes
    insets = [name for name in ("inset_x", "inset_y") if getattr(holes, name) is not None]
    if holes.at and insets:
        yield Problem(
            f"board.holes.{insets[0]}", "cannot be combined with holes at given positions", None, "no board.holes.at"
        )
    elif not holes.at and len(insets) < 2:
        missing = next(name for name in ("inset_x", "inset_y") if name not in insets)
        yield Problem(f"board.holes.{missing}", "is missing", None, "a length, or board.holes.at = [[x, y], …]")
    if board.symmetry == "full":
        return
    whole = 'in the middle, or board.symmetry = "full"'
    if any(board.centre):
        yield Problem("board.centre", "a quarter model needs a centred package", None, whole)
    for x, y in holes.at:
        if not all(any(math.dist(mirror, centre) <= IN_LINE for centre in holes.at) for mirror in ((-x, y), (x, -y))):
            message = "a quarter model needs symmetric mounting holes"
            yield Problem("board.holes.at", message, _point((x, y)), f"{_point((-x, y))} and {_point((x, -y))} too")


def _hole_places(package: Package, board: Board) -> Iterator[Problem]:
    """Check that holes at given positions lie inside the board, beyond the package, and in line or apart."""
    key, least = "board.holes.at", SMALLEST_INSET * board.holes.diameter
    if not board.hole_places:
        return
    sides = (package.substrate.length, package.substrate.width)
    square = hole_square(board)
    for axis, (side, (low, high), lines) in enumerate(zip(sides, board.ends, board.hole_lines, strict=True)):
        beyond = _half_of_package(side, board) + 0.5 * max(square, 2.0 * least)
        for position in lines:
            inside = f"{_mm(low + least)} to {_mm(-beyond)} and {_mm(beyond)} to {_mm(high - least)}"
            if not low + least <= position <= high - least:
                yield Problem(
                    key, f"a mounting hole reaches beyond the board along {'xy'[axis]}", _mm(position), inside
                )
            elif abs(position) < beyond:
                message = "a mounting hole lies under or next to the package: it needs separate strips of the board"
                yield Problem(key, f"{message} along {'xy'[axis]}", _mm(position), inside)
        for first, second in pairwise(lines):
            if second - first < 2.0 * least:
                message = f"mounting holes are neither in line nor apart along {'xy'[axis]}"
                yield Problem(key, message, _mm(second - first), f"0 mm, or >= {_mm(2.0 * least)}")


def _point(centre: tuple[float, float]) -> str:
    return f"({_mm(centre[0])}, {_mm(centre[1])})"


def _no_room(side: str, needed: float, room: float, board: Board) -> Problem:
    """Return the error that the board is too small or its holes are too large for the room next to the package [m]."""
    whole, diameter = getattr(board, side), board.holes.diameter
    board_at_least = f">= {_mm(needed)}"
    if room > 0.0 and diameter > WIDE_HOLE * whole:
        message = "the mounting holes do not fit next to the package and its patch"
        allowed = f"<= {_mm(room / SMALLEST_ROOM)}, or board.{side} {board_at_least}"
        return Problem("board.holes.diameter", message, _mm(diameter), allowed)
    message = "too small for the package, its patch and the mounting holes next to each other"
    return Problem(f"board.{side}", message, _mm(whole), board_at_least)


def _half_of_package(side: float, board: Board) -> float:
    """Return half the width of the board's strip that package, patch and one more element occupy [m]."""
    size, margin = board.numerics.element_size, board.numerics.patch_margin
    return 0.5 * side * (1.0 + (margin + 1) / uniform(0.0, 0.5 * side, size).cells)


def _gaps(package: Package, board: Board, warpage: Warpage) -> Iterator[Problem]:
    """Check that the warped package does not touch the board, nor its pads the pads of the board."""
    sites = pad_table(package, board, Warpage())
    unit = Warpage(corner=1.0)
    over_joints = max((float(lift(package, unit, site.x, site.y)) for site in sites), default=0.0)
    over_package = float(lift(package, unit, 0.5 * package.substrate.length, 0.5 * package.substrate.width))
    if over_package == 0.0 or warpage.corner >= 0.0:
        return
    room = package.standoff + 2.0 * package.copper.thickness
    limit = -min(package.standoff / over_joints if over_joints else room / over_package, room / over_package)
    if warpage.corner <= limit:
        message = "the warped package would touch the board"
        yield Problem("warpage.corner", message, _mm(warpage.corner), f"> {_mm(limit)}")


def _numerics(board: Board) -> Iterator[Problem]:
    numerics = board.numerics
    if numerics.patch_layers >= numerics.layers:
        allowed = f"< {numerics.layers}, the board's layers"
        message = "the macro model needs a layer of the board below the patch"
        yield Problem("board.numerics.patch_layers", message, str(numerics.patch_layers), allowed)
    if numerics.coarse_size < numerics.element_size:
        allowed = f">= {_mm(numerics.element_size)}, the element size"
        yield Problem("board.numerics.coarse_size", "finer than the fine elements", _mm(numerics.coarse_size), allowed)


def _imprint(package: Package) -> Iterator[Problem]:
    """Check that columns do not overlap, lie inside the substrate and enclose their pads, which must be copper pads."""
    size = package.column_size
    if size is None:
        return
    if package.copper.layout == "plate":
        message = "imprinted pads need a copper pad for each joint"
        yield Problem("package.copper.layout", message, "plate", "pads, or no package.imprint")
    key, pad = "package.imprint.size", max(package.board_pad.diameter, package.package_pad.diameter)
    sides = (package.substrate.length - (package.columns - 1) * package.pitch,
             package.substrate.width - (package.rows - 1) * package.pitch)  # fmt: skip
    largest = min(package.pitch if package.rows * package.columns > 1 else math.inf, *sides) * (1.0 + ROUNDING)
    if not LEAST_ROOM * pad <= size <= largest:
        message = "the column of a joint does not fit between its pad, its neighbours and the edge of the substrate"
        yield Problem(key, message, _mm(size), f"{_mm(LEAST_ROOM * pad)} to {_mm(largest)}")


def _mm(length: float) -> str:
    return f"{1e3 * length:.4g} mm"
