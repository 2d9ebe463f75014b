"""Reader for boards in CSV tables, for ECAD tools without a supported format: one outline corner, hole or pad per line.

The columns are ``kind`` (outline, hole, pad), ``reference``, ``pin``, ``x``, ``y``, ``diameter`` and ``mask_opening``.
Titles of lengths contain the unit, e.g. ``x [mm]``. ``mask_opening`` is optional.
"""

import csv
from collections import defaultdict
from pathlib import Path

from reflowshock.problem import Problem
from reflowshock.units import UnitError, to_si
from reflowshock.workflow.ecad.layout import (
    MAX_ITEMS,
    Component,
    EcadError,
    EcadPad,
    Hole,
    Layout,
    Point,
    box_around,
    checked_number,
    components_by_reference,
    outline_notes,
    read_text,
)

KINDS = ("outline", "hole", "pad")
LENGTHS = ("x", "y", "diameter")
COLUMNS = ("kind", "reference", "pin", *LENGTHS)


def read_table(path: Path) -> Layout:
    """Read a board from a CSV table, with one line for each corner of the outline, hole and pad.

    Args:
        path: CSV file.

    Returns:
        Outline, thickness (None if not in the file), holes, and components with their pads, in SI units.

    Raises:
        EcadError: A column is missing or has no unit, a line is of an unknown kind, or the outline is missing.
    """
    rows = list(csv.reader(read_text(path).splitlines()))
    if len(rows) > MAX_ITEMS:
        raise EcadError(path, f"has {len(rows)} lines; allowed: up to {MAX_ITEMS}")
    titles, scales = _titles(rows[0] if rows else [], path)
    corners: list[Point] = []
    holes: list[Hole] = []
    pads: dict[str, list[EcadPad]] = defaultdict(list)
    for line, row in enumerate(rows[1:], start=2):
        cells = dict(zip(titles, (cell.strip() for cell in row), strict=False))
        if not any(cells.values()):
            continue
        lengths = {
            name: scales[name] * checked_number(path, f"{name} in line {line}", cells[name], 1e7)
            for name in scales
            if cells.get(name)
        }
        required = LENGTHS[:2] if cells.get("kind") == "outline" else LENGTHS
        missing = [name for name in required if name not in lengths]
        if cells.get("kind") not in KINDS:
            problem = Problem("kind", "unknown kind", cells.get("kind", ""), ", ".join(KINDS), line=line)
            raise EcadError(path, problem)
        if missing:
            raise EcadError(path, Problem(missing[0], "is missing", line=line))
        at = lengths["x"], lengths["y"]
        if cells["kind"] == "outline":
            corners.append(at)
        elif cells["kind"] == "hole":
            holes.append(Hole(at, lengths["diameter"]))
        else:
            pad = EcadPad(cells.get("pin", ""), at, lengths["diameter"], lengths.get("mask_opening"))
            pads[cells.get("reference", "")].append(pad)
    if not corners:
        raise EcadError(path, "the outline is missing; try lines of the kind outline for its corners")
    components = [Component(reference, "", "top", tuple(pad_list)) for reference, pad_list in pads.items()]
    return Layout(
        path,
        *box_around(corners),
        None,
        tuple(holes),
        components_by_reference(components, path),
        outline_notes(corners, True),
    )


def _titles(row: list[str], path: Path) -> tuple[list[str], dict[str, float]]:
    """Return the names of the columns, and the unit in metres of each column of lengths."""
    titles, scales = [], {}
    for title in row:
        name, _, unit = title.strip().partition("[")
        titles.append(name.strip())
        if titles[-1] in (*LENGTHS, "mask_opening"):
            try:
                scales[titles[-1]] = to_si(f"1 {unit.rstrip(' ]')}", "mm")
            except UnitError as error:
                raise EcadError(path, f"the title {title.strip()!r} has no unit of length: {error}") from error
    missing = [name for name in COLUMNS if name not in titles]
    if missing:
        raise EcadError(
            path, f"the column {missing[0]} is missing; required: {', '.join(COLUMNS)}; optional: mask_opening"
        )
    return titles, scales
