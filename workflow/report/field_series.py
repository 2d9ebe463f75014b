"""Fields of a run at its stored times, from the ``.pvd`` series of its models: all models as one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.workflow.report.scene import kept_frames

SAME_PLACE = 1e-9  # m; ranks write their nodes each
CORNERS = {8: 8, 4: 4, 10: 4}  # of a cell with so many nodes
DISPLACEMENT = "displacement"
MOST_BYTES = 400_000_000  # of files that are read


@dataclass(frozen=True, slots=True)
class FieldSeries:
    """Cells and fields of all models of a run.

    Attributes:
        points: ``(n, 3)`` at rest [m].
        cells: ``(c, 8)`` or ``(c, 4)`` corners.
        times: ``(k,)`` [s], or numbers of natural modes.
        displacement: ``(k, n, 3)`` [m].
        fields: name -> ``(k, c)``.
    """

    points: Floats
    cells: NDArray[np.int64]
    times: Floats
    displacement: Floats
    fields: Mapping[str, Floats]

    @classmethod
    def read(cls, paths: Sequence[Path], names: Sequence[str] = (), shown: float = 0.0) -> "FieldSeries":
        """Read the series of the models of a run: all times, or of large files as many as take some seconds to read.

        Args:
            paths: ``.pvd`` file of each model; of the others the states next to the times of the first.
            names: of the cell fields that are read, where they are there.
            shown: time [s] whose state is read in any case.
        """
        stored = [_steps(path) for path in paths]
        times = np.array([time for time, _ in stored[0]])
        files = [[file for series in stored for file in _next_to(time, series)] for time in times]
        size = max(sum(file.stat().st_size for file in here) for here in files)
        kept = kept_frames(len(times), MOST_BYTES // size, int(np.argmin(np.abs(times - shown))))
        times, files = times[kept], [files[step] for step in kept]
        pieces = [_Piece.read(file) for file in files[0]]
        counts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
        points = np.concatenate([piece.points for piece in pieces])
        own = [piece.cells[piece.is_own] + count for piece, count in zip(pieces, counts, strict=False)]
        _, first, place = np.unique(np.rint(points / SAME_PLACE), axis=0, return_index=True, return_inverse=True)
        displacement = np.empty((len(times), len(first), 3))
        fields: dict[str, list[Floats]] = {name: [] for name in names}
        for step, here in enumerate(files):
            found = [_arrays(file, (DISPLACEMENT, *names)) for file in here]
            displacement[step] = np.concatenate([one[DISPLACEMENT].reshape(-1, 3) for one in found])[first]
            for name, values in fields.items():
                if all(name in one for one in found):
                    cells = [one[name][piece.is_own] for one, piece in zip(found, pieces, strict=True)]
                    values.append(np.concatenate(cells))
        whole = {name: np.array(values) for name, values in fields.items() if len(values) == len(times)}
        return cls(points[first], place.ravel()[np.concatenate(own)], times, displacement, whole)

    def nearest(self, time: float) -> int:
        """Return the number of the stored time next to a time [s]."""
        return int(np.argmin(np.abs(self.times - time)))

    def at(self, times: Floats) -> "FieldSeries":
        """Return the states next to other times ``(m,)`` [s]."""
        rows = [self.nearest(time) for time in times]
        fields = {name: values[rows] for name, values in self.fields.items()}
        return FieldSeries(self.points, self.cells, times, self.displacement[rows], fields)


@dataclass(frozen=True, slots=True)
class _Piece:
    """What one rank has written: points, corners of its cells, and which of these are not those of another rank."""

    points: Floats
    cells: NDArray[np.int64]
    is_own: NDArray[np.bool_]

    @classmethod
    def read(cls, path: Path) -> "_Piece":
        root = ElementTree.parse(path).getroot()
        points = _numbers(root.find(".//Points/DataArray")).reshape(-1, 3)
        connectivity = _numbers(root.find(".//Cells/DataArray[@Name='connectivity']")).astype(np.int64)
        count = len(_numbers(root.find(".//Cells/DataArray[@Name='offsets']")))
        cells = connectivity.reshape(count, -1)
        ghost = root.find(".//CellData/DataArray[@Name='vtkGhostType']")
        is_own = np.ones(count, dtype=bool) if ghost is None else _numbers(ghost) == 0
        return cls(points, cells[:, : CORNERS[cells.shape[1]]], is_own)


def _steps(path: Path) -> list[tuple[float, list[Path]]]:
    """Return the times of a series, and the files of all ranks at each."""
    sets = ElementTree.parse(path).getroot().iter("DataSet")
    return [(float(one.attrib["timestep"]), _pieces(path.with_name(one.attrib["file"]))) for one in sets]


def _next_to(time: float, series: Sequence[tuple[float, list[Path]]]) -> list[Path]:
    """Return the files of the state of a series next to a time [s]."""
    return min(series, key=lambda step: abs(step[0] - time))[1]


def _pieces(path: Path) -> list[Path]:
    if path.suffix == ".vtu":
        return [path]
    return [path.with_name(piece.attrib["Source"]) for piece in ElementTree.parse(path).getroot().iter("Piece")]


def _arrays(path: Path, names: Sequence[str]) -> dict[str, Floats]:
    """Read arrays on points and cells, those that are there."""
    root = ElementTree.parse(path).getroot()
    found = {name: root.find(f".//DataArray[@Name='{name}']") for name in names}
    return {name: _numbers(element) for name, element in found.items() if element is not None}


def _numbers(element: ElementTree.Element | None) -> Floats:
    """Return the numbers that an element holds as text."""
    if element is None or element.get("format", "ascii") != "ascii":
        raise ValueError("a series of fields has arrays that are not written as text")
    return np.fromstring(element.text or "", dtype=float, sep=" ")
