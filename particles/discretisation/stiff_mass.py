"""Masses and implicit surface tension, what a change of the velocity in a step has to overcome, factored."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from reflowshock.arrays import Floats

# Symmetric, positive definite, and sparse as a surface is: no pivots, an ordering of the graph.
ORDER = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}


@dataclass(frozen=True, slots=True)
class StiffMass:
    """Masses and implicit surface tension of d velocities, m / dt + dt P^T K P, K of the first s.

    P takes out the rigid motions R, orthonormal by the masses: P^T K P = K - m R^T R K - K R^T R m + m R^T R K R^T R m.

    Attributes:
        inertia: m / dt `(d,)` [kg/s].
        factors: of m / dt + dt K, `(s, s)`.
        across: `(d, 2 k)` columns m R^T and K R^T.
        moved: `(d, 2 k)` these, solved for.
        core: `(2 k, 2 k)` of Woodbury's formula.
    """

    inertia: Floats
    factors: SuperLU
    across: Floats
    moved: Floats
    core: Floats

    @classmethod
    def of(cls, masses: Floats, stiffness: sparse.sparray, rigid: Floats, time_step: float) -> "StiffMass":
        """Factor masses `(d,)` [kg] and stiffness `(s, s)` [N/m] with rigid motions `(k, d)`, for a time step [s]."""
        inertia, size, count = masses / time_step, stiffness.shape[0], len(rigid)
        factors = splu((sparse.diags(inertia[:size]) + time_step * stiffness).tocsc(), **ORDER)
        pull = np.zeros_like(rigid)
        pull[:, :size] = (stiffness @ rigid[:, :size].T).T
        across = np.concatenate((masses * rigid, pull)).T
        bare = cls(inertia, factors, across[:, :0], across[:, :0], np.zeros((0, 0)))
        moved, unit = bare.solve(across), np.eye(count)
        inner = np.block([[np.zeros((count, count)), -unit], [-unit, -pull @ rigid.T]]) / time_step
        return cls(inertia, factors, across, moved, np.linalg.inv(inner + across.T @ moved))

    def solve(self, load: Floats) -> Floats:
        """Velocities `(d,)` or `(d, l)` that loads reach in a time step."""
        size = self.factors.shape[0]
        first = (load.T / self.inertia).T
        first[:size] = self.factors.solve(load[:size])
        return first - self.moved @ (self.core @ (self.across.T @ first))
