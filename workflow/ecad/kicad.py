"""Reader for boards of KiCad 6 and later (``.kicad_pcb``), an S-expression of which only the required keys are read."""

import math
import re
from collections.abc import Iterator
from pathlib import Path

from reflowshock.workflow.ecad.layout import (
    MILLI,
    Component,
    EcadError,
    EcadPad,
    Hole,
    Layout,
    Point,
    arc_about,
    box_around,
    checked_number,
    components_by_reference,
    outline_notes,
    read_text,
    round_diameter,
)

Tree = list  # name, followed by strings and trees
TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|([()])|([^\s()"]+)', re.DOTALL)
MAX_DEPTH = 100
EDGE = "Edge.Cuts"
OUTLINES = (
    "gr_line",
    "gr_rect",
    "gr_arc",
    "gr_circle",
    "gr_poly",
    "fp_line",
    "fp_rect",
    "fp_arc",
    "fp_circle",
    "fp_poly",
)
BODIES = ("Fab", "CrtYd")  # layers that show the body of a component, in order of preference


def read_kicad(path: Path) -> Layout:
    """Read a board from a KiCad file (``.kicad_pcb``).

    Args:
        path: File to read.

    Returns:
        Outline, thickness (None if not in the file), holes, and components with their pads, in SI units.

    Raises:
        EcadError: The file is damaged, is not a KiCad board, or has no outline.
    """
    board = _tree(path)
    footprints = [item for item in _children(board) if item[0] in ("footprint", "module")]
    edges = [(item, (0.0, 0.0), 0.0) for item in _children(board)]
    edges += [(item, *_placement(footprint, path)) for footprint in footprints for item in _children(footprint)]
    corners, straight = _outline(edges, path)
    low, high = box_around(corners)
    margin = _length(_child(board, "setup"), "pad_to_mask_clearance", path) or 0.0
    thickness = _length(_child(board, "general"), "thickness", path)
    components = [_component(footprint, margin, path) for footprint in footprints if _pads(footprint)]
    return Layout(
        path, low, high, thickness,
        tuple(hole for footprint in footprints for hole in _holes(footprint, path)),
        components_by_reference(components, path),
        outline_notes(corners, straight),
    )  # fmt: skip


def _tree(path: Path) -> Tree:
    """Parse the S-expression of a file without recursion, or raise ``EcadError``."""
    root: Tree = []
    stack = [root]
    for text, bracket, word in TOKEN.findall(read_text(path)):
        if bracket == "(":
            stack[-1].append([])
            stack.append(stack[-1][-1])
        elif bracket == ")":
            stack.pop()
        else:
            stack[-1].append(word or text.replace('\\"', '"'))
        if not 0 < len(stack) <= MAX_DEPTH:
            raise EcadError(path, "brackets do not match")
    if len(stack) > 1:
        raise EcadError(path, f"the file is truncated: {len(stack) - 1} brackets are not closed")
    if len(root) != 1 or not isinstance(root[0], list) or root[0][:1] != ["kicad_pcb"]:
        raise EcadError(path, "the file is not a board of KiCad 6 or later: it does not begin with (kicad_pcb")
    return root[0]


def _children(tree: Tree | None) -> Iterator[Tree]:
    """Yield the named subtrees of a tree."""
    for item in tree or ():
        if isinstance(item, list) and item and isinstance(item[0], str):
            yield item


def _child(tree: Tree | None, name: str) -> Tree | None:
    return next((item for item in _children(tree) if item[0] == name), None)


def _words(tree: Tree | None, name: str) -> list[str]:
    """Return the words of a child, e.g. ["F.Cu"] of (layer "F.Cu"), or an empty list."""
    return [item for item in (_child(tree, name) or [])[1:] if isinstance(item, str)]


def _numbers(tree: Tree | None, name: str, count: int, path: Path) -> list[float]:
    """Return the first numbers of a child, or raise ``EcadError`` if it has fewer."""
    words = _words(tree, name)
    if len(words) < count:
        kind = tree[0] if tree else "the file"
        raise EcadError(path, f"({name} …) of {kind} has {len(words)} numbers; required: {count}")
    return [checked_number(path, name, word, 1e5) for word in words[:count]]


def _length(tree: Tree | None, name: str, path: Path) -> float | None:
    return MILLI * _numbers(tree, name, 1, path)[0] if _child(tree, name) else None


def _placement(footprint: Tree, path: Path) -> tuple[Point, float]:
    """Return position [mm, y down] and rotation [rad] of a footprint."""
    x, y = _numbers(footprint, "at", 2, path)
    rotation = _words(footprint, "at")[2:3]
    return (x, y), math.radians(
        checked_number(path, "at", rotation[0], 1e4) if rotation and rotation[0] != "unlocked" else 0.0
    )


def _on_board(point: Point, origin: Point, angle: float) -> Point:
    """Transform a point of a footprint [mm, y down] to the board [m, y up]."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = point
    return MILLI * (origin[0] + c * x + s * y), -MILLI * (origin[1] - s * x + c * y)


def _outline(edges: list[tuple[Tree, Point, float]], path: Path) -> tuple[list[Point], bool]:
    """Return points of the board's outline [m] and whether all its segments are straight."""
    points: list[Point] = []
    straight = True
    for item, origin, angle in edges:
        if item[0] in OUTLINES and _words(item, "layer") == [EDGE]:
            points += [_on_board(point, origin, angle) for point in _points(item, path)]
            straight &= item[0][3:] in ("line", "rect", "poly")
    if not points:
        raise EcadError(path, f"the outline is missing: nothing is drawn on {EDGE}")
    return points, straight


def _points(item: Tree, path: Path) -> list[Point]:
    """Return the points of a drawn item [mm]; for a circle, two corners of its bounding box."""
    kind = item[0][3:]
    if kind == "poly":
        corners = [(_child(item, "pts") or ["pts"])[1:]]
        return [(_numbers(["pts", xy], "xy", 2, path)[0], _numbers(["pts", xy], "xy", 2, path)[1]) for xy in corners[0]]
    if kind == "circle":
        (x, y), end = _numbers(item, "center", 2, path), _numbers(item, "end", 2, path)
        radius = math.dist((x, y), end)
        return [(x - radius, y - radius), (x + radius, y + radius)]
    (x0, y0), (x1, y1) = _numbers(item, "start", 2, path), _numbers(item, "end", 2, path)
    corners_of = {"rect": [(x0, y0), (x1, y0), (x1, y1), (x0, y1)], "line": [(x0, y0), (x1, y1)]}
    return corners_of[kind] if kind in corners_of else _arc((x0, y0), _numbers(item, "mid", 2, path), (x1, y1))


def _arc(start: Point, middle: list[float], end: Point) -> list[Point]:
    """Return points along the arc through three points, or the end points if the three are collinear."""
    (ax, ay), (bx, by), (cx, cy) = start, middle, end
    twice = 2.0 * (ax * (by - cy) + bx * (cy - ay) + cx * (ay - by))
    if abs(twice) < 1e-12:
        return [start, end]
    a, b, c = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    x = (a * (by - cy) + b * (cy - ay) + c * (ay - by)) / twice
    y = (a * (cx - bx) + b * (ax - cx) + c * (bx - ax)) / twice
    return arc_about((x, y), start, end, clockwise=twice < 0.0)


def _pads(footprint: Tree) -> list[Tree]:
    """Return the pads of a footprint that are soldered."""
    return [item for item in _children(footprint) if item[0] == "pad" and len(item) > 3 and item[2] != "np_thru_hole"]


def _component(footprint: Tree, board_margin: float, path: Path) -> Component:
    origin, angle = _placement(footprint, path)
    margin = _length(footprint, "solder_mask_margin", path)
    pads = []
    for pad in _pads(footprint):
        width, height = _numbers(pad, "size", 2, path)
        x, y = _numbers(pad, "at", 2, path)
        pad_margin = _length(pad, "solder_mask_margin", path)
        grown = next((length for length in (pad_margin, margin) if length), board_margin) / MILLI
        opened = round_diameter(pad[3], width + 2.0 * grown, height + 2.0 * grown)
        copper = round_diameter(pad[3], width, height)
        pads.append(EcadPad(str(pad[1]), _on_board((x, y), origin, angle), MILLI * copper, MILLI * opened))
    side = "bottom" if _words(footprint, "layer")[:1] == ["B.Cu"] else "top"
    return Component(
        _label(footprint, "reference"), _label(footprint, "value"), side, tuple(pads), _body(footprint, path)
    )


def _label(footprint: Tree, kind: str) -> str:
    """Return reference or value, which are properties since KiCad 8 and texts before."""
    for item in _children(footprint):
        if item[0] == "property" and len(item) > 2 and str(item[1]).lower() == kind:
            return str(item[2])
        if item[0] == "fp_text" and len(item) > 2 and item[1] == kind:
            return str(item[2])
    return ""


def _body(footprint: Tree, path: Path) -> Point | None:
    """Return length and width of a component along the board's axes from its fabrication drawing or courtyard [m]."""
    _, angle = _placement(footprint, path)
    for name in BODIES:
        points = [
            _on_board(point, (0.0, 0.0), angle)
            for item in _children(footprint)
            if item[0] in OUTLINES and any(layer.endswith(name) for layer in _words(item, "layer"))
            for point in _points(item, path)
        ]
        if points:
            (x0, y0), (x1, y1) = box_around(points)
            return x1 - x0, y1 - y0
    return None


def _holes(footprint: Tree, path: Path) -> Iterator[Hole]:
    origin, angle = _placement(footprint, path)
    for pad in _children(footprint):
        if pad[0] != "pad" or not _child(pad, "drill"):
            continue
        sizes = [word for word in _words(pad, "drill") if word != "oval"]
        x, y = _numbers(pad, "at", 2, path)
        if sizes:
            diameter = checked_number(path, "drill", sizes[0], 1e3)
            yield Hole(_on_board((x, y), origin, angle), MILLI * diameter)
