"""How the viscosity of a liquid depends on the rate of shear: power law, Carreau. Formulas; no numerical library."""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

SUM_STEPS = 400  # of Simpson's rule, even
HALVINGS = 80


class Rheology(Parameters):
    """A viscosity that depends on the rate of shear, sqrt(2 D : D).

    "power_law": mu = viscosity (rate / shear_rate)^(exponent - 1), at most `bound` times the viscosity and at least it
    over `bound`, since the law itself has no limit. "carreau": mu = mu_inf + (viscosity - mu_inf) (1 + (rate /
    shear_rate)^2)^((exponent - 1) / 2), mu_inf = `viscosity_at_infinity` (Carreau 1972).
    """

    law: Literal["power_law", "carreau"]
    exponent: float = Field(ge=0.2, le=2.0)
    shear_rate: Annotated[float, Quantity("1/s")] = Field(gt=0)
    viscosity_at_infinity: Annotated[float, Quantity("mPa*s")] = Field(0.0, ge=0)
    bound: float = Field(10.0, gt=1, le=1000)

    def viscosity(self, rate: float, viscosity: float) -> float:
        """Return the viscosity [Pa s] at a rate of shear [1/s]; ``viscosity`` is the liquid's in the law [Pa s]."""
        ratio = rate / self.shear_rate
        if self.law == "carreau":
            share = (1.0 + ratio * ratio) ** (0.5 * (self.exponent - 1.0))
            return self.viscosity_at_infinity + (viscosity - self.viscosity_at_infinity) * share
        low, high = (self.bound**power for power in _ends(self.exponent))
        return viscosity * min(max(ratio, low), high) ** (self.exponent - 1.0)

    def largest(self, viscosity: float, rate: float) -> float:
        """Return the largest viscosity up to a rate of shear [Pa s]: at rest, or at that rate."""
        return max(self.viscosity(0.0, viscosity), self.viscosity(rate, viscosity))


def _ends(exponent: float) -> tuple[float, float]:
    """Powers of the bound: rates over that of the law between which a power law is not bounded."""
    if exponent == 1.0:
        return 0.0, 0.0
    reach = 1.0 / abs(exponent - 1.0)
    return -reach, reach


def rate_at_wall(rheology: Rheology, viscosity: float, speed: float, width: float) -> float:
    """Return the rate of shear at the plates of a channel [1/s] in whose middle liquid flows at a speed at last.

    The stress grows linearly from the middle, so that a rate r is at the distance z(r) = w mu(r) r / (2 mu(R) R) from
    it, R being that at the plates; the speed of the middle is the integral of r over z, R w / 2 - integral of z dr.

    Args:
        rheology: of the liquid.
        viscosity: in its law [Pa s].
        speed: of the middle [m/s].
        width: of the channel [m].
    """

    def middle(largest: float) -> float:
        stress = [rheology.viscosity(rate, viscosity) * rate for rate in _even(largest)]
        sum_ = stress[0] + stress[-1] + 4.0 * sum(stress[1::2]) + 2.0 * sum(stress[2:-1:2])
        return 0.5 * width * (largest - sum_ * largest / SUM_STEPS / 3.0 / stress[-1])

    low, high = 0.0, 2.0 * speed / width
    while middle(high) < speed:
        low, high = high, 2.0 * high
    for _ in range(HALVINGS):
        half = 0.5 * (low + high)
        low, high = (half, high) if middle(half) < speed else (low, half)
    return high


def _even(largest: float) -> list[float]:
    return [largest * step / SUM_STEPS for step in range(SUM_STEPS + 1)]
