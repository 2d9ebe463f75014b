"""Joint surfaces given by the user as files: paths, checks, measures."""

import math
from collections.abc import Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.names import find_nearest
from reflowshock.problem import Problem
from reflowshock.workflow.case.toml_file import resolved_path

if TYPE_CHECKING:
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.meshing.board.parameters import Package

KEY = "package.surfaces"


def located(table: dict, folder: Path) -> dict:
    """Resolve, in place, the surface files of a case's tables relative to the folder of its file; return the tables.

    Args:
        table: All tables of the case file, nested as in TOML; without surfaces nothing changes.
        folder: Folder of the case file.
    """
    package = table.get("package")
    surfaces = package.get("surfaces") if isinstance(package, dict) else None
    if isinstance(surfaces, dict):
        for name, path in surfaces.items():
            surfaces[name] = resolved_path(folder, path) if isinstance(path, str) else path
    return table


def files(package: "Package") -> dict[str, Path]:
    """Return the surface files that the user gives for joints.

    Args:
        package: Package of the case.

    Returns:
        Dotted key ``package.surfaces.<joint>`` -> path; empty without given surfaces.
    """
    return {f"{KEY}.{name}": Path(path) for name, path in package.surfaces.items()}


def problems(package: "Package", pads: "Sequence[PadSite]", heated: bool) -> Iterator[Problem]:
    """Yield problems of surfaces for unknown joints, and of files without a surface that fits the joint.

    Args:
        package: Package with the names of existing files.
        pads: Pad table as drawn.
        heated: Whether pads move before solidification, so that only the reflow knows the height of a joint.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
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
            hint = find_nearest(name, names)
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
    """Return records of the joints with given surfaces, as the reflow writes them.

    Args:
        package: Package with the names of the files.
        pads: Pad table.
        reflowed: Joints that already have a record.

    Returns:
        Record of each joint that has a given surface and no record yet: ``given`` (file), ``place`` (position of the
        package's pad relative to the board's), ``verdict`` "given", ``metrics``.

    Raises:
        SurfaceError: A surface does not fit its joint.
    """
    from reflowshock.meshing.surface.closed_surface import measure
    from reflowshock.meshing.surface.user_surface import load_surface

    records = {}
    for pad in (pad for pad in pads if pad.name in package.surfaces and pad.name not in reflowed):
        path = package.surfaces[pad.name]
        measures = measure(load_surface(Path(path), package.surface_unit, pad))
        records[pad.name] = {
            "given": path,
            "place": {"gap": pad.gap, "offset": pad.offset, "tilt": pad.tilt},
            "verdict": "given",
            "metrics": {name: _metric(name, value) for name, value in measures.items()},
        }
    return records


def _metric(name: str, value: float) -> dict:
    """Return a measure of a surface as a metric, in the unit of the reflow metrics."""
    if "angle" in name:
        return {"value": math.degrees(value), "unit": "deg"}
    return {"value": value, "unit": "m^3" if name == "volume" else "m"}
