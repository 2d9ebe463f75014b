"""Momentum-consistent smoothing of velocities (Hu et al., eqs 27-29): dissipates what the approximation cannot show."""

from dataclasses import dataclass

from scipy import sparse

from reflowshock.arrays import Floats

RELAXATION = 0.5


@dataclass(frozen=True, slots=True)
class Velocities:
    """What the smoothing keeps from step to step, `(3 n,)` each, by component [m/s].

    Attributes:
        coefficients: V of the approximation.
        unsmoothed: u of the particles, which carry the momentum.
    """

    coefficients: Floats
    unsmoothed: Floats


def smooth(last: Velocities, coefficients: Floats, smoothing: sparse.csr_matrix) -> Velocities:
    """Velocities after a step, eq 28: u_new = (1 - a) (u + S (V_new - V)) + a S V_new, a = 0.5.

    Args:
        last: velocities before the step.
        coefficients: V_new `(3 n,)` [m/s].
        smoothing: S, `(3 n, 3 n)`.
    """
    kept = last.unsmoothed + smoothing @ (coefficients - last.coefficients)
    return Velocities(coefficients, (1.0 - RELAXATION) * kept + RELAXATION * (smoothing @ coefficients))
