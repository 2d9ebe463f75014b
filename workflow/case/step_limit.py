"""How many time steps a run may take."""

from collections.abc import Iterator

from reflowshock.workflow.case.problems import Problem
from reflowshock.workflow.process.plan_table import short

STEPS_MOST = 1e10  # those of the smallest meshes take hours


def too_many_steps(key: str, duration: float, step: float, solver: str) -> Iterator[Problem]:
    """Yield a problem where a motion takes more steps than any run.

    Args:
        key: Of the duration.
        duration: Of the motion [s].
        step: Predicted time step [s].
        solver: Its name.
    """
    if not step > 0.0:
        message = f"has no {solver} step: sizes, densities, moduli or damping are beyond all numbers"
        yield Problem(key, message, short(duration))
    elif duration > STEPS_MOST * step:
        message = f"takes more than {STEPS_MOST:g} {solver} steps of {step:.3g} s"
        yield Problem(key, message, short(duration), f"<= {STEPS_MOST * step:.3g} s")
