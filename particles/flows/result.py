"""Result of a flow: pictures of the particles, histories and metrics."""

from dataclasses import dataclass, field

from reflowshock.arrays import Floats

Metrics = dict[str, tuple[float, str]]


@dataclass(frozen=True, slots=True)
class Picture:
    """State of the liquid at a time.

    Attributes:
        time: Time [s].
        points: Points of the particles, shape (n, 3) [m].
        velocity: Velocities, shape (n, 3) [m/s].
        pressure: Pressures, shape (n,) [Pa].
    """

    time: float
    points: Floats
    velocity: Floats
    pressure: Floats


@dataclass(frozen=True, slots=True)
class FlowResult:
    """Result of a flow.

    Attributes:
        pictures: States in the order of time; the last is the end.
        walls: Wall particles, shape (m, 3) [m].
        history: Name -> column, all of one length; the first column is time [s].
        metrics: Name -> value and unit.
        words: Name -> text.
    """

    pictures: list[Picture]
    walls: Floats
    history: dict[str, Floats]
    metrics: Metrics
    words: dict[str, str] = field(default_factory=dict)
