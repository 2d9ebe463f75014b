"""Boards of Gerber X2 and Excellon files in a folder: gerbonara reads them, their attributes say what each one is."""

import json
import warnings
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reflowshock.workflow.ecad.layout import (
    MILLI,
    MOST_ITEMS,
    Component,
    EcadError,
    EcadPad,
    Hole,
    Layout,
    Point,
    arc_about,
    box_around,
    checked_number,
    named,
    outline_notes,
    round_diameter,
    text_of,
)

if TYPE_CHECKING:
    from gerbonara import GerberFile

MOST_FILES = 200
SAME = 1e-6  # m: pad and opening whose centres are closer belong together
SHAPES = {"CircleAperture": "circle", "ObroundAperture": "oval"}
VIA = "ViaDrill"


def read_gerber(path: Path) -> Layout:
    """Read the board whose files are in a folder: copper with pads that name their component, outline, drills.

    Raises:
        EcadError: a file is damaged, or there is no outline, or no pad says to which component it belongs (X2: ``.P``).
    """
    files = _files(path)
    gerbers = {name: _gerber(name, text) for name, text in files.items() if _kind(text) == "gerber"}
    by_function = {
        tuple(gerber.file_attrs.get(".FileFunction", ())): (name, gerber) for name, gerber in gerbers.items()
    }
    profile = next((found for function, found in by_function.items() if function[:1] == ("Profile",)), None)
    if profile is None:
        raise EcadError(path, "has no outline: no Gerber X2 file has the attribute .FileFunction,Profile")
    corners, straight = _outline(profile[1])
    if not corners:
        raise EcadError(profile[0], "has no outline: nothing is drawn in it")
    low, high = box_around(corners)
    components = [component for side in ("Top", "Bot") for component in _components(by_function, side)]
    if not components:
        raise EcadError(
            path, "no pad says to which component it belongs: Gerber X2 with component attributes is wanted"
        )
    return Layout(
        path, low, high, _thickness(path, files),
        tuple(hole for name, text in files.items() if _kind(text) == "drill" for hole in _holes(name, text)),
        named(components, path),
        outline_notes(corners, straight),
    )  # fmt: skip


def _files(path: Path) -> dict[Path, str]:
    """Return the texts of all files of a folder that can be text."""
    if not path.is_dir():
        raise EcadError(path, "there is no such folder")
    names = sorted(name for name in path.iterdir() if name.is_file() and not name.name.startswith("."))
    if len(names) > MOST_FILES:
        raise EcadError(path, f"has {len(names)} files, allowed: up to {MOST_FILES}")
    found = {}
    for name in names:
        try:
            found[name] = text_of(name)
        except EcadError as error:
            if not isinstance(error.__cause__, UnicodeDecodeError):  # pictures and archives beside the board
                raise
    return found


def _kind(text: str) -> str:
    """Return what a file is: Gerber, drill, job (JSON), or nothing of interest."""
    if "%FS" in text:
        return "gerber"
    if text.lstrip().startswith("M48"):
        return "drill"
    return "job" if text.lstrip().startswith("{") else ""


def _gerber(path: Path, text: str) -> "GerberFile":
    from gerbonara import GerberFile

    if not text.rstrip().endswith(("M02*", "M00*")):
        raise EcadError(path, "ends too early: its last command is not M02*")
    return _parsed(path, GerberFile, text)


def _parsed(path: Path, kind: Any, text: str) -> Any:
    """Read a file by gerbonara, whose readers raise anything where a file is damaged."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = kind.from_string(text)
    except RecursionError as error:
        raise EcadError(path, "is nested too deeply") from error
    except Exception as error:
        raise EcadError(path, f"cannot be read: {str(error) or type(error).__name__}") from error
    if len(found.objects) > MOST_ITEMS:
        raise EcadError(path, f"has {len(found.objects)} objects, allowed: up to {MOST_ITEMS}")
    return found


def _point(item: Any, x: str, y: str) -> Point:
    """Return a point of an object of gerbonara [m]."""
    scale = MILLI if str(item.unit) == "mm" else 25.4 * MILLI
    return scale * getattr(item, x), scale * getattr(item, y)


def _outline(profile: "GerberFile") -> tuple[list[Point], bool]:
    """Return the points of what is drawn [m], and whether it is straight."""
    points: list[Point] = []
    straight = True
    for item in profile.objects:
        if not hasattr(item, "x1"):
            continue
        ends = _point(item, "x1", "y1"), _point(item, "x2", "y2")
        if hasattr(item, "clockwise"):
            offset = _point(item, "cx", "cy")  # from its start
            centre = (ends[0][0] + offset[0], ends[0][1] + offset[1])
            points += arc_about(centre, *ends, clockwise=item.clockwise)
            straight = False
        else:
            points += ends
    return points, straight


def _components(by_function: dict[tuple, tuple[Path, "GerberFile"]], side: str) -> Iterator[Component]:
    """Yield the components on a side: flashes of its copper with the attribute ``.P`` (reference, pin)."""
    copper = next(
        (found for function, found in by_function.items() if function[:1] + function[2:3] == ("Copper", side)), None
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
    for reference, found in pads.items():
        yield Component(reference, "", "top" if side == "Top" else "bottom", tuple(found))


def _openings(mask: "tuple[Path, GerberFile] | None") -> dict[tuple[int, int], float]:
    """Return the diameters [m] of a mask's openings by where they are."""
    if mask is None:
        return {}
    path, gerber = mask
    return {_cell(_point(item, "x", "y")): _diameter(path, item) for item in gerber.objects if hasattr(item, "x")}


def _cell(at: Point) -> tuple[int, int]:
    return round(at[0] / SAME), round(at[1] / SAME)


def _diameter(path: Path, item: Any) -> float:
    """Return the diameter [m] of a circle as large as a flash."""
    aperture = item.aperture
    if aperture is None:
        raise EcadError(path, "has a flash without an aperture")
    scale = MILLI if str(aperture.unit or item.unit) == "mm" else 25.4 * MILLI
    if hasattr(aperture, "diameter"):
        return scale * checked_number(path, "an aperture", aperture.diameter, 1e3)
    if hasattr(aperture, "w"):
        return scale * round_diameter(SHAPES.get(type(aperture).__name__, "rect"), aperture.w, aperture.h)
    (x0, y0), (x1, y1) = aperture.bounding_box(aperture.unit or item.unit)
    return scale * round_diameter("rect", x1 - x0, y1 - y0)


def _holes(path: Path, text: str) -> Iterator[Hole]:
    """Yield the holes of a drill file but those of vias."""
    from gerbonara import ExcellonFile

    if not text.rstrip().endswith(("M30", "M00")):
        raise EcadError(path, "ends too early: its last command is not M30")
    tools = _functions_of_tools(text)
    for item in _parsed(path, ExcellonFile, text).objects:
        if hasattr(item, "x"):
            scale = MILLI if str(item.unit) == "mm" else 25.4 * MILLI
            diameter = scale * checked_number(path, "a tool", item.aperture.diameter, 1e3)
            if not any(VIA in function and abs(diameter - size) < SAME for size, function in tools):
                yield Hole(_point(item, "x", "y"), diameter)


def _functions_of_tools(text: str) -> list[tuple[float, str]]:
    """Return diameter [m] and function of the tools of a drill file, as X2 comments above them say."""
    found, function, scale = [], "", MILLI
    for line in text.splitlines():
        if line.startswith("INCH"):
            scale = 25.4 * MILLI
        if "TA.AperFunction" in line:
            function = line
        elif line.startswith("T") and "C" in line:
            size = line.partition("C")[2].split("F")[0].split("S")[0]
            with_size = size.replace(".", "", 1).isdigit()
            found += [(scale * float(size), function)] if with_size else []
        elif line.startswith("%"):
            break
    return found


def _thickness(path: Path, files: dict[Path, str]) -> float | None:
    """Return the board's thickness [m] from a Gerber job file, if there is one."""
    for name, text in files.items():
        if _kind(text) == "job":
            try:
                value = json.loads(text)["GeneralSpecs"]["BoardThickness"]
            except (ValueError, KeyError, TypeError, RecursionError):
                continue
            return MILLI * checked_number(name, "BoardThickness", value, 100.0)
    return None
