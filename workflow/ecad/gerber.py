"""Reader for boards in a folder of Gerber X2 and Excellon files, which gerbonara parses and X2 attributes identify."""

import json
import warnings
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from gerbonara import GerberFile

MAX_FILES = 200
POSITION_TOLERANCE = 1e-6  # m: a pad and an opening with closer centres belong together
SHAPES = {"CircleAperture": "circle", "ObroundAperture": "oval"}
VIA = "ViaDrill"


def read_gerber(path: Path) -> Layout:
    """Read a board from a folder with Gerber files of copper and outline, and drill files.

    Args:
        path: Folder.

    Returns:
        Outline, thickness (None if not in the file), holes, and components with their pads, in SI units.

    Raises:
        EcadError: A file is damaged, the outline is missing, or no pad has the X2 attribute ``.P`` (component, pin).
    """
    files = _files(path)
    gerbers = {name: _gerber(name, text) for name, text in files.items() if _kind(text) == "gerber"}
    by_function = {
        tuple(gerber.file_attrs.get(".FileFunction", ())): (name, gerber) for name, gerber in gerbers.items()
    }
    profile = next((file for function, file in by_function.items() if function[:1] == ("Profile",)), None)
    if profile is None:
        raise EcadError(path, "the outline is missing: no Gerber X2 file has the attribute .FileFunction,Profile")
    corners, straight = _outline(profile[1])
    if not corners:
        raise EcadError(profile[0], "the outline is missing: nothing is drawn in this file")
    low, high = box_around(corners)
    components = [component for side in ("Top", "Bot") for component in _components(by_function, side)]
    if not components:
        raise EcadError(path, "no pad has a component attribute (.P); export Gerber X2 with component attributes")
    return Layout(
        path, low, high, _thickness(path, files),
        tuple(hole for name, text in files.items() if _kind(text) == "drill" for hole in _holes(name, text)),
        components_by_reference(components, path),
        outline_notes(corners, straight),
    )  # fmt: skip


def _files(path: Path) -> dict[Path, str]:
    """Return the contents of all text files of a folder."""
    if not path.is_dir():
        raise EcadError(path, "no such folder")
    names = sorted(name for name in path.iterdir() if name.is_file() and not name.name.startswith("."))
    if len(names) > MAX_FILES:
        raise EcadError(path, f"the folder has {len(names)} files; allowed: up to {MAX_FILES}")
    texts = {}
    for name in names:
        try:
            texts[name] = read_text(name)
        except EcadError as error:
            if not isinstance(error.__cause__, UnicodeDecodeError):  # pictures and archives may lie in the same folder
                raise
    return texts


def _kind(text: str) -> str:
    """Return the type of a file: "gerber", "drill", "job" (JSON), or empty."""
    if "%FS" in text:
        return "gerber"
    if text.lstrip().startswith("M48"):
        return "drill"
    return "job" if text.lstrip().startswith("{") else ""


def _gerber(path: Path, text: str) -> "GerberFile":
    from gerbonara import GerberFile

    if not text.rstrip().endswith(("M02*", "M00*")):
        raise EcadError(path, "the file is truncated: its last command is not M02*")
    return _parsed(path, GerberFile, text)


def _parsed(path: Path, kind: Any, text: str) -> Any:
    """Parse a file with gerbonara; its parsers raise exceptions of any type for damaged files."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parsed = kind.from_string(text)
    except RecursionError as error:
        raise EcadError(path, "the file is nested too deeply") from error
    except Exception as error:
        raise EcadError(path, f"cannot be read: {str(error) or type(error).__name__}") from error
    if len(parsed.objects) > MAX_ITEMS:
        raise EcadError(path, f"the file has {len(parsed.objects)} objects; allowed: up to {MAX_ITEMS}")
    return parsed


def _point(item: Any, x: str, y: str) -> Point:
    """Return the point in two attributes of a gerbonara object [m]."""
    scale = MILLI if str(item.unit) == "mm" else 25.4 * MILLI
    return scale * getattr(item, x), scale * getattr(item, y)


def _outline(profile: "GerberFile") -> tuple[list[Point], bool]:
    """Return the points of the drawn outline [m], and whether all its segments are straight."""
    points: list[Point] = []
    straight = True
    for item in profile.objects:
        if not hasattr(item, "x1"):
            continue
        ends = _point(item, "x1", "y1"), _point(item, "x2", "y2")
        if hasattr(item, "clockwise"):
            offset = _point(item, "cx", "cy")  # relative to the start
            centre = (ends[0][0] + offset[0], ends[0][1] + offset[1])
            points += arc_about(centre, *ends, clockwise=item.clockwise)
            straight = False
        else:
            points += ends
    return points, straight


def _components(by_function: dict[tuple, tuple[Path, "GerberFile"]], side: str) -> Iterator[Component]:
    """Yield the components on a side from its copper flashes with the attribute ``.P`` (reference, pin)."""
    copper = next(
        (file for function, file in by_function.items() if function[:1] + function[2:3] == ("Copper", side)), None
    )
    if copper is None:
        return
    path, gerber = copper
    openings = _openings(by_function.get(("Soldermask", side)))
    pads: dict[str, list[EcadPad]] = defaultdict(list)
    for item in gerber.objects:
        owner = item.attrs.get(".P", ())
        if hasattr(item, "x") and len(owner) >= 2 and item.polarity_dark:
            at = _point(item, "x", "y")
            pads[owner[0]].append(EcadPad(owner[1], at, _diameter(path, item), openings.get(_cell(at))))
    for reference, pad_list in pads.items():
        yield Component(reference, "", "top" if side == "Top" else "bottom", tuple(pad_list))


def _openings(mask: "tuple[Path, GerberFile] | None") -> dict[tuple[int, int], float]:
    """Return the diameters of the solder mask openings [m] by position on a fine grid."""
    if mask is None:
        return {}
    path, gerber = mask
    return {_cell(_point(item, "x", "y")): _diameter(path, item) for item in gerber.objects if hasattr(item, "x")}


def _cell(at: Point) -> tuple[int, int]:
    return round(at[0] / POSITION_TOLERANCE), round(at[1] / POSITION_TOLERANCE)


def _diameter(path: Path, item: Any) -> float:
    """Return the diameter of the circle with the area of a flash [m]."""
    aperture = item.aperture
    if aperture is None:
        raise EcadError(path, "the file has a flash without an aperture")
    scale = MILLI if str(aperture.unit or item.unit) == "mm" else 25.4 * MILLI
    if hasattr(aperture, "diameter"):
        return scale * checked_number(path, "an aperture", aperture.diameter, 1e3)
    if hasattr(aperture, "w"):
        return scale * round_diameter(SHAPES.get(type(aperture).__name__, "rect"), aperture.w, aperture.h)
    (x0, y0), (x1, y1) = aperture.bounding_box(aperture.unit or item.unit)
    return scale * round_diameter("rect", x1 - x0, y1 - y0)


def _holes(path: Path, text: str) -> Iterator[Hole]:
    """Yield the holes of a drill file except vias."""
    from gerbonara import ExcellonFile

    if not text.rstrip().endswith(("M30", "M00")):
        raise EcadError(path, "the file is truncated: its last command is not M30")
    tools = _tool_functions(text)
    for item in _parsed(path, ExcellonFile, text).objects:
        if hasattr(item, "x"):
            scale = MILLI if str(item.unit) == "mm" else 25.4 * MILLI
            diameter = scale * checked_number(path, "a tool", item.aperture.diameter, 1e3)
            if not any(VIA in function and abs(diameter - size) < POSITION_TOLERANCE for size, function in tools):
                yield Hole(_point(item, "x", "y"), diameter)


def _tool_functions(text: str) -> list[tuple[float, str]]:
    """Return diameter [m] and function of the tools of a drill file, from the X2 comment above each tool."""
    tools, function, scale = [], "", MILLI
    for line in text.splitlines():
        if line.startswith("INCH"):
            scale = 25.4 * MILLI
        if "TA.AperFunction" in line:
            function = line
        elif line.startswith("T") and "C" in line:
            size = line.partition("C")[2].split("F")[0].split("S")[0]
            with_size = size.replace(".", "", 1).isdigit()
            tools += [(scale * float(size), function)] if with_size else []
        elif line.startswith("%"):
            break
    return tools


def _thickness(path: Path, files: dict[Path, str]) -> float | None:
    """Return the thickness of the board [m] from a Gerber job file, or None."""
    for name, text in files.items():
        if _kind(text) == "job":
            try:
                value = json.loads(text)["GeneralSpecs"]["BoardThickness"]
            except (ValueError, KeyError, TypeError, RecursionError):
                continue
            return MILLI * checked_number(name, "BoardThickness", value, 100.0)
    return None
