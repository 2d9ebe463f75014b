"""What forecasts of all kinds of case share: sizes, and the limit of time steps."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from reflowshock.problem import Problem
from reflowshock.workflow.case.text import short

BYTES_OF_ELEMENT, BYTES_OF_PARTICLE = 5.0e3, 5.0e4
# Of the shipped cases, on a core of an AMD EPYC: a stage that only meshes, and a report.
SECONDS_OF_STAGE, SECONDS_OF_REPORT = 3.0, 2.0
STEPS_MOST = 1e10  # those of the smallest meshes take hours


@dataclass(frozen=True, slots=True)
class Size:
    """Seconds of the stages on one core or on the ranks of the case, joints at a time, memory of the model [B]."""

    seconds: Mapping[str, float]
    joints: int
    memory: float


def too_many_steps(key: str, duration: float, step: float, solver: str) -> Iterator[Problem]:
    """Yield a problem where a motion takes more steps than any run.

    Args:
        key: Of the duration.
        duration: Of the motion [s].
        step: Predicted time step [s].
        solver: Its name.
    """
    if not step > 0.0:
        message = f"has no {solver} time step: sizes, densities, moduli or damping are out of range"
        yield Problem(key, message, short(duration))
    elif duration > STEPS_MOST * step:
        message = f"would take more than {STEPS_MOST:g} {solver} steps of {short(step)}"
        yield Problem(key, message, short(duration), f"<= {STEPS_MOST * step:.3g} s")
