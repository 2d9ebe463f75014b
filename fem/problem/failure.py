"""What joints bear: limits of their measures, each with its source, and a user's own law of life."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Source = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Measure = Literal["peel_stress", "layer_von_mises", "layer_plastic_work"]


class StressLimit(Parameters):
    """The largest stress that a joint bears, and where that number is from: a test, a data sheet, a paper."""

    limit: Annotated[float, Quantity("MPa")] = Field(gt=0)
    source: Source


class WorkLimit(Parameters):
    """The largest plastic work density that a joint bears, and where that number is from."""

    limit: Annotated[float, Quantity("kJ/m^3")] = Field(gt=0)
    source: Source


class Life(Parameters):
    """The user's own law of life: N = C s^-m drops, calibrated on tests.

    s is the number of the ``measure`` of the critical joint, in MPa or kJ/m^3, C the ``constant``, m the ``exponent``.
    Lives scatter between N / ``scatter`` and N times ``scatter``.
    """

    measure: Measure
    constant: float = Field(gt=0)
    exponent: float = Field(gt=0)
    scatter: float = Field(ge=1)
    source: Source

    def drops(self, measure: float) -> tuple[float, float, float]:
        """Return N, and the least and the most drops of its scatter, for a measure in MPa or kJ/m^3."""
        middle = self.constant * measure**-self.exponent
        return middle, middle / self.scatter, middle * self.scatter


class Failure(Parameters):
    """Limits by which the joints are judged, of peaks over time at the worse pad; without one there is no verdict.

    ``peel_stress`` is the mean over a pad, ``layer_von_mises`` and ``layer_plastic_work`` are means over the solder
    layer at a pad. No limit has a default: what joints bear depends on solder, finish, rate and process.
    """

    peel_stress: StressLimit | None = None
    layer_von_mises: StressLimit | None = None
    layer_plastic_work: WorkLimit | None = None
    life: Life | None = None

    @property
    def limits(self) -> dict[str, StressLimit | WorkLimit]:
        """Return the limits that are given, by measure."""
        known: dict[str, StressLimit | WorkLimit | None] = {
            "peel_stress": self.peel_stress,
            "layer_von_mises": self.layer_von_mises,
            "layer_plastic_work": self.layer_plastic_work,
        }
        return {name: limit for name, limit in known.items() if limit is not None}
