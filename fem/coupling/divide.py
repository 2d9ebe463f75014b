"""The choice of models, levels and window from the cells of a whole mesh and their critical steps."""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from fem.coupling.buffer import grown, nodes_of, touching
from fem.coupling.division import Division, SchemeName
from fem.coupling.whole import Survey, Whole
from fem.estimate import WindowPlan, damped_critical_step, window_plan
from fem.parameters import Coupling


@dataclass(frozen=True, slots=True)
class Rules:
    """What a division follows.

    Attributes:
        coupling: What the user wants.
        coarse: ``(ne,)`` cells that are the macro model's where velocities or forces are coupled: a board's.
        fraction: Of the critical step that is used.
        stiffness: beta of damping [s].
        duration: Simulated time [s].
        samples: History samples wanted.
    """

    coupling: Coupling
    coarse: NDArray[np.bool_]
    fraction: float
    stiffness: float
    duration: float
    samples: int

    def plan(self, macro_step: float, meso_step: float) -> WindowPlan:
        """Return the windows that follow from two critical steps [s]."""
        return window_plan(macro_step, meso_step, self.fraction, self.duration, self.samples)


def divide(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Choose scheme, models, levels and window; ``checks.check_division`` says whether they can be coupled."""
    divided = {"held_velocity": by_buffer, "gravouil_combescure": at_ties}[choose_scheme(rules)]
    return divided(whole, survey, rules)


def choose_scheme(rules: Rules) -> SchemeName:
    """Return the scheme that the user wants."""
    scheme = rules.coupling.scheme
    return "held_velocity" if scheme == "auto" else cast(SchemeName, scheme)


def seeds_of(whole: Whole, fine: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the nodes ``(n,)`` of fine cells ``(ne,)``, and those that they are tied to."""
    nodes = nodes_of(whole.mesh.cells, fine, len(whole.mesh.points))
    nodes[whole.tie.master[nodes[whole.tie.slave]]] = True
    return nodes


def by_buffer(whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Give the meso model all that is no board, and some layers of board around it: held velocity.

    The window follows the macro model and all cells that touch the cut (PHYSICS 4).
    """
    cells = whole.mesh.cells
    buffer = grown(cells, seeds_of(whole, ~rules.coarse), rules.coarse, rules.coupling.buffer_layers)
    return held(whole, survey, rules, ~rules.coarse | buffer)


def held(whole: Whole, survey: Survey, rules: Rules, meso: NDArray[np.bool_]) -> Division:
    """Return the division of held velocity whose meso model has given cells ``(ne,)``."""
    slow = ~meso | touching(whole.mesh.cells, cut_nodes(whole.mesh.cells, meso, len(whole.mesh.points)))
    return two_steps("held_velocity", rules, (~meso, meso), (slow, survey.step))


def cut_nodes(cells: NDArray[np.int32], meso: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Return which of ``count`` nodes cells of both sides have."""
    return nodes_of(cells, meso, count) & nodes_of(cells, ~meso, count)


def at_ties(_whole: Whole, survey: Survey, rules: Rules) -> Division:
    """Give the meso model all that is no board: Gravouil-Combescure, whose cut are the nodes tied to."""
    return two_steps("gravouil_combescure", rules, (rules.coarse, ~rules.coarse), (rules.coarse, survey.step))


def two_steps(
    scheme: SchemeName,
    rules: Rules,
    models: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    steps: tuple[NDArray[np.bool_], NDArray[np.float64]],
) -> Division:
    """Return the division of a scheme whose models take one step each.

    Args:
        scheme: Its name.
        rules: What it follows.
        models: ``(ne,)`` cells of macro and meso model.
        steps: ``(ne,)`` cells that the window follows; critical steps of all cells [s].
    """
    slow, critical = steps
    damped = damped_critical_step(critical, rules.stiffness)
    plan = rules.plan(float(damped[slow if slow.any() else ...].min()), float(damped.min()))
    return Division(scheme, *models, np.zeros(len(critical), np.int32), (), plan)
