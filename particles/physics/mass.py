"""Mass of the particles: the operator of every step, and the momentum that inertia carries from step to step."""

from dataclasses import dataclass

from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.discretisation.discretisation import Discretisation


@dataclass(frozen=True, slots=True)
class Mass:
    """Mass. Without `Inertia` beside it, it only damps: velocity is force times dt over mass.

    Attributes:
        density: [kg/m^3].
    """

    density: float

    def matrix(self, _body: Body, space: Discretisation, time_step: float) -> sparse.csr_matrix:
        """M / dt, `(3 n, 3 n)` [kg/s]."""
        return sparse.kron(sparse.identity(3), self.density / time_step * space.mass, format="csr")


@dataclass(frozen=True, slots=True)
class Inertia:
    """Momentum of the last step.

    Attributes:
        density: [kg/m^3].
    """

    density: float

    def load(self, body: Body, space: Discretisation, time_step: float) -> Floats:
        """M v_n / dt, `(n, 3)` [N]."""
        return self.density / time_step * (space.mass @ body.velocity)
