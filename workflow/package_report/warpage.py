"""Warpage of package and board when the solder froze: maps, a profile along the diagonal, and how it came about."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.tri import LinearTriInterpolator, Triangulation
from numpy.typing import NDArray

from reflowshock.fem.problem.thermal import KELVIN
from reflowshock.workflow.case.text import number
from reflowshock.workflow.report.curves import MICRO, MILLI, STYLE, svg

Floats = NDArray[np.float64]

SAME_HEIGHT = 1e-8  # m; nodes of a flat face lie within it
SAMPLES = 121  # of the profile
LEVELS = 12  # of a map
PACKAGE, BOARD = "#0b5fa5", "#e09f3e"


@dataclass(frozen=True, slots=True)
class Face:
    """A face that was flat at the reference temperature.

    Attributes:
        triangles: of its nodes [m].
        lift: ``(n,)`` their displacement along z [m].
    """

    triangles: Triangulation
    lift: Floats

    @classmethod
    def of_nodes(cls, points: Floats, displacement: Floats) -> "Face":
        """Return the face through nodes ``(n, 3)`` [m]; those of the same place once."""
        _, first = np.unique(np.round(points[:, :2], 9), axis=0, return_index=True)
        return cls(Triangulation(points[first, 0], points[first, 1]), displacement[first, 2])

    def at(self, x: Floats, y: Floats) -> Floats:
        """Return the lift at places of the face [m]; nan beside it."""
        return np.asarray(LinearTriInterpolator(self.triangles, self.lift)(x, y).filled(np.nan))

    @property
    def warpage(self) -> float:
        """Highest minus lowest lift [m]."""
        return float(np.ptp(self.lift))


def faces(structure: Mapping[str, NDArray]) -> tuple[Face, Face]:
    """Return the package's underside, and the board's top face below it.

    Args:
        structure: arrays of ``reflow/structure.npz``.
    """
    points, displacement, package = (structure[name] for name in ("points", "displacement", "package"))
    under = package & (points[:, 2] <= points[package, 2].min() + SAME_HEIGHT)
    reach = np.abs(points[under, :2]).max(axis=0) * 1.02 + SAME_HEIGHT
    top = ~package & (np.abs(points[:, 2]) <= SAME_HEIGHT) & (np.abs(points[:, :2]) <= reach).all(axis=1)
    return Face.of_nodes(points[under], displacement[under]), Face.of_nodes(points[top], displacement[top])


def warpage_maps(structure: Mapping[str, NDArray], joints: Sequence[Mapping[str, Any]]) -> str:
    """Draw the lift of both faces as contours, each over its value at the centre, with the joints marked."""
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(1, 2, figsize=(9.2, 4.0), constrained_layout=True)
        names = ("package, underside", "board, top face")
        for axis, face, name in zip(axes, faces(structure), names, strict=True):
            _draw_face(axis, face, joints)
            axis.set_title(f"{name}: {face.warpage / MICRO:.1f} µm", fontsize=9)
        return svg(figure)


def profiles(structure: Mapping[str, NDArray]) -> str:
    """Draw the lift of both faces along the package's diagonal, and the gaps over the temperature of each step."""
    with pyplot.rc_context(STYLE):
        figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.2, 3.3), constrained_layout=True)
        package, board = faces(structure)
        x, y, along = _diagonal(package)
        for face, label, colour in ((package, "package, underside", PACKAGE), (board, "board, top face", BOARD)):
            lift = face.at(x, y)
            left.plot(along / MILLI, (lift - lift[np.argmin(np.abs(along))]) / MICRO, color=colour, label=label)
        left.set(xlabel="distance from the centre along the diagonal [mm]", ylabel="lift over the centre [µm]")
        left.legend(frameon=False)
        _draw_gaps(right, structure)
        return svg(figure)


def load_steps(structure: Mapping[str, NDArray]) -> dict:
    """One row a load step: temperature, corner motion, gaps, iterations, residual."""
    columns = [
        ("temperature [degC]", structure["temperature"] - KELVIN, ".1f"),
        ("corner motion [µm]", structure["corner_displacement"] / MICRO, "+.2f"),
        *((f"gap change, {name} [µm]", change / MICRO, "+.2f") for name, change in _extremes(structure)),
        ("exchanges", structure["iterations"], ".0f"),
        ("forces change by", structure["force_residual"], ".2e"),
        ("package out of balance by", structure["rigid_residual"], ".2e"),
    ]
    used = [column for column in columns if np.any(column[1])]
    rows = [
        [str(step + 1), *(f"{values[step]:{form}}" for _, values, form in used)]
        for step in range(len(structure["temperature"]))
    ]
    return {"head": ["load step", *(head for head, _, _ in used)], "rows": rows}


def in_words(structure: Mapping[str, NDArray]) -> str:
    """Say how far package and board have warped, and by how much the gaps differ for it."""
    package, board = faces(structure)
    gaps = relative_lift(structure)[-1] / MICRO
    above, below = package.warpage / MICRO, board.warpage / MICRO
    return (
        f"When the solder freezes, at {number(structure['temperature'][-1] - KELVIN)} °C, the package's underside is"
        f" warped by {above:.1f} µm, the board below it by {below:.1f} µm; the gaps of the joints are {gaps.min():+.1f}"
        f" to {gaps.max():+.1f} µm from those as drawn."
    )


def relative_lift(structure: Mapping[str, NDArray]) -> Floats:
    """Return by how much the gap of each joint has changed, ``(steps, joints)`` [m]."""
    motion = structure["pad_motion"]
    return motion[:, :, 1, 2] - motion[:, :, 0, 2]


def read_structure(run_folder: Path) -> dict[str, NDArray] | None:
    """Read what the reflow left of the structure; None where it had none."""
    path = run_folder / "reflow/structure.npz"
    if not path.exists():
        return None
    with np.load(path) as arrays:
        return dict(arrays)


def _extremes(structure: Mapping[str, NDArray]) -> list[tuple[str, Floats]]:
    """Return name and change of the gap, per load step, of the joints whose gaps change least and most [m]."""
    change, names = relative_lift(structure), structure["joints"]
    ends = dict.fromkeys((int(np.argmin(change[-1])), int(np.argmax(change[-1]))))
    return [(str(names[column]), change[:, column]) for column in ends]


def _draw_gaps(axis: Axes, structure: Mapping[str, NDArray]) -> None:
    celsius = structure["temperature"] - KELVIN
    for (name, change), colour in zip(_extremes(structure), (PACKAGE, "#d1495b"), strict=False):
        axis.plot(celsius, change / MICRO, ".-", color=colour, label=f"joint {name}")
    axis.set(xlabel="temperature [°C]", ylabel="change of the gap [µm]")
    axis.legend(frameon=False)


def _draw_face(axis: Axes, face: Face, joints: Sequence[Mapping[str, Any]]) -> None:
    x, y = face.triangles.x / MILLI, face.triangles.y / MILLI
    lift = (face.lift - face.lift[np.argmin(np.hypot(x, y))]) / MICRO
    drawn = axis.tricontourf(x, y, face.triangles.triangles, lift, levels=LEVELS, cmap="viridis")
    axis.plot([joint["x"] / MILLI for joint in joints], [joint["y"] / MILLI for joint in joints], "o", ms=5, mfc="none",
              mec="white", mew=0.9)  # fmt: skip
    axis.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    axis.grid(False)
    axis.figure.colorbar(drawn, ax=axis, label="lift over the centre [µm]")


def _diagonal(face: Face) -> tuple[Floats, Floats, Floats]:
    """Return places x, y along the diagonal of a face, and their distance from the centre, signed [m]."""
    lower = np.minimum([face.triangles.x.min(), face.triangles.y.min()], 0.0)
    upper = np.array([face.triangles.x.max(), face.triangles.y.max()])
    share = np.linspace(-1.0 if lower.any() else 0.0, 1.0, SAMPLES)
    return share * upper[0], share * upper[1], share * float(np.hypot(*upper))
