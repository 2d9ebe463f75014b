"""Warpage of package and board at solidification: map, profile along the diagonal, load steps."""

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

SAME_HEIGHT = 1e-8  # [m] tolerance for nodes of a flat face
SAMPLES = 121  # points of a profile
VIEW = (-0.8, -1.8, 0.5)
FACES = ("package underside", "board top face")


@dataclass(frozen=True, slots=True)
class Face:
    """A face that is flat at the reference temperature.

    Attributes:
        points: Nodes, shape (n, 3) [m].
        lift: Displacement of the nodes along z, shape (n,) [m].
    """

    points: Floats
    lift: Floats

    @classmethod
    def of_nodes(cls, points: Floats, displacement: Floats) -> "Face":
        """Return the face through nodes, shape (n, 3) [m], without duplicates."""
        _, first = np.unique(np.round(points[:, :2], 9), axis=0, return_index=True)
        return cls(points[first], displacement[first, 2])

    def at(self, x: Floats, y: Floats) -> Floats:
        """Return the interpolated lift at points of the face [m]; NaN outside it."""
        from scipy.interpolate import LinearNDInterpolator

        return np.asarray(LinearNDInterpolator(self.points[:, :2], self.lift)(x, y))

    def triangles(self) -> NDArray[np.integer]:
        """Return the Delaunay triangles of the nodes, shape (t, 3)."""
        from scipy.spatial import Delaunay

        return Delaunay(self.points[:, :2]).simplices

    @property
    def over_centre(self) -> Floats:
        """Lift relative to the node nearest to the axis, shape (n,) [m]."""
        return self.lift - self.lift[np.argmin(np.hypot(*self.points[:, :2].T))]

    @property
    def warpage(self) -> float:
        """Difference between highest and lowest lift [m]."""
        return float(np.ptp(self.lift))


def faces(structure: Mapping[str, NDArray]) -> tuple[Face, Face]:
    """Return the underside of the package and the top face of the board below it, with their lifts at solidification.

    Args:
        structure: Arrays of ``reflow/structure.npz``: nodes ``points`` and ``displacement``, shape (n, 3) [m], and
            ``package``, mask of its nodes, shape (n,).

    Returns:
        Both faces with their nodes, shape (n, 3), and lifts along z, shape (n,) [m].
    """
    points, displacement, package = (structure[name] for name in ("points", "displacement", "package"))
    under = package & (points[:, 2] <= points[package, 2].min() + SAME_HEIGHT)
    reach = np.abs(points[under, :2]).max(axis=0) * 1.02 + SAME_HEIGHT
    top = ~package & (np.abs(points[:, 2]) <= SAME_HEIGHT) & (np.abs(points[:, :2]) <= reach).all(axis=1)
    return Face.of_nodes(points[under], displacement[under]), Face.of_nodes(points[top], displacement[top])


def warpage_scene(structure: Mapping[str, NDArray], joints: Sequence[Mapping[str, Any]]) -> Scene:
    """Return both faces with their lift relative to the centre, and the positions of the joints between them.

    Args:
        structure: Arrays of ``reflow/structure.npz``: nodes ``points`` and ``displacement``, shape (n, 3) [m],
            ``package`` (mask), ``temperature``, shape (steps,) [K], ``pad_motion``, shape (steps, joints, 2, 6) [m,
            rad], and residuals per step.
        joints: Records with ``x``, ``y`` [m] and, optionally, ``name``.

    Returns:
        Interactive 3D scene for the report page.
    """
    warped = faces(structure)
    largest = max(float(np.abs(face.over_centre).max()) for face in warped)
    groups = []
    for index, (face, name) in enumerate(zip(warped, FACES, strict=True)):
        moved = np.zeros((1, len(face.points), 3))
        moved[0, :, 2] = face.over_centre
        part = np.full(len(face.points), index)
        groups.append(Group(name, face.points, face.triangles(), part, displacement=moved))
    height = 0.5 * sum(float(face.points[:, 2].mean()) for face in warped)
    places = np.array([[joint["x"], joint["y"], height] for joint in joints])
    numbers = len(FACES) + np.arange(len(joints))
    size = 0.03 * float(np.ptp(warped[0].points[:, 0]))
    groups.append(Group("joints", places, np.zeros((0, 3), int), numbers, size=size))
    return Scene(
        groups,
        [*(f"{name}: {face.warpage / MICRO:.1f} µm" for face, name in zip(warped, FACES, strict=True)),
         *(joint.get("name", "joint") for joint in joints)],
        [Field("lift relative to the centre", "µm", -largest / MICRO, largest / MICRO, "diverging", "lift", 1 / MICRO)],
        exaggeration=exaggeration(float(np.ptp(warped[0].points[:, 0])), largest),
        view=VIEW,
    )  # fmt: skip


def profiles(structure: Mapping[str, NDArray]) -> list[Chart]:
    """Return two charts: lift of board and package along the package diagonal, and joint gaps over temperature.

    Args:
        structure: Arrays of ``reflow/structure.npz``: nodes ``points`` and ``displacement``, shape (n, 3) [m],
            ``package`` (mask), ``temperature``, shape (steps,) [K], and ``pad_motion``, shape (steps, joints, 2, 6) [m,
            rad].

    Returns:
        Interactive charts for the report page.
    """
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
        Chart(
            Axis("distance from the centre along the diagonal [mm]"), Axis("lift relative to the centre [µm]"), lines
        ),
        Chart(Axis("temperature [°C]"), Axis("change of the gap [µm]"), gaps),
    ]


def load_steps(structure: Mapping[str, NDArray]) -> dict:
    """Return the table of load steps of a coupled reflow.

    Args:
        structure: Arrays of ``reflow/structure.npz``, one row per load step: ``temperature`` [K],
            ``corner_displacement`` [m], ``pad_motion`` (steps, joints, 2, 6) [m, rad], ``iterations``,
            ``force_residual`` and ``rigid_residual``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text), one row per load step: temperature, corner
        motion, changes of gaps, coupling iterations and residuals; quantities that are zero throughout have no column.
    """
    columns = [
        ("temperature [°C]", structure["temperature"] - KELVIN, ".1f"),
        ("corner motion [µm]", structure["corner_displacement"] / MICRO, "+.2f"),
        *((f"gap change, {name} [µm]", change / MICRO, "+.2f") for name, change in _extremes(structure)),
        ("coupling iterations", structure["iterations"], ".0f"),
        ("relative force change", structure["force_residual"], ".2e"),
        ("force imbalance of the package", structure["rigid_residual"], ".2e"),
    ]
    used = [column for column in columns if np.any(column[1])]
    rows = [
        [str(step + 1), *(f"{values[step]:{form}}" for _, values, form in used)]
        for step in range(len(structure["temperature"]))
    ]
    return {"head": ["load step", *(head for head, _, _ in used)], "rows": rows}


def in_words(structure: Mapping[str, NDArray]) -> str:
    """Return a sentence on the warpage of package and board and the change of the gaps at solidification.

    Args:
        structure: Arrays of ``reflow/structure.npz``: nodes ``points`` and ``displacement``, shape (n, 3) [m],
            ``package`` (mask), ``temperature``, shape (steps,) [K], ``pad_motion``, shape (steps, joints, 2, 6) [m,
            rad], and residuals per step.
    """
    package, board = faces(structure)
    gaps = relative_lift(structure)[-1] / MICRO
    above, below = package.warpage / MICRO, board.warpage / MICRO
    return (
        f"At solidification ({number(structure['temperature'][-1] - KELVIN)} °C) the warpage is {above:.1f} µm for the"
        f" package underside and {below:.1f} µm for the board below it; the gaps of the joints differ from the drawing"
        f" by {gaps.min():+.1f} to {gaps.max():+.1f} µm."
    )


def relative_lift(structure: Mapping[str, NDArray]) -> Floats:
    """Return the change of the gap of each joint: lift of its package pad minus lift of its board pad.

    Args:
        structure: Arrays of ``reflow/structure.npz``: nodes ``points`` and ``displacement``, shape (n, 3) [m],
            ``package`` (mask), ``temperature``, shape (steps,) [K], ``pad_motion``, shape (steps, joints, 2, 6) [m,
            rad], and residuals per step; ``pad_motion`` has shape (steps, joints, 2, 6), board pad first.

    Returns:
        Change of the gap from the drawing, shape (steps, joints) [m].
    """
    motion = structure["pad_motion"]
    return motion[:, :, 1, 2] - motion[:, :, 0, 2]


def read_structure(run_folder: Path) -> dict[str, NDArray] | None:
    """Return the arrays of ``reflow/structure.npz``; None if the reflow had no structure.

    Args:
        run_folder: Run folder with the product of the reflow.

    Returns:
        Arrays by name: ``points`` and ``displacement``, shape (n, 3) [m]; ``package``, mask of its nodes;
        ``temperature``, shape (steps,) [K]; ``pad_motion``, shape (steps, joints, 2, 6); residuals per step. None if
        there is no file.
    """
    path = run_folder / "reflow/structure.npz"
    if not path.exists():
        return None
    with np.load(path) as arrays:
        return dict(arrays)


def _extremes(structure: Mapping[str, NDArray]) -> list[tuple[str, Floats]]:
    """Return the joints with the smallest and the largest change of the gap: name and change per load step [m]."""
    change, names = relative_lift(structure), structure["joints"]
    ends = dict.fromkeys((int(np.argmin(change[-1])), int(np.argmax(change[-1]))))
    return [(str(names[column]), change[:, column]) for column in ends]


def _diagonal(face: Face) -> tuple[Floats, Floats, Floats]:
    """Return x, y and the signed distance from the centre of points along the diagonal of a face [m]."""
    lower = np.minimum([*face.points[:, :2].min(axis=0)], 0.0)
    upper = face.points[:, :2].max(axis=0)
    share = np.linspace(-1.0 if lower.any() else 0.0, 1.0, SAMPLES)
    return share * upper[0], share * upper[1], share * float(np.hypot(*upper))
