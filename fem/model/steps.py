"""Time steps of a run, from the critical steps of its elements.

The critical step is the smallest of all elements, or a Lanczos estimate for the assembled, tied model
(``power_iteration``). All steps hold for the undeformed body: with finite kinematics, elements compressed to a fraction
of their thickness need about that fraction of the step (``step_fraction``).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.checks import steps_of
from reflowshock.fem.division.division import Division, Rules
from reflowshock.fem.division.tables import Tables
from reflowshock.fem.division.whole import Survey, Whole
from reflowshock.fem.errors import StepError
from reflowshock.fem.estimates.estimate import WindowPlan, damped_critical_step
from reflowshock.fem.estimates.solver_cost import implicit_step
from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.model.assembly import RankElements, make_body
from reflowshock.fem.model.power_iteration import highest_frequency
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.problem.structure import Dynamics
from reflowshock.materials.roles import Materials

LONGEST_WINDOW = 250  # [steps]; a run can be checked, stopped and restarted only at the end of a window
STEP_LIMIT = 0.99  # recommended largest fraction of the critical step
ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Steps:
    """Time steps of a run, with the critical steps and masses behind them.

    Attributes:
        plan: Windows and substeps.
        critical: Smallest element critical step before mass scaling by material role [s].
        macro_critical: Smallest element critical step in the macro model and at the interface [s].
        smallest: Critical step that limits the substeps, mass scaling and damping included [s].
        added_mass: Mass added by mass scaling [kg].
        model_mass: Mass without mass scaling [kg].
        meso_step: Step of the meso model's motion [s]; the window, if the small steps are inside its force term.
        mass_factors: Density factor of this rank's elements, shape (ne,), for a structure; otherwise empty.
    """

    plan: WindowPlan
    critical: dict[str, float]
    macro_critical: float
    smallest: float
    added_mass: float
    model_mass: float
    meso_step: float = math.nan
    mass_factors: list[NDArray[np.float64]] = field(default_factory=list)

    @property
    def moved_mass(self) -> float:
        """Mass of all models, mass scaling included [kg]."""
        return self.model_mass + self.added_mass

    def step_of(self, role: Role) -> float:
        """Return the time step of a model [s]."""
        return {"macro": self.plan.window, "meso": self.meso_step}.get(role, self.plan.step)


def steps_of_division(whole: Whole, survey: Survey, division: Division, rules: Rules) -> Steps:
    """Return the time steps of a run whose mesh is divided into macro and meso model; not collective.

    Args:
        whole: Mesh of both models with its ties.
        survey: Role, mass and critical step of each element of the mesh.
        division: Cells of each model, step levels and windows (times between two exchanges of the models).
        rules: Settings of the division, with the damping.

    Returns:
        Windows and substeps, with the critical steps [s] and masses [kg] behind them.
    """
    critical = damped_critical_step(survey.step, rules.stiffness)
    _, _, slow, _ = next(steps_of(whole, survey, division, rules))
    roles = np.unique(survey.role).tolist()
    counted = division.macro if division.overlaps else ...
    return Steps(
        plan=division.plan,
        critical={role: float(survey.plain_step[survey.role == role].min()) for role in roles},
        macro_critical=float(critical[slow if slow.any() else ...].min()),  # all elements if no macro model is left
        smallest=float(critical.min()),
        added_mass=float(survey.added_mass[counted].sum()),
        model_mass=float(survey.mass[counted].sum()),
        meso_step=division.meso_step,
    )


def single_model_steps(steps: Steps, critical: float, rules: Rules) -> Steps:
    """Return the steps of an undivided model with the same windows as a divided one.

    Args:
        steps: Steps of the divided model.
        critical: Undamped critical step of the undivided model [s].
        rules: Settings of the division: step over critical step, and damping.

    Returns:
        Windows with the substeps that the undivided model needs, critical steps [s] and masses [kg].
    """
    smallest = damped_critical_step(critical, rules.stiffness)
    substeps = math.ceil(steps.plan.window / (rules.fraction * smallest))
    return replace(steps, plan=replace(steps.plan, substeps=substeps), smallest=smallest)


def assembled_step(
    comm: MPI.Comm,
    rank_elements: RankElements,
    tables: Tables,
    mass_factor: NDArray[np.float64],
    beddings: Sequence[BeddedFacets] = (),
) -> float:
    """Estimate the critical step [s] of an undivided model from its highest frequency; collective.

    The estimate holds for linear elastic materials at small strains, with the confidence of ``power_iteration``. It
    must not be used for the models of a coupled run, whose stability depends on the critical steps of single elements:
    with the assembled step, the motion of a meso model of one joint grew by 13 % in a window.

    Args:
        comm: Communicator of the model.
        rank_elements: Elements of this rank.
        tables: Parts, ties, supports and step levels of the model, equal on all ranks.
        mass_factor: Factor on the density of each of this rank's elements, shape (ne,).
        beddings: Elastic supports on this rank; may be empty.
    """
    body = make_body(comm, rank_elements, tables, mass_factor, None)
    highest = highest_frequency(comm, body, [*body.terms, *beddings], body.mass)
    body.shared.free()
    return highest.critical_step


def find_minimum(world: MPI.Comm, values: Sequence[NDArray[np.float64]]) -> float:
    """Return the smallest of all values of all arrays on all ranks, in their unit, such as critical steps; collective.

    Args:
        world: Communicator of all ranks that take part.
        values: Arrays of this rank, of any shape; at least one, which may be empty.

    Returns:
        Minimum, equal on all ranks; infinity if all arrays of all ranks are empty.
    """
    return float(world.allreduce(min(float(array.min(initial=np.inf)) for array in values), MPI.MIN))


def mass_factor(rank_elements: RankElements, scaled: Sequence[str], target: float) -> NDArray[np.float64]:
    """Return the density factor of each element, shape (ne,), that raises critical steps to a target (mass scaling).

    Args:
        rank_elements: Elements of this rank with their critical steps [s] and material roles.
        scaled: Material roles with mass scaling; other elements have the factor 1.
        target: Critical step to reach [s]; elements with larger steps have the factor 1.
    """
    return np.where(np.isin(rank_elements.roles, scaled), np.maximum(1.0, (target / rank_elements.steps) ** 2), 1.0)


def _critical_by_role(
    world: MPI.Comm, models: Sequence[RankElements], roles: Iterable[str] = tuple(Materials.model_fields)
) -> dict[str, float]:
    """Return the smallest element critical step [s] of each material role over all ranks; collective."""
    smallest = {role: find_minimum(world, [model.steps[model.roles == role] for model in models]) for role in roles}
    return {role: step for role, step in smallest.items() if np.isfinite(step)}


def explicit_steps(comm: MPI.Comm, rank_elements: RankElements, dynamics: Dynamics) -> Steps:
    """Choose the steps of central differences from the critical steps of the elements; collective.

    Mass scaling raises them, stiffness-proportional damping lowers them.

    Args:
        comm: Communicator of the model.
        rank_elements: Elements of this rank with their critical steps.
        dynamics: Settings of the dynamics: duration, damping, steps and roles with mass scaling.

    Returns:
        Steps with critical steps [s] and masses [kg], equal on all ranks, and the density factors of this rank's
        elements.
    """
    scaled = dynamics.numerics.mass_scaled
    target = find_minimum(comm, [rank_elements.steps[~np.isin(rank_elements.roles, scaled)]])
    factor = mass_factor(rank_elements, scaled, target)
    critical = find_minimum(comm, [rank_elements.steps * np.sqrt(factor)])
    return _make_steps(comm, rank_elements, factor, *_explicit_plan(dynamics, critical))


def _explicit_plan(dynamics: Dynamics, undamped: float) -> tuple[WindowPlan, float]:
    """Return the windows and the damped critical step [s], from the undamped critical step [s]."""
    critical = damped_critical_step(undamped, dynamics.damping.coefficients[1])
    step = dynamics.numerics.explicit_step or dynamics.numerics.step_fraction * critical
    return window_plan(dynamics, step), critical


def check_step(dynamics: Dynamics, critical: float) -> None:
    """Check that an explicit step of the input is at most the critical step; does nothing if the input has none.

    Args:
        dynamics: Settings of the dynamics.
        critical: Damped critical step of the model [s].

    Raises:
        StepError: The step is larger.
    """
    step, estimate = dynamics.numerics.explicit_step, dynamics.numerics.critical_step
    if step is not None and step > critical:
        hint = "" if estimate == "power_iteration" else "; critical_step = power_iteration may allow more"
        raise StepError(
            f"dynamics.numerics.explicit_step = {step:.4g} s is above the critical step {critical:.4g} s ({estimate})"
            f" and unstable; use at most {STEP_LIMIT * critical:.4g} s{hint}"
        )


def with_critical(steps: Steps, undamped: float, dynamics: Dynamics) -> Steps:
    """Return a copy of explicit steps, with windows chosen for another critical step.

    Args:
        steps: Steps of a single model.
        undamped: Critical step without damping [s].
        dynamics: Settings of the dynamics.

    Returns:
        Windows and substeps, critical steps [s] and masses [kg].
    """
    plan, critical = _explicit_plan(dynamics, undamped)
    return replace(steps, plan=plan, macro_critical=critical, smallest=critical)


def implicit_steps(comm: MPI.Comm, rank_elements: RankElements, dynamics: Dynamics, pulses: Iterable[float]) -> Steps:
    """Choose the steps of the implicit solver; collective.

    Args:
        comm: Communicator of the model.
        rank_elements: Elements of this rank; their critical steps are only reported.
        dynamics: Settings of the dynamics, which may contain the step.
        pulses: Durations of the load pulses [s]; the shortest sets the step if the input has none.

    Returns:
        Windows and substeps, critical steps of the elements [s] and masses [kg].
    """
    critical, plan = find_minimum(comm, [rank_elements.steps]), window_plan(dynamics, implicit_step(dynamics, pulses))
    return _make_steps(comm, rank_elements, np.ones(len(rank_elements.steps)), plan, critical)


def window_plan(dynamics: Dynamics, largest: float) -> WindowPlan:
    """Return windows of equal length that end at the history samples, divided into steps.

    Different solvers then sample a problem at the same times, unless a run has fewer steps than samples.

    Args:
        dynamics: Settings of the dynamics: duration and number of history samples.
        largest: Largest step [s].

    Returns:
        Window [s], steps per window, number of windows, and windows from one history sample to the next.
    """
    samples = min(dynamics.numerics.history_samples, _round_up(dynamics.duration / largest))
    stride = _round_up(dynamics.duration / samples / largest / LONGEST_WINDOW)
    windows = samples * stride
    return WindowPlan(dynamics.duration / windows, _round_up(dynamics.duration / windows / largest), windows, stride)


def _round_up(count: float) -> int:
    """Return ``count`` rounded up to an integer of at least 1, tolerant of round-off in the ratio."""
    return max(1, math.ceil(count * (1.0 - ROUNDING)))


def _make_steps(
    comm: MPI.Comm, rank_elements: RankElements, factor: NDArray[np.float64], plan: WindowPlan, critical: float
) -> Steps:
    """Return the steps of a single model with its masses; collective.

    Args:
        comm: Communicator of the model.
        rank_elements: Elements of the rank.
        factor: Factor on the density of each element, shape (ne,).
        plan: Windows and substeps.
        critical: Critical step of explicit integration [s].
    """
    mass = rank_elements.elements.density * rank_elements.geometry.volume
    return Steps(
        plan=plan,
        mass_factors=[factor],
        critical=_critical_by_role(
            comm, [rank_elements], sorted(set(comm.allreduce(sorted(set(rank_elements.roles.tolist())))))
        ),
        macro_critical=critical,
        smallest=critical,
        added_mass=comm.allreduce(float(mass @ (factor - 1.0))),
        model_mass=comm.allreduce(float(mass.sum())),
    )
