"""Mass of the particles: the operator of every step, and the momentum that inertia carries from step to step."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from particles.body import Body
from particles.mls import Derivatives

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mass:
    """Lumped mass. Without `Inertia` beside it, it only damps: velocity is force times dt over mass.

    Attributes:
        density: [kg/m^3].
    """

    density: float

    def matrix(self, body: Body, _stencils: Derivatives, time_step: float) -> sparse.csr_matrix:
        """Diagonal M / dt, `(3 n, 3 n)` [kg/s]."""
        return sparse.diags(np.tile(self.density * body.volumes / time_step, 3), format="csr")


@dataclass(frozen=True, slots=True)
class Inertia:
    """Momentum of the last step.

    Attributes:
        density: [kg/m^3].
    """

    density: float

    def load(self, body: Body, time_step: float) -> Floats:
        """M v_n / dt, `(n, 3)` [N]."""
        return (self.density * body.volumes / time_step)[:, None] * body.velocity
