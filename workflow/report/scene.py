"""Scenes of a page: bodies in 3D that the browser turns, with fields at some times."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats

if TYPE_CHECKING:
    from reflowshock.workflow.report.page_data import PageData

MOST_TRIANGLES = 100_000  # of a scene
MOST_VALUES = 1_200_000  # vertices times frames: what keeps a page below 12 MB
FINEST = 65_535  # steps of a value or a coordinate
COARSER = 1.3  # by which the cells grow that merge vertices
HEXAHEDRON = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
MILLI = 1e-3


@dataclass(frozen=True, slots=True)
class Field:
    """What colours show.

    Attributes:
        name, unit: of the values.
        low, high: values at the ends of the scale; what is beyond has the colour of its end.
        scale: one of ``SCALES``.
        source: "values" of the groups, or "lift" or "length" of their displacement.
        factor: from metres to the unit, for what the displacement gives.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: str = "sequential"
    source: str = "values"
    factor: float = 1.0

    def record(self) -> dict:
        """Return what the script draws."""
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
    """Bodies that are shown, or not, together.

    Attributes:
        name: of the group.
        points: ``(n, 3)`` [m].
        faces: ``(f, 3)`` or ``(f, 4)`` vertices; ``(0, 3)`` draws the points as small balls.
        part: ``(n,)`` number of the body in ``Scene.parts`` that a vertex belongs to.
        colour: without a field.
        displacement: ``(frames, n, 3)`` [m]; None for none.
        values: name of a field -> ``(frames, n)`` or, the same in all frames, ``(1, n)``; nan where there is none.
        is_ghost: whether it begins as one sees through it.
        only: the frame in which alone it is shown; None for all.
        size: of the balls [m].
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
        """How many triangles it takes."""
        return len(self.faces) * (self.faces.shape[1] - 2)


@dataclass(frozen=True, slots=True)
class Scene:
    """Bodies in 3D.

    Attributes:
        groups: the bodies.
        parts: name of each body.
        fields: what colours may show, the first one at the beginning.
        frames: label of each frame.
        start: the frame that is shown first.
        exaggeration: how many times as large displacements are drawn at first.
        view: direction towards the eye.
        labels: text and place [m] of what is written.
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
        """Return what the script draws, lengths in mm."""
        groups = [group for group in decimated(self.groups) if len(group.points)]
        always = sum(len(group.points) for group in groups if group.only is None)
        frames = kept_frames(len(self.frames), MOST_VALUES // max(always, 1), self.start)
        return {
            "groups": [_record(group, self.fields, frames, page) for group in groups],
            "parts": list(self.parts),
            "fields": [one.record() for one in self.fields],
            "frames": [self.frames[frame] for frame in frames],
            "start": frames.index(self.start),
            "exaggeration": self.exaggeration,
            "view": list(self.view),
            "labels": [{"text": text, "at": [value / MILLI for value in at]} for text, at in self.labels],
        }


def boundary(cells: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the faces that only one of some cells has.

    Args:
        cells: ``(c, 8)`` hexahedra or ``(c, 4)`` tetrahedra.

    Returns:
        The faces ``(f, 4)`` or ``(f, 3)``, and the cell of each.
    """
    local = HEXAHEDRON if cells.shape[1] == 8 else TETRAHEDRON
    faces = cells[:, local].reshape(-1, local.shape[1]).astype(np.int64)
    ordered = np.sort(faces, axis=1)
    span = int(ordered.max(initial=0)) + 1
    keys = ordered[:, 0] * span * span + ordered[:, 1] * span + ordered[:, 2]  # three vertices tell a face
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    chosen = np.sort(first[count == 1])
    return faces[chosen], chosen // len(local)


def decimated(groups: Sequence[Group], most: int = MOST_TRIANGLES) -> list[Group]:
    """Return groups of at most so many triangles: the finest ones are made coarser, each by the same share."""
    total = sum(group.triangles for group in groups)
    if total <= most:
        return list(groups)
    small = [group for group in groups if group.triangles <= most // (4 * len(groups))]
    left = most - sum(group.triangles for group in small)
    share = left / (total - sum(group.triangles for group in small))
    return [group if group in small else _coarser(group, int(share * group.triangles)) for group in groups]


def _coarser(group: Group, most: int) -> Group:
    """Merge the vertices of a group that lie in the same cell of a grid, the grid as fine as the count allows."""
    size = float(np.ptp(group.points, axis=0).max()) / np.sqrt(max(most, 4))
    while True:
        grid = np.floor((group.points - group.points.min(axis=0)) / size).astype(np.int64)
        keys = np.column_stack([grid, group.part])
        _, kept, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        faces = _proper(place.ravel()[_as_triangles(group.faces)])
        if len(faces) <= most:
            break
        size *= COARSER
    return replace(
        group,
        points=group.points[kept],
        faces=faces,
        part=group.part[kept],
        displacement=None if group.displacement is None else group.displacement[:, kept],
        values={name: values[:, kept] for name, values in group.values.items()},
    )


def _proper(triangles: NDArray[np.integer]) -> NDArray[np.integer]:
    """Leave out triangles that have become lines or points, and all but one of those that have become the same."""
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    return triangles[np.sort(first)]


def _as_triangles(faces: NDArray[np.integer]) -> NDArray[np.integer]:
    return faces if faces.shape[1] == 3 else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


def kept_frames(frames: int, most: int, start: int) -> list[int]:
    """Return at most so many of the frames, but one at least, evenly spread, the one that is shown first among them."""
    kept = sorted({round(place) for place in np.linspace(0, frames - 1, min(frames, max(most, 1)))})
    nearest = min(range(len(kept)), key=lambda k: abs(kept[k] - start))
    return sorted({*kept[:nearest], start, *kept[nearest + 1 :]})


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
        "values": [_values(group, one, frames, page) for one in fields],
    }
    if group.displacement is not None and np.any(group.displacement):
        moved = group.displacement[frames] / MILLI
        scale = float(np.abs(moved).max()) / 32_767
        record["displacement"] = {"scale": scale, "data": page.array(np.rint(moved / scale), "i2")}
    return record


def _values(group: Group, shown: Field, frames: list[int], page: "PageData") -> int | None:
    """Keep the values of a field as steps from the lower to the upper end of its scale, 1 to ``FINEST``; 0: none."""
    values = group.values.get(shown.name)
    if values is None:
        return None
    values = values[frames] if len(values) > 1 else values
    share = np.clip((values - shown.low) / ((shown.high - shown.low) or 1.0), 0.0, 1.0)
    return page.array(np.where(np.isnan(share), 0.0, 1.0 + np.rint(share * (FINEST - 1))), "u2")
