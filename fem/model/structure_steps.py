"""Time steps of a structure: the critical one with mass scaling, and windows that end at the samples."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.errors import StepError
from reflowshock.fem.estimates.estimate import WindowPlan, damped_critical_step
from reflowshock.fem.estimates.solver_cost import implicit_step
from reflowshock.fem.model.assembly import Pieces
from reflowshock.fem.model.steps import Steps, agreed_minimum, critical_by_role, mass_factor
from reflowshock.fem.problem.structure import Dynamics

LONGEST_WINDOW = 250  # steps: after each window a run can be judged, stopped and continued
STEP_LIMIT = 0.99  # of the critical step
ROUNDING = 1e-9


def explicit_steps(comm: MPI.Comm, pieces: Pieces, dynamics: Dynamics) -> Steps:
    """Choose the steps of central differences from the elements' critical steps; collective.

    Mass scaling raises them, stiffness-proportional damping lowers them.
    """
    scaled = dynamics.numerics.mass_scaled
    target = agreed_minimum(comm, [pieces.steps[~np.isin(pieces.roles, scaled)]])
    factor = mass_factor(pieces, scaled, target)
    critical = agreed_minimum(comm, [pieces.steps * np.sqrt(factor)])
    return make_steps(comm, pieces, factor, explicit_plan(dynamics, critical))


def explicit_plan(dynamics: Dynamics, undamped: float) -> tuple[WindowPlan, float]:
    """Return windows and the critical step [s] with damping, from that without."""
    critical = damped_critical_step(undamped, dynamics.damping.coefficients[1])
    given = dynamics.numerics.explicit_step
    return window_plan(dynamics, given or dynamics.numerics.step_fraction * critical), critical


def check_step(dynamics: Dynamics, critical: float) -> None:
    """Refuse a given explicit step above the critical step [s].

    Raises:
        StepError: With both.
    """
    given, estimate = dynamics.numerics.explicit_step, dynamics.numerics.critical_step
    if given is not None and given > critical:
        hint = "" if estimate == "power_iteration" else "; critical_step = power_iteration may allow more"
        raise StepError(
            f"dynamics.numerics.explicit_step = {given:.4g} s is above the critical step {critical:.4g} s ({estimate}),"
            f" beyond which every motion grows; at most {STEP_LIMIT * critical:.4g} s is advised{hint}"
        )


def with_critical(steps: Steps, undamped: float, dynamics: Dynamics) -> Steps:
    """Return explicit steps with another critical step without damping [s]."""
    plan, critical = explicit_plan(dynamics, undamped)
    return replace(steps, plan=plan, macro_critical=critical, smallest=critical)


def implicit_steps(comm: MPI.Comm, pieces: Pieces, dynamics: Dynamics, pulses: Iterable[float]) -> Steps:
    """Choose the steps of the implicit solver: as given, or so many in the shortest of some pulses [s]; collective."""
    critical = agreed_minimum(comm, [pieces.steps])
    return make_steps(
        comm, pieces, np.ones(len(pieces.steps)), (window_plan(dynamics, implicit_step(dynamics, pulses)), critical)
    )


def window_plan(dynamics: Dynamics, largest: float) -> WindowPlan:
    """Return windows that end at the samples, fewer where the steps are; no step is above ``largest`` [s].

    Runs of one problem by different solvers so have their samples at the same times, unless one has fewer steps.
    """
    samples = min(dynamics.numerics.history_samples, at_least(dynamics.duration / largest))
    stride = at_least(dynamics.duration / samples / largest / LONGEST_WINDOW)
    windows = samples * stride
    return WindowPlan(dynamics.duration / windows, at_least(dynamics.duration / windows / largest), windows, stride)


def at_least(count: float) -> int:
    """Return the next whole number, whatever the rounding of a ratio that should be one."""
    return max(1, math.ceil(count * (1.0 - ROUNDING)))


def make_steps(comm: MPI.Comm, pieces: Pieces, factor: NDArray[np.float64], chosen: tuple[WindowPlan, float]) -> Steps:
    """Return the steps with the masses; collective.

    Args:
        comm: All ranks.
        pieces: The rank's elements.
        factor: ``(ne,)`` on the density of each element.
        chosen: Windows, and the critical step of explicit steps [s].
    """
    plan, critical = chosen
    mass = pieces.elements.density * pieces.geometry.volume
    return Steps(
        plan=plan,
        mass_factors=[factor],
        critical=critical_by_role(comm, [pieces], sorted(set(comm.allreduce(sorted(set(pieces.roles.tolist())))))),
        macro_critical=critical,
        smallest=critical,
        added_mass=comm.allreduce(float(mass @ (factor - 1.0))),
        model_mass=comm.allreduce(float(mass.sum())),
    )
