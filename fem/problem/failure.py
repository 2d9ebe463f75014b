"""Failure criteria of joints: limits of stress and plastic work, each with its source, and a law of drop life."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Source = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Measure = Literal["peel_stress", "layer_von_mises", "layer_plastic_work"]


class StressLimit(Parameters):
    """Stress at which a joint fails, and the source of the number: a test, a data sheet, a paper."""

    limit: Annotated[float, Quantity("MPa")] = Field(gt=0)
    source: Source


class WorkLimit(Parameters):
    """Plastic work density at which a joint fails, and the source of the number."""

    limit: Annotated[float, Quantity("kJ/m^3")] = Field(gt=0)
    source: Source


class Life(Parameters):
    """Law of drop life from the user's tests: N = C s^-m drops.

    s is the ``measure`` of the critical joint in MPa or kJ/m^3, C the ``constant``, m the ``exponent``. Measured lives
    scatter between N / ``scatter`` and N times ``scatter``.
    """

    measure: Measure
    constant: float = Field(gt=0)
    exponent: float = Field(gt=0)
    scatter: float = Field(ge=1)
    source: Source

    def drops(self, measure: float) -> tuple[float, float, float]:
        """Return the number of drops N and its lower and upper bound, for a measure in MPa or kJ/m^3."""
        middle = self.constant * measure**-self.exponent
        return middle, middle / self.scatter, middle * self.scatter


class Failure(Parameters):
    """Limits of the peaks over time at the worse pad of a joint; without a limit the joints are not judged.

    ``peel_stress`` is the mean over a pad, ``layer_von_mises`` and ``layer_plastic_work`` are means over the solder
    layer at a pad. No limit has a default, because strength depends on solder, finish, rate and process.
    """

    peel_stress: StressLimit | None = None
    layer_von_mises: StressLimit | None = None
    layer_plastic_work: WorkLimit | None = None
    life: Life | None = None

    @property
    def limits(self) -> dict[str, StressLimit | WorkLimit]:
        """Limits present in the case, by measure."""
        limits: dict[str, StressLimit | WorkLimit | None] = {
            "peel_stress": self.peel_stress,
            "layer_von_mises": self.layer_von_mises,
            "layer_plastic_work": self.layer_plastic_work,
        }
        return {name: limit for name, limit in limits.items() if limit is not None}
