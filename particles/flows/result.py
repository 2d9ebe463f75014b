"""Result of a flow: snapshots of the particles, history and metrics."""

from dataclasses import dataclass, field

from reflowshock.arrays import Floats

Metrics = dict[str, tuple[float, str]]


@dataclass(frozen=True, slots=True)
class Picture:
    """Snapshot of the liquid at one time.

    Attributes:
        time: Time [s].
        points: Positions of the particles, shape (n, 3) [m].
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
        pictures: Snapshots in order of time; the last one is the final state.
        walls: Positions of the wall particles, shape (m, 3) [m].
        history: Column name -> samples, all of equal length; the first column is time [s].
        metrics: Metric name -> (value, unit).
        words: Name -> text of the report.
    """

    pictures: list[Picture]
    walls: Floats
    history: dict[str, Floats]
    metrics: Metrics
    words: dict[str, str] = field(default_factory=dict)
