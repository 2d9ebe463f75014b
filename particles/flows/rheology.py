"""Shear-rate dependent viscosity: power law and Carreau model; loads no numerical library."""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

SUM_STEPS = 400  # intervals of Simpson's rule, even
HALVINGS = 80


class Rheology(Parameters):
    """Generalised Newtonian liquid: viscosity as a function of the shear rate sqrt(2 D : D).

    "power_law": mu = viscosity (rate / shear_rate)^(exponent - 1), limited to the range from viscosity / ``bound`` to
    viscosity * ``bound``, since the power law itself is unbounded. "carreau":
    mu = mu_inf + (viscosity - mu_inf) (1 + (rate / shear_rate)^2)^((exponent - 1) / 2), where mu_inf is
    ``viscosity_at_infinity`` (Carreau 1972).
    """

    law: Literal["power_law", "carreau"]
    exponent: float = Field(ge=0.2, le=2.0)
    shear_rate: Annotated[float, Quantity("1/s")] = Field(gt=0)
    viscosity_at_infinity: Annotated[float, Quantity("mPa*s")] = Field(0.0, ge=0)
    bound: float = Field(10.0, gt=1, le=1000)

    def viscosity(self, rate: float, viscosity: float) -> float:
        """Return the viscosity [Pa s] at a shear rate [1/s]; ``viscosity`` is the reference viscosity [Pa s]."""
        ratio = rate / self.shear_rate
        if self.law == "carreau":
            share = (1.0 + ratio * ratio) ** (0.5 * (self.exponent - 1.0))
            return self.viscosity_at_infinity + (viscosity - self.viscosity_at_infinity) * share
        low, high = (self.bound**power for power in _ends(self.exponent))
        return viscosity * min(max(ratio, low), high) ** (self.exponent - 1.0)

    def largest(self, viscosity: float, rate: float) -> float:
        """Return the largest viscosity at shear rates from zero to ``rate`` [Pa s]."""
        return max(self.viscosity(0.0, viscosity), self.viscosity(rate, viscosity))


def _ends(exponent: float) -> tuple[float, float]:
    """Return the exponents of the bound between whose powers of the relative shear rate the power law applies."""
    if exponent == 1.0:
        return 0.0, 0.0
    reach = 1.0 / abs(exponent - 1.0)
    return -reach, reach


def rate_at_wall(rheology: Rheology, viscosity: float, speed: float, width: float) -> float:
    """Return the shear rate at the plates of a channel in steady flow [1/s], from the speed on the centre line.

    The stress grows linearly from the centre line, so the shear rate r occurs at the distance
    z(r) = w mu(r) r / (2 mu(R) R) from it, where R is the rate at the plates. The speed on the centre line is the
    integral of r over z, R w / 2 - integral of z dr (Simpson's rule); R is found by bisection.

    Args:
        rheology: Viscosity law of the liquid.
        viscosity: Reference viscosity of the law [Pa s].
        speed: Speed on the centre line [m/s].
        width: Width of the channel [m].
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
