"""Registry of the particle methods that solve a time step of a reflow: one record for each.

The scheme of the case and the active effects select the method. The limits of the schemes are in
``parameters/schemes.py``.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from reflowshock.particles.gripc.gripc_step import GripcStep
from reflowshock.particles.ispg.adaptation import Adaptation
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.parameters.effects import AT_REST
from reflowshock.particles.parameters.schemes import Scheme
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.inertial_step import InertialStep
from reflowshock.particles.steps.relaxation import Relaxation
from reflowshock.particles.steps.step_solver import StepSolver


@dataclass(frozen=True, slots=True)
class StepMethod:
    """Particle method that solves a time step.

    Attributes:
        name: Name of the method in reports.
        scheme: Scheme of a case that selects it.
        build: Function of the solder that returns the step solver.
        applies: Function of the effects (name -> on or off) that returns whether the method computes them.
        events: Function of step solver and physics that returns the events that the method adds after a step.
    """

    name: str
    scheme: Scheme
    build: Callable[[Solder], StepSolver]
    applies: Callable[[Mapping[str, bool]], bool] = lambda effects: True
    events: Callable[[Any, Physics], Sequence[Any]] = lambda solver, physics: ()


def has_motion(effects: Mapping[str, bool]) -> bool:
    """Return whether inertia or viscosity acts, which have no effect at rest.

    Args:
        effects: Name of an effect -> on or off; missing effects are off.
    """
    return any(effects.get(name, False) for name in AT_REST)


# The first method of the selected scheme that computes the active effects is used.
STEP_METHODS = (
    StepMethod(
        "incompressible smoothed particle Galerkin",
        "ispg",
        lambda solder: IspgStep(),
        events=lambda solver, physics: (Adaptation(solver, physics),),
    ),
    StepMethod("ISPG as printed by Hu et al.", "gripc", lambda solder: GripcStep(solder.numerics.basis)),
    StepMethod("linear tetrahedra", "energy", lambda solder: InertialStep(solder.density), applies=has_motion),
    StepMethod("relaxation of the surface energy", "energy", lambda solder: Relaxation(solder.density)),
)


def step_method(solder: Solder, effects: Mapping[str, bool]) -> StepMethod:
    """Return the first particle method for the scheme of a solder that applies with its active effects.

    Args:
        solder: Solder with the selected scheme.
        effects: Name of an effect, such as "inertia" -> on or off; missing effects are off.

    Returns:
        Method with its name and the functions that build its step solver and its events.
    """
    return next(m for m in STEP_METHODS if m.scheme == solder.numerics.scheme and m.applies(effects))


def start_solver(solder: Solder, effects: Mapping[str, bool], physics: Physics) -> tuple[StepSolver, Physics]:
    """Return a new step solver, and the physics with the events that its method adds.

    Args:
        solder: Fluid and numerics, with the selected scheme.
        effects: Name of an effect, such as "inertia" -> on or off; missing effects are off.
        physics: Physics of the active effects; not changed.

    Returns:
        Step solver before its first step, and the physics with the added events.
    """
    method = step_method(solder, effects)
    solver = method.build(solder)
    events = method.events(solver, physics)
    return solver, replace(physics, events=(*physics.events, *events)) if events else physics
