"""Forecasts of all kinds of case: size of a run, and the limit on time steps."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from reflowshock.problem import Problem
from reflowshock.workflow.case.text import short

BYTES_OF_ELEMENT, BYTES_OF_PARTICLE = 5.0e3, 5.0e4
# Measured on the shipped cases, one core of an AMD EPYC: a meshing stage, and a report.
SECONDS_OF_STAGE, SECONDS_OF_REPORT = 3.0, 2.0
STEPS_MOST = 1e10  # takes hours even on the smallest meshes


@dataclass(frozen=True, slots=True)
class Size:
    """Size of a run: seconds per stage on the case's ranks, number of simultaneous joints, model memory [B]."""

    seconds: Mapping[str, float]
    joints: int
    memory: float


def too_many_steps(key: str, duration: float, step: float, solver: str) -> Iterator[Problem]:
    """Yield a problem if a motion takes more than ``STEPS_MOST`` time steps.

    Args:
        key: Dotted key of the duration.
        duration: Duration of the motion [s].
        step: Predicted time step [s].
        solver: Name of the solver.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    if not step > 0.0:
        message = f"has no {solver} time step: sizes, densities, moduli or damping are out of range"
        yield Problem(key, message, short(duration))
    elif duration > STEPS_MOST * step:
        message = f"would take more than {STEPS_MOST:g} {solver} steps of {short(step)}"
        yield Problem(key, message, short(duration), f"<= {STEPS_MOST * step:.3g} s")
