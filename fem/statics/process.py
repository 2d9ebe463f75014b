"""A heated structure in a process of its own, apart from the MPI and the memory of what reflows the joints.

The process is one rank: its factor is needed once and its solutions take a fraction of a second. It starts to factor
at once, and is waited for when it is asked for the first time. It ends with its parent, however that ends.
"""

import os
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.parallel.own_job import own_environment
from reflowshock.fem.statics.state import Assembly, HeatedState, RigidModes
from reflowshock.processes import ProcessPool

if TYPE_CHECKING:
    from reflowshock.fem.statics.structure import ThermalStructure

Answer = TypeVar("Answer")


class StructureError(RuntimeError):
    """The structure cannot be built or solved, or its process has ended."""


class StructureProcess:
    """``state.Structure`` in a process of its own; a context that ends it."""

    def __init__(self, assembly: Assembly) -> None:
        """Start to read and to factor."""
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
        """Return the nodes ``(n, 3)`` [m] as drawn; this and all below wait for the factor and raise StructureError."""
        return self._answer(self._built)[0]

    @property
    def package(self) -> NDArray[np.bool_]:
        """Return ``(n,)``: whether a node belongs to the package."""
        return self._answer(self._built)[1]

    @property
    def rigid_modes(self) -> RigidModes:
        """Return the free rigid motions of the package."""
        return self._answer(self._built)[2]

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state at a temperature [K], see ``state.Structure``."""
        self._answer(self._built)
        return self._answer(self._pool.submit(_solve, temperature, corner, wrenches, rigid))

    def _answer(self, future: Future[Answer]) -> Answer:
        try:
            return future.result()
        except BrokenProcessPool as error:
            raise StructureError(f"the process of the structure has ended with {self._pool.ending()}") from error
        except Exception as error:  # whatever it is there, it is the structure's
            raise StructureError(str(error)) from error


_structure: "ThermalStructure"  # of the process that has built it


def _build(assembly: Assembly) -> tuple[NDArray[np.float64], NDArray[np.bool_], RigidModes]:
    """Build the structure, and keep it for `_solve`."""
    global _structure
    own = own_environment(os.environ)
    os.environ.clear()
    os.environ.update(own)
    from mpi4py import MPI  # starts MPI, in an environment of its own

    from reflowshock.fem.statics.structure import ThermalStructure

    _structure = ThermalStructure.build(MPI.COMM_SELF, assembly)
    return _structure.points, _structure.package, _structure.rigid_modes


def _solve(temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]) -> HeatedState:
    return _structure.solve(temperature, corner, wrenches, rigid)
