"""Warpage of package and board when the solder froze: maps, a profile along the diagonal, and how it came about."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.fem.problem.thermal import KELVIN
from reflowshock.workflow.case.text import number
from reflowshock.workflow.report.bodies import exaggeration
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLUE, ORANGE, RED
from reflowshock.workflow.report.curves import MICRO, MILLI
from reflowshock.workflow.report.scene import Field, Group, Scene

SAME_HEIGHT = 1e-8  # m; nodes of a flat face lie within it
SAMPLES = 121  # of the profile
VIEW = (-0.8, -1.8, 0.5)
FACES = ("package, underside", "board, top face")


@dataclass(frozen=True, slots=True)
class Face:
    """A face that was flat at the reference temperature.

    Attributes:
        points: ``(n, 3)`` its nodes [m].
        lift: ``(n,)`` their displacement along z [m].
    """

    points: Floats
    lift: Floats

    @classmethod
    def of_nodes(cls, points: Floats, displacement: Floats) -> "Face":
        """Return the face through nodes ``(n, 3)`` [m]; those of the same place once."""
        _, first = np.unique(np.round(points[:, :2], 9), axis=0, return_index=True)
        return cls(points[first], displacement[first, 2])

    def at(self, x: Floats, y: Floats) -> Floats:
        """Return the lift at places of the face [m]; nan beside it."""
        from scipy.interpolate import LinearNDInterpolator

        return np.asarray(LinearNDInterpolator(self.points[:, :2], self.lift)(x, y))

    def triangles(self) -> NDArray[np.integer]:
        """Return triangles ``(t, 3)`` of its nodes."""
        from scipy.spatial import Delaunay

        return Delaunay(self.points[:, :2]).simplices

    @property
    def over_centre(self) -> Floats:
        """Lift over that of the node next to the axis ``(n,)`` [m]."""
        return self.lift - self.lift[np.argmin(np.hypot(*self.points[:, :2].T))]

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


def warpage_scene(structure: Mapping[str, NDArray], joints: Sequence[Mapping[str, Any]]) -> Scene:
    """Return both faces, each with its lift over its own centre, and the places of the joints between them."""
    found = faces(structure)
    largest = max(float(np.abs(face.over_centre).max()) for face in found)
    groups = []
    for place, (face, name) in enumerate(zip(found, FACES, strict=True)):
        moved = np.zeros((1, len(face.points), 3))
        moved[0, :, 2] = face.over_centre
        part = np.full(len(face.points), place)
        groups.append(Group(name, face.points, face.triangles(), part, displacement=moved))
    height = 0.5 * sum(float(face.points[:, 2].mean()) for face in found)
    places = np.array([[joint["x"], joint["y"], height] for joint in joints])
    numbers = len(FACES) + np.arange(len(joints))
    size = 0.03 * float(np.ptp(found[0].points[:, 0]))
    groups.append(Group("joints", places, np.zeros((0, 3), int), numbers, size=size))
    return Scene(
        groups,
        [*(f"{name}: {face.warpage / MICRO:.1f} µm" for face, name in zip(found, FACES, strict=True)),
         *(joint.get("name", "joint") for joint in joints)],
        [Field("lift over the centre", "µm", -largest / MICRO, largest / MICRO, "diverging", "lift", 1 / MICRO)],
        exaggeration=exaggeration(float(np.ptp(found[0].points[:, 0])), largest),
        view=VIEW,
    )  # fmt: skip


def profiles(structure: Mapping[str, NDArray]) -> list[Chart]:
    """Return the lift of both faces along the package's diagonal, and the gaps over the temperature of each step."""
    package, board = faces(structure)
    x, y, along = _diagonal(package)
    lines = []
    for face, name, colour in ((package, FACES[0], BLUE), (board, FACES[1], ORANGE)):
        lift = face.at(x, y)
        lines.append(Series(name, along / MILLI, (lift - lift[np.argmin(np.abs(along))]) / MICRO, colour))
    order = np.argsort(structure["temperature"], kind="stable")
    celsius = (structure["temperature"] - KELVIN)[order]
    gaps = [
        Series(f"joint {name}", celsius, change[order] / MICRO, colour, marks=True)
        for (name, change), colour in zip(_extremes(structure), (BLUE, RED), strict=False)
    ]
    return [
        Chart(Axis("distance from the centre along the diagonal [mm]"), Axis("lift over the centre [µm]"), lines),
        Chart(Axis("temperature [°C]"), Axis("change of the gap [µm]"), gaps),
    ]


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


def _diagonal(face: Face) -> tuple[Floats, Floats, Floats]:
    """Return places x, y along the diagonal of a face, and their distance from the centre, signed [m]."""
    lower = np.minimum([*face.points[:, :2].min(axis=0)], 0.0)
    upper = face.points[:, :2].max(axis=0)
    share = np.linspace(-1.0 if lower.any() else 0.0, 1.0, SAMPLES)
    return share * upper[0], share * upper[1], share * float(np.hypot(*upper))
