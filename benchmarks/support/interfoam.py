"""Axisymmetric bodies in OpenFOAM's interFoam (Debian package openfoam): a wedge of one layer of cells."""

import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

CASE = Path(__file__).parents[1] / "interfoam"
HALF_WEDGE = np.radians(2.5)
NUMBERS = re.compile(r"List<scalar>\s*\d+\s*\((.*?)\)\s*;", re.DOTALL)
VECTORS = re.compile(r"List<vector>\s*\d+\s*\((.*?)\)\s*;", re.DOTALL)
CLOCK = re.compile(r"^Time = (\S+)$.*?^ExecutionTime = (\S+) s", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Wedge:
    """Square cells of a width [m], with the numbers of columns (radius) and rows (axis)."""

    cell: float
    columns: int
    rows: int

    @property
    def edges(self) -> np.ndarray:
        """Radii [m] of circles whose sectors have the areas of the flat wedges, shape (columns + 1,)."""
        return self.cell * np.sqrt(np.sin(2.0 * HALF_WEDGE) / (2.0 * HALF_WEDGE)) * np.arange(self.columns + 1)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of ``blockMeshDict``."""
        across, aside = (self.columns * self.cell * turn(HALF_WEDGE) for turn in (np.cos, np.sin))
        sides = {"across": across, "aside": aside, "back": -aside, "height": self.rows * self.cell}
        return sides | {"columns": self.columns, "rows": self.rows}

    def radii(self, alpha: np.ndarray) -> np.ndarray:
        """Return radii [m] of discs with the liquid volume of each row, shape (rows,), from its volume fractions."""
        return np.sqrt((alpha * np.diff(self.edges**2)).sum(axis=1))


@dataclass(frozen=True, slots=True)
class State:
    """Fields at one written time.

    Attributes:
        time: Time [s].
        seconds: Run time so far [s].
        alpha: Volume fractions of the liquid, shape (rows, columns).
        speed: Speed [m/s], shape (rows, columns).
    """

    time: float
    seconds: float
    alpha: np.ndarray
    speed: np.ndarray


def run_case(folder: Path, wedge: Wedge, parameters: Mapping[str, Any], start: str) -> str:
    """Mesh, initialise and run the case in a folder; return the log of interFoam.

    Args:
        folder: Empty folder.
        wedge: Size and numbers of cells.
        parameters: Further parameters that the case includes.
        start: Regions of ``setFieldsDict`` with their values.
    """
    shutil.copytree(CASE, folder, dirs_exist_ok=True)
    shutil.copytree(folder / "0.orig", folder / "0")
    values = wedge.parameters | dict(parameters)
    lines = [f"{name} {value if isinstance(value, str) else format(value, '.12g')};" for name, value in values.items()]
    (folder / "parameters").write_text("\n".join(lines) + "\n")
    (folder / "start").write_text(f"regions (\n{start}\n);\n")
    for command in ("blockMesh", "setFields"):
        _openfoam(command, folder)
    return _openfoam("interFoam", folder)


def _openfoam(command: str, folder: Path) -> str:
    """Run an OpenFOAM command in a folder with the settings of the share folder; return its log."""
    installed = Path(shutil.which(command)).parent.parent / "share" / "openfoam"
    surroundings = {"WM_PROJECT_DIR": str(installed)} | dict(os.environ)
    return subprocess.run([command], cwd=folder, env=surroundings, check=True, capture_output=True, text=True).stdout


def read_states(folder: Path, log: str, wedge: Wedge) -> Iterator[State]:
    """Yield time, run time, volume fractions and speeds at each written time, in order.

    Args:
        folder: Folder in which ``run_case`` ran.
        log: Log of interFoam, which ``run_case`` returned.
        wedge: Size and numbers of cells.
    """
    clock = {float(time): float(seconds) for time, seconds in CLOCK.findall(log)}
    times, shape = np.array(sorted(clock)), (wedge.rows, wedge.columns)
    for path in sorted((path for path in folder.iterdir() if _is_time(path.name)), key=lambda path: float(path.name)):
        time = float(path.name)
        alpha = np.fromstring(NUMBERS.search((path / "alpha.solder").read_text())[1], sep=" ").reshape(shape)
        words = VECTORS.search((path / "U").read_text())[1].replace("(", " ").replace(")", " ")
        speed = np.linalg.norm(np.fromstring(words, sep=" ").reshape(-1, 3), axis=1).reshape(shape)
        yield State(time, clock[times[np.abs(times - time).argmin()]], alpha, speed)


def read_version(log: str) -> str:
    """Return the version (build) of OpenFOAM that a log of interFoam names."""
    return re.search(r"^Build\s*:\s*(.+)$", log, re.MULTILINE)[1]


def _is_time(name: str) -> bool:
    """Return whether a folder holds a written time after the start."""
    return re.fullmatch(r"[0-9.e-]+", name) is not None and float(name) > 0.0
