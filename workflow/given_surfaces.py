"""Joints whose surfaces the user gives, as files: where these are, and what does not fit."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from fem.names import nearest
from workflow.problems import Problem

if TYPE_CHECKING:
    from meshing.parameters import Package

KEY = "package.surfaces"


def located(table: dict, folder: Path) -> dict:
    """Take files of surfaces in the table of a case as relative to the folder of the case file."""
    package = table.get("package")
    surfaces = package.get("surfaces") if isinstance(package, dict) else None
    if isinstance(surfaces, dict):
        for name, path in surfaces.items():
            surfaces[name] = str((folder / path).resolve()) if isinstance(path, str) else path
    return table


def files(package: "Package") -> dict[str, Path]:
    """Return dotted key -> file."""
    return {f"{KEY}.{name}": Path(path) for name, path in package.surfaces.items()}


def problems(package: "Package", joints: Iterable[str]) -> Iterator[Problem]:
    """Find surfaces of joints that there are not, and files that are missing or of no known format."""
    from meshing.user_surface import SUFFIXES

    names = list(joints)
    for name, text in package.surfaces.items():
        path = Path(text)
        if name not in names:
            hint = nearest(name, names)
            yield Problem(f"{KEY}.{name}", "is no joint of the model", None, f"{names[0]} to {names[-1]}", hint)
        if path.suffix.lower() not in SUFFIXES:
            yield Problem(f"{KEY}.{name}", "has no format that is read", text, ", ".join(SUFFIXES))
        elif not path.is_file():
            yield Problem(f"{KEY}.{name}", "there is no such file", text)
