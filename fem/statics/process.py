"""A heated structure in a process of its own, apart from the MPI and the memory of what reflows the joints.

The process is one rank: its factor is needed once and its solutions take a fraction of a second. It starts to factor
at once, and is waited for when it is asked for the first time. It ends with its parent, however that ends.
"""

import multiprocessing
import os
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.parallel.own_job import end_with_parent, own_environment
from reflowshock.fem.statics.state import Assembly, HeatedState, RigidModes

GRACE = 5.0  # seconds that the process has to end when it is told to


class StructureError(RuntimeError):
    """The structure cannot be built or solved, or its process has ended."""


class StructureProcess:
    """``state.Structure`` in a process of its own; a context that ends it."""

    def __init__(self, assembly: Assembly) -> None:
        """Start to read and to factor."""
        context = multiprocessing.get_context("spawn")
        self._pipe, end = context.Pipe()
        self._process = context.Process(target=_serve, args=(end, assembly), name="structure", daemon=True)
        self._process.start()
        end.close()
        self._built: tuple[NDArray[np.float64], NDArray[np.bool_], RigidModes] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def points(self) -> NDArray[np.float64]:
        """Return the nodes ``(n, 3)`` [m] as drawn; this and all below wait for the factor and raise StructureError."""
        return self._ready()[0]

    @property
    def package(self) -> NDArray[np.bool_]:
        """Return ``(n,)``: whether a node belongs to the package."""
        return self._ready()[1]

    @property
    def rigid_modes(self) -> RigidModes:
        """Return the free rigid motions of the package."""
        return self._ready()[2]

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state at a temperature [K], see ``state.Structure``."""
        self._ready()
        try:
            self._pipe.send((temperature, corner, wrenches, rigid))
        except OSError as error:
            raise self._ended() from error
        state: HeatedState = self._answer()
        return state

    def close(self) -> None:
        """End the process."""
        self._pipe.close()
        self._process.join(GRACE)
        if self._process.is_alive():  # it factors, and hears nothing
            self._process.terminate()
            self._process.join()

    def _ready(self) -> tuple[NDArray[np.float64], NDArray[np.bool_], RigidModes]:
        if self._built is None:
            self._built = self._answer()
        return self._built

    def _answer(self) -> Any:
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            raise self._ended() from error
        if isinstance(answer, str):
            raise StructureError(answer)
        return answer

    def _ended(self) -> StructureError:
        self._process.join(GRACE)
        code = self._process.exitcode
        killed = ": it was killed, as the system does when memory is short" if code == -9 else ""
        return StructureError(f"the process of the structure has ended with exit code {code}{killed}")


def _serve(pipe: Connection, assembly: Assembly) -> None:
    """Build the structure and answer until the other end closes the pipe; errors are answered as text."""
    threading.Thread(target=end_with_parent, daemon=True).start()
    own = own_environment(os.environ)
    os.environ.clear()
    os.environ.update(own)
    from mpi4py import MPI  # starts MPI, in an environment of its own

    from reflowshock.fem.statics.structure import ThermalStructure

    with suppress(EOFError, BrokenPipeError):
        try:
            structure = ThermalStructure.build(MPI.COMM_SELF, assembly)
        except Exception as error:  # whatever it is, the parent must hear of it
            pipe.send(str(error))
            return
        pipe.send((structure.points, structure.package, structure.rigid_modes))
        while True:
            loads = pipe.recv()
            try:
                pipe.send(structure.solve(*loads))
            except ValueError as error:
                pipe.send(str(error))
