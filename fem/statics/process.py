"""Heated structure in a separate process, isolated from the MPI and the memory of the joint reflow.

The process has one rank, since it factors once and each solution takes a fraction of a second. It starts to factor
immediately; the first request waits for it. It ends with its parent process in any case.
"""

import os
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.fem.statics.state import Assembly, HeatedState, RigidModes
from reflowshock.processes import ProcessPool

if TYPE_CHECKING:
    from reflowshock.fem.statics.structure import ThermalStructure

Answer = TypeVar("Answer")


class StructureError(RuntimeError):
    """Failure to build or solve the structure, or end of its process."""


class StructureProcess:
    """``HeatedStructure`` in a separate process; a context manager that ends the process."""

    def __init__(self, assembly: Assembly) -> None:
        """Start to read the mesh and to factor."""
        self._pool = ProcessPool(1)
        self._built = self._pool.submit(_build, assembly)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.__exit__(kind, error, trace)

    @property
    def points(self) -> NDArray[np.float64]:
        """Nodes in the undeformed state, shape (n, 3) [m]; waits for the factor and may raise ``StructureError``."""
        return self._answer(self._built)[0]

    @property
    def package(self) -> NDArray[np.bool_]:
        """Whether a node belongs to the package, shape (n,)."""
        return self._answer(self._built)[1]

    @property
    def rigid_modes(self) -> RigidModes:
        """Free rigid-body motions of the package."""
        return self._answer(self._built)[2]

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state at a temperature [K], see ``HeatedStructure.solve``."""
        self._answer(self._built)
        return self._answer(self._pool.submit(_solve, temperature, corner, wrenches, rigid))

    def _answer(self, future: Future[Answer]) -> Answer:
        try:
            return future.result()
        except BrokenProcessPool as error:
            raise StructureError(f"the structure's process ended with {self._pool.ending()}") from error
        except Exception as error:  # raised in the process
            raise StructureError(str(error)) from error


_structure: "ThermalStructure"  # set in the separate process by `_build`


def _build(assembly: Assembly) -> tuple[NDArray[np.float64], NDArray[np.bool_], RigidModes]:
    """Build the structure and store it for `_solve`."""
    global _structure
    environment = without_mpi_job(os.environ)
    os.environ.clear()
    os.environ.update(environment)
    from mpi4py import MPI  # starts MPI, outside the job of the parent

    from reflowshock.fem.statics.structure import ThermalStructure

    _structure = ThermalStructure.build(MPI.COMM_SELF, assembly)
    return _structure.points, _structure.package, _structure.rigid_modes


def _solve(temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]) -> HeatedState:
    return _structure.solve(temperature, corner, wrenches, rigid)
