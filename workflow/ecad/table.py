"""Boards of a table (CSV): corners of the outline, holes and pads, a line each; for what has no reader of its own.

The columns are ``kind`` (outline, hole, pad), ``reference``, ``pin``, ``x``, ``y``, ``diameter`` and ``mask_opening``;
those that are lengths have their unit in the title, e.g. ``x [mm]``. The last one may be absent, or empty.
"""

import csv
from collections import defaultdict
from pathlib import Path

from reflowshock.units import UnitError, to_si
from reflowshock.workflow.ecad.layout import (
    MOST_ITEMS,
    Component,
    EcadError,
    EcadPad,
    Hole,
    Layout,
    Point,
    box_around,
    checked_number,
    named,
    outline_notes,
    text_of,
)

KINDS = ("outline", "hole", "pad")
LENGTHS = ("x", "y", "diameter")
COLUMNS = ("kind", "reference", "pin", *LENGTHS)


def read_table(path: Path) -> Layout:
    """Read a board.

    Raises:
        EcadError: a column is missing or has no unit, a line is not of a known kind, or there is no outline.
    """
    rows = list(csv.reader(text_of(path).splitlines()))
    if len(rows) > MOST_ITEMS:
        raise EcadError(path, f"has {len(rows)} lines, allowed: up to {MOST_ITEMS}")
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
        wanted = LENGTHS[:2] if cells.get("kind") == "outline" else LENGTHS
        missing = [name for name in wanted if name not in lengths]
        if cells.get("kind") not in KINDS:
            raise EcadError(path, f"line {line} is a {cells.get('kind', '')!r}, allowed: {', '.join(KINDS)}")
        if missing:
            raise EcadError(path, f"line {line} has no {missing[0]}")
        at = lengths["x"], lengths["y"]
        if cells["kind"] == "outline":
            corners.append(at)
        elif cells["kind"] == "hole":
            holes.append(Hole(at, lengths["diameter"]))
        else:
            pad = EcadPad(cells.get("pin", ""), at, lengths["diameter"], lengths.get("mask_opening"))
            pads[cells.get("reference", "")].append(pad)
    if not corners:
        raise EcadError(path, "has no outline: lines of the kind outline are its corners")
    components = [Component(reference, "", "top", tuple(found)) for reference, found in pads.items()]
    return Layout(path, *box_around(corners), None, tuple(holes), named(components, path), outline_notes(corners, True))


def _titles(row: list[str], path: Path) -> tuple[list[str], dict[str, float]]:
    """Return the names of the columns, and the units [m] of those that are lengths."""
    titles, scales = [], {}
    for title in row:
        name, _, unit = title.strip().partition("[")
        titles.append(name.strip())
        if titles[-1] in (*LENGTHS, "mask_opening"):
            try:
                scales[titles[-1]] = to_si(f"1 {unit.rstrip(' ]')}", "mm")
            except UnitError as error:
                raise EcadError(path, f"the title {title.strip()!r} has no length: {error}") from error
    missing = [name for name in COLUMNS if name not in titles]
    if missing:
        raise EcadError(
            path, f"has no column {missing[0]}; wanted: {', '.join(COLUMNS)}, and mask_opening if it is known"
        )
    return titles, scales
