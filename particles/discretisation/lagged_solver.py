"""What solvers keep that are set up anew only when their last use took many iterations."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scipy import sparse


@dataclass(slots=True)
class LaggedSolver:
    """A solver that was set up for an earlier matrix.

    It keeps that matrix, so that a run from a checkpoint continues with the same bits.

    Attributes:
        origin: the matrix that it was set up for.
        iterations: of the last solve.
    """

    origin: sparse.csr_matrix | None = None
    iterations: int = 0
    _solver: Any = field(default=None, repr=False)

    def saved(self) -> dict[str, Any]:
        """All but what follows from the matrix, for a checkpoint."""
        origin = self.origin
        rows = None if origin is None else {name: getattr(origin, name) for name in ("data", "indices", "indptr")}
        return {"origin": rows, "iterations": self.iterations}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
        rows, self.iterations, self._solver, self.origin = saved["origin"], saved["iterations"], None, None
        if rows is not None:
            count = len(rows["indptr"]) - 1
            self.origin = sparse.csr_matrix((rows["data"], rows["indices"], rows["indptr"]), shape=(count, count))
