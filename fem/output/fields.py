"""Field files for ParaView: nodal displacement, and cell values of von Mises stress, strains and part."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import dolfinx.fem
import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.fem.parallel.checkpoint_state import Rows, Same, State


@dataclass(frozen=True, slots=True)
class FieldSample:
    """Fields of one rank at one time.

    Attributes:
        time: Time [s].
        displacement: Nodal displacement, shape (n, 3) [m].
        cells: Values of each cell field, shape (ne,).
    """

    time: float
    displacement: NDArray[np.float64]
    cells: dict[str, NDArray[np.float64]]


class Fields:
    """Field file of one model, a time series.

    Attributes:
        peaks: Largest local value of each cell field in each part over the times written so far.
    """

    def __init__(self, comm: MPI.Comm, body: Body, part: NDArray[np.integer], path: Path, yields: bool = False) -> None:
        """Open the file of a model; collective.

        Args:
            comm: Communicator of the model.
            body: Model on this rank.
            part: Part number of each local cell, shape (ne,).
            path: Path of the ``.pvd`` file.
            yields: Whether to write the plastic strain, the same on all ranks.
        """
        mesh = body.local.mesh
        space, cells = dolfinx_api.vector_space(mesh), dolfinx_api.cell_space(mesh)
        names = ("von_mises", "neglected_strain", *(("plastic_strain",) if yields else ()))
        self._displacement = dolfinx.fem.Function(space, name="displacement")
        self._cell_functions = {name: dolfinx.fem.Function(cells, name=name) for name in names}
        self._part = dolfinx.fem.Function(cells, name="part")
        self._cell_dofs = dolfinx_api.cell_dofs(cells)[:, 0]
        self._part.x.array[self._cell_dofs] = part
        # Geometry and dofmap list the vertices of a cell in the same order.
        self._dofs, first = np.unique(dolfinx_api.cell_dofs(space), return_index=True)
        self._nodes = body.local.cells.ravel()[first]
        self._recovery = StressRecovery(body, np.arange(len(body.elements.cells)))
        self._file = dolfinx_api.FieldFile(comm, path)
        self._local, self._local_part = body.local, part
        self.peaks = {name: dict.fromkeys(np.unique(part).tolist(), 0.0) for name in names}

    def sample(self, displacement: NDArray[np.float64], time: float) -> FieldSample:
        """Return the fields at a displacement, shape (n, 3) [m], and a time [s]."""
        cells = {
            "von_mises": von_mises(self._recovery.stress(displacement)),
            "neglected_strain": self._recovery.neglected_strain(displacement),
        }
        if "plastic_strain" in self._cell_functions:
            cells["plastic_strain"] = self._recovery.plastic_strain()
        return FieldSample(time, displacement.copy(), cells)

    def state(self, sample: FieldSample) -> State:
        """Return a sample as checkpoint state."""
        cells = {name: Rows(self._local.cell_numbers, value) for name, value in sample.cells.items()}
        return {"time": Same(sample.time), "displacement": Rows(self._local.nodes, sample.displacement), "cells": cells}

    def write(self, sample: FieldSample) -> None:
        """Append a sample; collective over the model."""
        self._displacement.x.array.reshape(-1, 3)[self._dofs] = sample.displacement[self._nodes]
        for name, function in self._cell_functions.items():
            values, peaks = sample.cells[name], self.peaks[name]
            function.x.array[self._cell_dofs] = values
            for part, peak in peaks.items():
                peaks[part] = max(peak, float(values[self._local_part == part].max()))
        self._file.write([self._displacement, *self._cell_functions.values(), self._part], sample.time)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def element_peaks(world: MPI.Comm, files: Iterable[Fields], parts: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return the largest value of each cell field in each part, over all models and field samples; collective.

    Args:
        world: Communicator of all ranks.
        files: Field files of this rank's models, at least one.
        parts: Names of all parts, in the order of their indices.

    Returns:
        Field name -> part name -> largest value in SI units, 0 for a part without cells.
    """
    all_peaks = [file.peaks for file in files]
    return {
        field: {
            name: world.allreduce(max(peaks[field].get(part, 0.0) for peaks in all_peaks), MPI.MAX)
            for part, name in enumerate(parts)
        }
        for field in all_peaks[0]
    }
