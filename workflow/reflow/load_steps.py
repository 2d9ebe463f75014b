"""The load steps of a reflow: temperatures at which solder is liquid, from melting over the peak to its freezing."""

from dataclasses import dataclass
from itertools import groupby

from reflowshock.fem.problem.thermal import Thermal


@dataclass(frozen=True, slots=True)
class LoadStep:
    """What acts on board and package besides the solder: temperature [K], displacement of the die's corner [m]."""

    temperature: float
    corner: float


def load_steps(thermal: Thermal) -> list[LoadStep]:
    """Return the load steps with liquid solder, in order; in the last one its shape freezes.

    Those of the heating divide the way from the reference to the peak evenly; cooling takes the same ones backwards.
    Melting and solidification are load steps of their own.
    """
    rise = (thermal.peak - thermal.reference) / thermal.steps
    way = [thermal.reference + rise * number for number in range(thermal.steps)] if rise > 0.0 else []
    heating = [thermal.melting, *(value for value in way if value > thermal.melting), thermal.peak]
    cooling = [*(value for value in reversed(way) if value > thermal.solidification), thermal.solidification]
    temperatures = [value for value, _ in groupby(heating + cooling)]
    return [LoadStep(value, thermal.corner(value)) for value in temperatures]
