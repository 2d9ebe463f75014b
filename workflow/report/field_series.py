"""Fields of a run at its stored times, merged from the ``.pvd`` series of all models."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.workflow.report.scene import kept_frames

SAME_POINT = 1e-9  # [m] tolerance for nodes that several ranks write
CORNERS = {8: 8, 4: 4, 10: 4}  # corners of a cell by its number of nodes
DISPLACEMENT = "displacement"
MOST_BYTES = 400_000_000  # limit of the files that are read


@dataclass(frozen=True, slots=True)
class FieldSeries:
    """Cells and fields of all models of a run.

    Attributes:
        points: Nodes at rest, shape (n, 3) [m].
        cells: Corner nodes of the cells, shape (c, 8) or (c, 4).
        times: Stored times, shape (k,) [s], or numbers of natural modes.
        displacement: Displacement of the nodes, shape (k, n, 3) [m].
        fields: Cell fields, shape (k, c).
    """

    points: Floats
    cells: NDArray[np.int64]
    times: Floats
    displacement: Floats
    fields: Mapping[str, Floats]

    @classmethod
    def read(cls, paths: Sequence[Path], names: Sequence[str] = (), shown: float = 0.0) -> "FieldSeries":
        """Read the series of all models of a run; of large files only some times.

        Args:
            paths: ``.pvd`` file of each model; the times are those of the first model.
            names: Cell fields to read, if present.
            shown: Time [s] whose state is always read.
        """
        stored = [_steps(path) for path in paths]
        times = np.array([time for time, _ in stored[0]])
        files = [[file for series in stored for file in _next_to(time, series)] for time in times]
        size = max(sum(file.stat().st_size for file in here) for here in files)
        steps = kept_frames(len(times), MOST_BYTES // size, int(np.argmin(np.abs(times - shown))))
        times, files = times[steps], [files[step] for step in steps]
        pieces = [_Piece.read(file) for file in files[0]]
        counts = np.cumsum([0, *(len(piece.points) for piece in pieces)])
        points = np.concatenate([piece.points for piece in pieces])
        cells = [piece.cells[piece.is_own] + count for piece, count in zip(pieces, counts, strict=False)]
        _, first, number = np.unique(np.rint(points / SAME_POINT), axis=0, return_index=True, return_inverse=True)
        displacement = np.empty((len(times), len(first), 3))
        fields: dict[str, list[Floats]] = {name: [] for name in names}
        for step, here in enumerate(files):
            arrays = [_arrays(file, (DISPLACEMENT, *names)) for file in here]
            displacement[step] = np.concatenate([table[DISPLACEMENT].reshape(-1, 3) for table in arrays])[first]
            for name, values in fields.items():
                if all(name in table for table in arrays):
                    owned = [table[name][piece.is_own] for table, piece in zip(arrays, pieces, strict=True)]
                    values.append(np.concatenate(owned))
        whole = {name: np.array(values) for name, values in fields.items() if len(values) == len(times)}
        return cls(points[first], number.ravel()[np.concatenate(cells)], times, displacement, whole)

    def nearest(self, time: float) -> int:
        """Return the index of the stored time nearest to a time [s]."""
        return int(np.argmin(np.abs(self.times - time)))

    def at(self, times: Floats) -> "FieldSeries":
        """Return the states nearest to other times, shape (m,) [s]."""
        rows = [self.nearest(time) for time in times]
        fields = {name: values[rows] for name, values in self.fields.items()}
        return FieldSeries(self.points, self.cells, times, self.displacement[rows], fields)


@dataclass(frozen=True, slots=True)
class _Piece:
    """Points and cells written by one rank, and whether it owns each cell."""

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
    return [(float(item.attrib["timestep"]), _pieces(path.with_name(item.attrib["file"]))) for item in sets]


def _next_to(time: float, series: Sequence[tuple[float, list[Path]]]) -> list[Path]:
    """Return the files of the state of a series nearest to a time [s]."""
    return min(series, key=lambda step: abs(step[0] - time))[1]


def _pieces(path: Path) -> list[Path]:
    if path.suffix == ".vtu":
        return [path]
    return [path.with_name(piece.attrib["Source"]) for piece in ElementTree.parse(path).getroot().iter("Piece")]


def _arrays(path: Path, names: Sequence[str]) -> dict[str, Floats]:
    """Read the named arrays on points and cells that the file contains."""
    root = ElementTree.parse(path).getroot()
    elements = {name: root.find(f".//DataArray[@Name='{name}']") for name in names}
    return {name: _numbers(element) for name, element in elements.items() if element is not None}


def _numbers(element: ElementTree.Element | None) -> Floats:
    """Return the numbers in the text of an XML element."""
    if element is None or element.get("format", "ascii") != "ascii":
        raise ValueError("arrays of a field series must be in format ascii")
    return np.fromstring(element.text or "", dtype=float, sep=" ")
