"""Reader for boards in IPC-2581 (XML): outline, stack-up thickness, pads with their pins, and drilled holes."""

import math
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from reflowshock.problem import Problem
from reflowshock.workflow.ecad.layout import (
    MAX_ITEMS,
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

UNITS = {"MILLIMETER": MILLI, "MICRON": 1e-6, "INCH": 25.4 * MILLI}
SHAPES = {"Circle": "circle", "Oval": "oval"}
COPPER = ("CONDUCTOR", "SIGNAL", "PLANE", "MIXED")
Element = ElementTree.Element


def read_ipc2581(path: Path) -> Layout:
    """Read a board from the first step of an IPC-2581 file (XML).

    Args:
        path: File to read.

    Returns:
        Outline, thickness (None if not in the file), holes, and components with their pads, in SI units.

    Raises:
        EcadError: The file is damaged, is not IPC-2581, declares entities, or has no outline.
    """
    root = _root(path)
    step, header = _first(root, "Step"), _first(root, "CadHeader")
    if step is None or header is None:
        raise EcadError(path, "the board is missing; required: a CadHeader and a Step")
    scale = _scale(header, path)
    corners, straight = _outline(_first(step, "Profile"), scale, path)
    layers = {layer.get("name", ""): layer for layer in _all(root, "Layer")}
    low, high = box_around(corners)
    stackup = _first(root, "Stackup")
    thickness = stackup.get("overallThickness") if stackup is not None else None
    features = [_Feature(item, layers.get(item.get("layerRef", "")), path) for item in _all(step, "LayerFeature")]
    return Layout(
        path, low, high,
        scale * checked_number(path, "overallThickness", thickness, 1e5) if thickness is not None else None,
        tuple(hole for feature in features for hole in feature.holes(scale)),
        components_by_reference(_components(step, features, _shapes(root, path), scale, path), path),
        outline_notes(corners, straight),
    )  # fmt: skip


def _root(path: Path) -> Element:
    text = read_text(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise EcadError(path, "the file declares XML entities, which IPC-2581 does not use")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise EcadError(path, f"the file is damaged: {error}") from error
    if _tag(root) != "IPC-2581":
        raise EcadError(path, f"the file is not IPC-2581: its root element is {_tag(root)[:40]}")
    return root


def _tag(element: Element) -> str:
    """Return the name of an element without its namespace."""
    return element.tag.rpartition("}")[2]


def _all(element: Element | None, name: str) -> Iterator[Element]:
    return (child for child in (() if element is None else element.iter()) if _tag(child) == name)


def _first(element: Element | None, name: str) -> Element | None:
    return next(_all(element, name), None)


def _scale(element: Element, path: Path) -> float:
    """Return the length unit of a header or a dictionary [m]."""
    units = element.get("units", "")
    if units not in UNITS:
        raise EcadError(path, Problem("units", "unknown unit", units[:20], ", ".join(UNITS)))
    return UNITS[units]


def _number(element: Element, name: str, path: Path) -> float:
    return checked_number(path, f"{name} of {_tag(element)}", element.get(name), 1e7)


def _point(element: Element, scale: float, path: Path) -> Point:
    return scale * _number(element, "x", path), scale * _number(element, "y", path)


def _outline(profile: Element | None, scale: float, path: Path) -> tuple[list[Point], bool]:
    """Return the points of the outline [m] and whether all its segments are straight; cut-outs are ignored."""
    polygon = _first(profile, "Polygon")
    points: list[Point] = []
    straight = True
    for step in polygon if polygon is not None else ():
        if _tag(step) == "PolyStepCurve":
            centre = scale * _number(step, "centerX", path), scale * _number(step, "centerY", path)
            if not points:
                raise EcadError(path, "the outline begins with a curve; it must begin with a point")
            points += arc_about(centre, points[-1], _point(step, scale, path), step.get("clockwise") == "true")
            straight = False
        else:
            points.append(_point(step, scale, path))
    if not points:
        raise EcadError(path, "the outline is missing: the Step has no Profile with a Polygon")
    return points, straight


def _shapes(root: Element, path: Path) -> dict[str, float]:
    """Return the diameters of circles with the areas of the dictionary shapes [m], by name."""
    diameters = {}
    for dictionary in _all(root, "DictionaryStandard"):
        scale = _scale(dictionary, path)
        for entry in _all(dictionary, "EntryStandard"):
            diameter = next((size for size in (_size(shape, path) for shape in entry) if size), None)
            if diameter:
                diameters[entry.get("id", "")] = scale * diameter
    return diameters


def _size(shape: Element, path: Path) -> float | None:
    """Return the diameter of the circle with the area of a shape, in the file's unit, or None without dimensions."""
    if shape.get("diameter"):
        return _number(shape, "diameter", path)
    if shape.get("width") and shape.get("height"):
        kind = SHAPES.get(_tag(shape), "rect")
        return round_diameter(kind, _number(shape, "width", path), _number(shape, "height", path))
    return None


class _Feature:
    """Pads and holes of one layer."""

    def __init__(self, element: Element, layer: Element | None, path: Path) -> None:
        self.element, self.path = element, path
        self.function = layer.get("layerFunction", "") if layer is not None else ""
        self.side = layer.get("side", "") if layer is not None else ""

    def pads(self, shapes: dict[str, float], scale: float) -> Iterator[tuple[str, str, Point, float]]:
        """Yield reference, pin, location [m] and diameter [m] of the pads with a pin."""
        for count, pad in enumerate(_all(self.element, "Pad")):
            if count > MAX_ITEMS:
                raise EcadError(self.path, f"a layer has more than {MAX_ITEMS} pads")
            location, pin = _first(pad, "Location"), _first(pad, "PinRef")
            shape = _first(pad, "StandardPrimitiveRef")
            if location is None or pin is None or shape is None:
                continue
            name = shape.get("id", "")
            if name not in shapes:
                raise EcadError(self.path, f"the shape {name[:40]!r} of a pad is in no dictionary")
            yield pin.get("componentRef", ""), pin.get("pin", ""), _point(location, scale, self.path), shapes[name]

    def holes(self, scale: float) -> Iterator[Hole]:
        """Yield the holes except vias."""
        for hole in _all(self.element, "Hole"):
            if hole.get("platingStatus") != "VIA":
                yield Hole(_point(hole, scale, self.path), scale * _number(hole, "diameter", self.path))


def _components(
    step: Element, features: list[_Feature], shapes: dict[str, float], scale: float, path: Path
) -> list[Component]:
    copper: dict[str, list[tuple[str, Point, float]]] = defaultdict(list)
    sides: dict[str, str] = {}
    openings: dict[tuple[str, str], float] = {}
    for feature in features:
        if feature.function in COPPER and feature.side in ("TOP", "BOTTOM"):
            for reference, pin, at, diameter in feature.pads(shapes, scale):
                copper[reference].append((pin, at, diameter))
                sides[reference] = feature.side.lower()
        elif feature.function == "SOLDERMASK":
            openings |= {(reference, pin): size for reference, pin, _, size in feature.pads(shapes, scale)}
    bodies = {package.get("name", ""): _body(package, scale, path) for package in _all(step, "Package")}
    placed = {component.get("refDes", ""): component for component in _all(step, "Component")}
    return [
        Component(
            reference,
            placed[reference].get("part", "") if reference in placed else "",
            sides[reference],
            tuple(EcadPad(pin, at, diameter, openings.get((reference, pin))) for pin, at, diameter in pads),
            _rotated_box(bodies.get(placed[reference].get("packageRef", "")), placed[reference], path)
            if reference in placed
            else None,
        )
        for reference, pads in copper.items()
    ]


def _body(package: Element, scale: float, path: Path) -> Point | None:
    """Return length and width of a package without rotation [m], or None without an outline."""
    outline = _first(package, "Outline")
    if _first(outline, "Polygon") is None:
        return None
    (x0, y0), (x1, y1) = box_around(_outline(outline, scale, path)[0])
    return x1 - x0, y1 - y0


def _rotated_box(body: Point | None, component: Element, path: Path) -> Point | None:
    """Return length and width of the bounding box of a rotated body along the board's axes [m]."""
    turn = _first(component, "Xform")
    angle = math.radians(_number(turn, "rotation", path)) if turn is not None and turn.get("rotation") else 0.0
    if body is None:
        return None
    c, s = abs(math.cos(angle)), abs(math.sin(angle))
    return c * body[0] + s * body[1], s * body[0] + c * body[1]
