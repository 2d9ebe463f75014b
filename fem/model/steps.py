"""Time steps of a run, and how they follow from the critical steps of its elements.

The critical step is the smallest of all elements, or Lanczos' estimate on the assembled, tied model
(``power_iteration``). All steps are those of the undeformed body: with finite kinematics, elements that are pressed to
a fraction of their thickness need about that fraction of the step (``step_fraction``).
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
from reflowshock.fem.model.assembly import Pieces, make_body
from reflowshock.fem.model.power_iteration import highest_frequency
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.problem.structure import Dynamics
from reflowshock.materials.roles import Materials

LONGEST_WINDOW = 250  # steps: after each window a run can be judged, stopped and continued
STEP_LIMIT = 0.99  # of the critical step
ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Steps:
    """Time steps of a run and how they came about.

    Attributes:
        plan: Window, substeps.
        critical: Role -> smallest element critical step before mass scaling [s].
        smallest: Smallest critical step that the substeps follow, mass scaling and damping included [s].
        macro_critical: Smallest element critical step in the macro model and at the interface [s].
        added_mass: Mass that scaling adds [kg].
        model_mass: Mass without scaling [kg].
        meso_step: Step of the meso model's motion [s], the window where its own steps are inside its force.
        mass_factors: Of a structure, the density factor ``(ne,)`` of this rank's elements.
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
        """Return the mass of all models, scaling included [kg]."""
        return self.model_mass + self.added_mass

    def step_of(self, role: Role) -> float:
        """Return the time step of a model [s]."""
        return {"macro": self.plan.window, "meso": self.meso_step}.get(role, self.plan.step)


def steps_of_division(whole: Whole, survey: Survey, division: Division, rules: Rules) -> Steps:
    """Return the steps of a divided mesh."""
    critical = damped_critical_step(survey.step, rules.stiffness)
    _, _, slow, _ = next(steps_of(whole, survey, division, rules))
    roles = np.unique(survey.role).tolist()
    counted = division.macro if division.overlaps else ...
    return Steps(
        plan=division.plan,
        critical={role: float(survey.plain_step[survey.role == role].min()) for role in roles},
        macro_critical=float(critical[slow if slow.any() else ...].min()),  # of all where no macro model is left
        smallest=float(critical.min()),
        added_mass=float(survey.added_mass[counted].sum()),
        model_mass=float(survey.mass[counted].sum()),
        meso_step=division.meso_step,
    )


def undivided(steps: Steps, critical: float, rules: Rules) -> Steps:
    """Return the steps of one model in the windows of a divided one, its substeps from another critical step [s]."""
    smallest = damped_critical_step(critical, rules.stiffness)
    substeps = math.ceil(steps.plan.window / (rules.fraction * smallest))
    return replace(steps, plan=replace(steps.plan, substeps=substeps), smallest=smallest)


def assembled_step(
    comm: MPI.Comm,
    model: tuple[Pieces, Tables],
    mass_factor: NDArray[np.float64],
    beddings: Sequence[BeddedFacets] = (),
) -> float:
    """Return the critical step [s] of a whole model from its highest frequency, elastic at small strains; collective.

    With the certainty of ``power_iteration`` it is not above the true one. It is not for the models of a window, whose
    stability rests on the steps of elements: at the assembled step of a meso model of one joint a window grew by 13 %.
    ``beddings`` are its elastic supports on this rank.
    """
    body = make_body(comm, *model, mass_factor, None)
    found = highest_frequency(comm, body, [*body.terms, *beddings], body.mass)
    body.shared.free()
    return found.critical_step


def agreed_minimum(world: MPI.Comm, values: Sequence[NDArray[np.float64]]) -> float:
    """Return the smallest of all values of all ranks, infinity where there is none; collective."""
    return float(world.allreduce(min(float(some.min(initial=np.inf)) for some in values), MPI.MIN))


def mass_factor(pieces: Pieces, scaled: Sequence[str], target: float) -> NDArray[np.float64]:
    """Return the density factor ``(ne,)`` that raises the critical steps of some roles to ``target`` [s]."""
    return np.where(np.isin(pieces.roles, scaled), np.maximum(1.0, (target / pieces.steps) ** 2), 1.0)


def critical_by_role(
    world: MPI.Comm, models: Sequence[Pieces], roles: Iterable[str] = tuple(Materials.model_fields)
) -> dict[str, float]:
    """Return the smallest element critical step [s] of each material role over all ranks."""
    found = {role: agreed_minimum(world, [pieces.steps[pieces.roles == role] for pieces in models]) for role in roles}
    return {role: step for role, step in found.items() if np.isfinite(step)}


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
