"""Joints whose surfaces the user gives, as files: where these are, and what does not fit."""

import math
from collections.abc import Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.names import nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.toml_file import beside

if TYPE_CHECKING:
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.meshing.board.parameters import Package

KEY = "package.surfaces"


def located(table: dict, folder: Path) -> dict:
    """Take files of surfaces in the table of a case as relative to the folder of the case file."""
    package = table.get("package")
    surfaces = package.get("surfaces") if isinstance(package, dict) else None
    if isinstance(surfaces, dict):
        for name, path in surfaces.items():
            surfaces[name] = beside(folder, path) if isinstance(path, str) else path
    return table


def files(package: "Package") -> dict[str, Path]:
    """Return dotted key -> file."""
    return {f"{KEY}.{name}": Path(path) for name, path in package.surfaces.items()}


def problems(package: "Package", pads: "Sequence[PadSite]", heated: bool) -> Iterator[Problem]:
    """Find surfaces of joints that there are not, and files that hold no surface that fits its joint.

    Args:
        package: names their files, which are there.
        pads: the pad table, as drawn.
        heated: whether pads move before the joints freeze: how high a joint is then, only the reflow finds.
    """
    if not package.surfaces:
        return
    from reflowshock.meshing.surface.closed_surface import SurfaceError
    from reflowshock.meshing.surface.user_surface import SUFFIXES, closed_triangles, load_surface

    sites = {pad.name: pad for pad in pads}
    for name, text in package.surfaces.items():
        key, path = f"{KEY}.{name}", Path(text)
        if name not in sites:
            names = list(sites)
            hint = nearest(name, names)
            yield Problem(key, "is not a joint of the model", None, f"{names[0]} to {names[-1]}", hint)
        if path.suffix.lower() not in SUFFIXES:
            yield Problem(key, "has an unknown file format", text, ", ".join(SUFFIXES))
        elif name in sites:
            try:
                if heated:
                    closed_triangles(path, package.surface_unit)
                else:
                    load_surface(path, package.surface_unit, sites[name])
            except SurfaceError as error:
                yield Problem(key, str(error).removeprefix(f"surface of joint {name}, {path}: "), text)


def given_records(package: "Package", pads: "Iterable[PadSite]", reflowed: Container[str]) -> dict[str, dict]:
    """Measure the given surfaces in their places.

    Args:
        package: names their files.
        pads: the pad table.
        reflowed: joints that have a record already.

    Returns:
        Joint name -> ``given`` (its file), ``place``, ``verdict`` "given", ``metrics`` as those of a reflow.

    Raises:
        SurfaceError: a surface that does not fit.
    """
    from reflowshock.meshing.surface.closed_surface import measure
    from reflowshock.meshing.surface.user_surface import load_surface

    records = {}
    for pad in (pad for pad in pads if pad.name in package.surfaces and pad.name not in reflowed):
        path = package.surfaces[pad.name]
        found = measure(load_surface(Path(path), package.surface_unit, pad))
        records[pad.name] = {
            "given": path,
            "place": {"gap": pad.gap, "offset": pad.offset, "tilt": pad.tilt},
            "verdict": "given",
            "metrics": {name: _metric(name, value) for name, value in found.items()},
        }
    return records


def _metric(name: str, value: float) -> dict:
    """Return a measure of a surface in the unit that the reflow tells it in."""
    if "angle" in name:
        return {"value": math.degrees(value), "unit": "deg"}
    return {"value": value, "unit": "m^3" if name == "volume" else "m"}
