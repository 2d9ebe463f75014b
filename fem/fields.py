"""Fields for ParaView: displacement, and per cell von Mises stress and part."""

from pathlib import Path

import dolfinx.fem
import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem import dolfinx_api
from fem.body import Body
from fem.stress import von_mises
from fem.stress_recovery import StressRecovery


class Fields:
    """A time series of one model's fields.

    Attributes:
        peaks: Part -> largest von Mises stress [Pa] of a local element at the times written so far.
    """

    def __init__(self, comm: MPI.Comm, body: Body, part: NDArray[np.integer], path: Path) -> None:
        """Open ``path`` (``.pvd``) for the model on ``comm``; ``part (ne,)`` numbers the parts of the local cells."""
        mesh = body.local.mesh
        space, cells = dolfinx_api.vector_space(mesh), dolfinx_api.cell_space(mesh)
        self._displacement = dolfinx.fem.Function(space, name="displacement")
        self._von_mises = dolfinx.fem.Function(cells, name="von_mises")
        self._part = dolfinx.fem.Function(cells, name="part")
        self._part.x.array[dolfinx_api.cell_dofs(cells)[:, 0]] = part
        self._cell_dofs = dolfinx_api.cell_dofs(cells)[:, 0]
        # Vertices of a cell have the same order in geometry and dofmap, whatever their numbers.
        self._dofs, first = np.unique(dolfinx_api.cell_dofs(space), return_index=True)
        self._nodes = body.local.cells.ravel()[first]
        self._recovery = StressRecovery(body, np.arange(len(body.elements.cells)))
        self._file = dolfinx_api.FieldFile(comm, path)
        self._local_part = part
        self.peaks = dict.fromkeys(np.unique(part).tolist(), 0.0)

    def values(self, displacement: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what there is to write now, at a displacement ``(n, 3)`` [m]: it at dofs, and stresses ``(ne,)``."""
        return displacement[self._nodes], von_mises(self._recovery.stress(displacement))

    def write(self, values: tuple[NDArray[np.float64], NDArray[np.float64]], time: float) -> None:
        """Append values of a time [s]; collective over the model."""
        displacement, stress = values
        self._displacement.x.array.reshape(-1, 3)[self._dofs] = displacement
        self._von_mises.x.array[self._cell_dofs] = stress
        for part, peak in self.peaks.items():
            self.peaks[part] = max(peak, float(stress[self._local_part == part].max()))
        self._file.write([self._displacement, self._von_mises, self._part], time)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
