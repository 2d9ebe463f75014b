"""Result of a flow: pictures of the particles, histories and metrics."""

from dataclasses import dataclass, field

from reflowshock.arrays import Floats

Metrics = dict[str, tuple[float, str]]


@dataclass(frozen=True, slots=True)
class Picture:
    """Particles of the liquid at a time [s]: `(n, 3)` points [m] and velocities [m/s], `(n,)` pressures [Pa]."""

    time: float
    points: Floats
    velocity: Floats
    pressure: Floats


@dataclass(frozen=True, slots=True)
class FlowResult:
    """How a liquid flowed.

    Attributes:
        pictures: in time; the last is the end.
        walls: `(m, 3)` particles of walls [m].
        history: arrays of equal length, the first is time [s].
        metrics: name to value and unit.
        words: name to what is told in words.
    """

    pictures: list[Picture]
    walls: Floats
    history: dict[str, Floats]
    metrics: Metrics
    words: dict[str, str] = field(default_factory=dict)
