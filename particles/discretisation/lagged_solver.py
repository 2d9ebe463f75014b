"""Base of solvers whose preconditioner is reused until a solve takes many iterations."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scipy import sparse


@dataclass(slots=True)
class LaggedSolver:
    """Solver with the preconditioner of an earlier matrix.

    It keeps that matrix, so that a run restarted from a checkpoint continues with the same bits.

    Attributes:
        origin: Matrix that the preconditioner was built for.
        iterations: Number of iterations of the last solve.
    """

    origin: sparse.csr_matrix | None = None
    iterations: int = 0
    _solver: Any = field(default=None, repr=False)

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps; the preconditioner follows from the matrix."""
        origin = self.origin
        rows = None if origin is None else {name: getattr(origin, name) for name in ("data", "indices", "indptr")}
        return {"origin": rows, "iterations": self.iterations}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        rows, self.iterations, self._solver, self.origin = saved["origin"], saved["iterations"], None, None
        if rows is not None:
            count = len(rows["indptr"]) - 1
            self.origin = sparse.csr_matrix((rows["data"], rows["indices"], rows["indptr"]), shape=(count, count))
