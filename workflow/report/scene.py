"""Interactive 3D scenes of a report page: bodies with fields at stored times."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats

if TYPE_CHECKING:
    from reflowshock.workflow.report.page_data import PageData

MOST_TRIANGLES = 100_000  # triangles of a scene
MOST_VALUES = 1_200_000  # vertices times frames; keeps a page below 12 MB
FINEST = 65_535  # quantisation steps of a value
COARSER = 1.3  # growth factor of the cells that merge vertices
HEXAHEDRON = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
MILLI = 1e-3


@dataclass(frozen=True, slots=True)
class Field:
    """A field that colours the groups.

    Attributes:
        name: Name of the quantity.
        unit: Unit of the values.
        low: Value at the lower end of the colour scale.
        high: Value at the upper end of the colour scale.
        scale: Colour scale of ``SCALES``.
        source: "values" of the groups, or "lift" (z) or "length" of their displacement.
        factor: Conversion from metres to the unit, for values derived from the displacement.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: str = "sequential"
    source: str = "values"
    factor: float = 1.0

    def record(self) -> dict:
        """Return the record that the script reads."""
        return {
            "label": f"{self.name} [{self.unit}]",
            "unit": self.unit,
            "low": self.low,
            "high": self.high,
            "scale": self.scale,
            "source": self.source,
            "factor": self.factor * MILLI,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Bodies whose visibility is switched together.

    Attributes:
        name: Name of the group.
        points: Vertices, shape (n, 3) [m].
        faces: Vertex numbers of the faces, shape (f, 3) or (f, 4); shape (0, 3) draws the points as spheres.
        part: Index of each vertex's body in ``Scene.parts``, shape (n,).
        colour: Colour without a field.
        displacement: Displacement of the vertices, shape (frames, n, 3) [m]; None for a fixed group.
        values: Values of each field, shape (frames, n), or (1, n) if constant; NaN for missing values.
        is_ghost: Whether the group is transparent at first.
        only: The only frame that shows the group; None for all frames.
        size: Diameter of the spheres [m].
    """

    name: str
    points: Floats
    faces: NDArray[np.integer]
    part: NDArray[np.integer]
    colour: str = "#9aa5b1"
    displacement: Floats | None = None
    values: Mapping[str, Floats] = field(default_factory=dict)
    is_ghost: bool = False
    only: int | None = None
    size: float = 0.0

    @property
    def triangles(self) -> int:
        """Number of triangles of the faces."""
        return len(self.faces) * (self.faces.shape[1] - 2)


@dataclass(frozen=True, slots=True)
class Scene:
    """Bodies in 3D.

    Attributes:
        groups: Groups of bodies.
        parts: Name of each body.
        fields: Selectable fields, the initial one first.
        frames: Label of each frame.
        start: Initial frame.
        exaggeration: Initial scale factor of displacements.
        view: Direction towards the camera.
        labels: Texts with their positions [m].
    """

    groups: Sequence[Group]
    parts: Sequence[str]
    fields: Sequence[Field] = ()
    frames: Sequence[str] = ("",)
    start: int = 0
    exaggeration: float = 1.0
    view: tuple[float, float, float] = (-0.8, -1.8, 0.9)
    labels: Sequence[tuple[str, tuple[float, float, float]]] = ()

    def record(self, page: "PageData") -> dict:
        """Return the record that the script reads, lengths in mm."""
        groups = [group for group in decimate(self.groups) if len(group.points)]
        always = sum(len(group.points) for group in groups if group.only is None)
        frames = kept_frames(len(self.frames), MOST_VALUES // max(always, 1), self.start)
        return {
            "groups": [_record(group, self.fields, frames, page) for group in groups],
            "parts": list(self.parts),
            "fields": [item.record() for item in self.fields],
            "frames": [self.frames[frame] for frame in frames],
            "start": frames.index(self.start),
            "exaggeration": self.exaggeration,
            "view": list(self.view),
            "labels": [{"text": text, "at": [value / MILLI for value in at]} for text, at in self.labels],
        }


def boundary(cells: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the boundary faces of cells.

    Args:
        cells: Hexahedra, shape (c, 8), or tetrahedra, shape (c, 4).

    Returns:
        Faces, shape (f, 4) or (f, 3), and the cell of each face, shape (f,).
    """
    local = HEXAHEDRON if cells.shape[1] == 8 else TETRAHEDRON
    faces = cells[:, local].reshape(-1, local.shape[1]).astype(np.int64)
    ordered = np.sort(faces, axis=1)
    span = int(ordered.max(initial=0)) + 1
    keys = ordered[:, 0] * span * span + ordered[:, 1] * span + ordered[:, 2]  # three vertices identify a face
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    chosen = np.sort(first[count == 1])
    return faces[chosen], chosen // len(local)


def decimate(groups: Sequence[Group], most: int = MOST_TRIANGLES) -> list[Group]:
    """Reduce groups to at most ``most`` triangles, coarsening all but small groups by the same share.

    Args:
        groups: Surfaces of a scene; quadrilaterals count as two triangles.
        most: Largest number of triangles of all groups together.
    """
    total = sum(group.triangles for group in groups)
    if total <= most:
        return list(groups)
    small = [group for group in groups if group.triangles <= most // (4 * len(groups))]
    left = most - sum(group.triangles for group in small)
    share = left / (total - sum(group.triangles for group in small))
    return [group if group in small else _coarser(group, int(share * group.triangles)) for group in groups]


def _coarser(group: Group, most: int) -> Group:
    """Merge the vertices of a group in each cell of a grid that is as fine as the limit allows (vertex clustering)."""
    size = float(np.ptp(group.points, axis=0).max()) / np.sqrt(max(most, 4))
    while True:
        grid = np.floor((group.points - group.points.min(axis=0)) / size).astype(np.int64)
        keys = np.column_stack([grid, group.part])
        _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        faces = _proper(number.ravel()[_as_triangles(group.faces)])
        if len(faces) <= most:
            break
        size *= COARSER
    return replace(
        group,
        points=group.points[first],
        faces=faces,
        part=group.part[first],
        displacement=None if group.displacement is None else group.displacement[:, first],
        values={name: values[:, first] for name, values in group.values.items()},
    )


def _proper(triangles: NDArray[np.integer]) -> NDArray[np.integer]:
    """Remove degenerate and duplicate triangles."""
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    return triangles[np.sort(first)]


def _as_triangles(faces: NDArray[np.integer]) -> NDArray[np.integer]:
    return faces if faces.shape[1] == 3 else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


def kept_frames(frames: int, most: int, start: int) -> list[int]:
    """Return at most ``most`` evenly spaced frame numbers, at least one, that include the initial frame.

    Args:
        frames: Number of frames.
        most: Largest number of frames to keep.
        start: Number of the initial frame, counted from 0.
    """
    frames_kept = sorted({round(position) for position in np.linspace(0, frames - 1, min(frames, max(most, 1)))})
    nearest = min(range(len(frames_kept)), key=lambda k: abs(frames_kept[k] - start))
    return sorted({*frames_kept[:nearest], start, *frames_kept[nearest + 1 :]})


def _record(group: Group, fields: Sequence[Field], frames: list[int], page: "PageData") -> dict:
    record = {
        "name": group.name,
        "colour": group.colour,
        "points": page.array(group.points / MILLI, "f4"),
        "part": page.array(group.part, "u2"),
        "faces": page.array(group.faces, "u4"),
        "corners": group.faces.shape[1],
        "ghost": group.is_ghost,
        "only": None if group.only is None else frames.index(group.only),
        "size": group.size / MILLI,
        "values": [_values(group, item, frames, page) for item in fields],
    }
    if group.displacement is not None and np.any(group.displacement):
        moved = group.displacement[frames] / MILLI
        scale = float(np.abs(moved).max()) / 32_767
        record["displacement"] = {"scale": scale, "data": page.array(np.rint(moved / scale), "i2")}
    return record


def _values(group: Group, field_shown: Field, frames: list[int], page: "PageData") -> int | None:
    """Store the values of a field, quantised from 1 to ``FINEST`` over its colour scale; 0 means missing."""
    values = group.values.get(field_shown.name)
    if values is None:
        return None
    values = values[frames] if len(values) > 1 else values
    share = np.clip((values - field_shown.low) / ((field_shown.high - field_shown.low) or 1.0), 0.0, 1.0)
    return page.array(np.where(np.isnan(share), 0.0, 1.0 + np.rint(share * (FINEST - 1))), "u2")
