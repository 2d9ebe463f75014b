"""Starting Poiseuille flow: a body force accelerates liquid between two plates to a parabolic profile."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.particles.flows.channel import Poiseuille
from reflowshock.particles.flows.flow_effects import FLOW_EFFECTS
from reflowshock.problem import Problem
from reflowshock.workflow.flows.cost import plane_costs
from reflowshock.workflow.flows.flow_kind import VOLUME_DRIFT, FlowCase, FlowKind, Measures, flow_pipeline
from reflowshock.workflow.flows.problems import rheology_problems, viscosity_problems

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.flows.result import FlowResult
    from reflowshock.workflow.report.charts import Chart

PROFILE_ERROR = 0.02  # largest allowed error of the velocity profile at the end


class PoiseuilleCase(FlowCase):
    """Case of a starting Poiseuille flow."""

    kind = "poiseuille"
    stages = flow_pipeline("poiseuille")

    poiseuille: Poiseuille


def channel_problems(case: PoiseuilleCase) -> list[Problem]:
    """Find a viscosity law with foreign keys, a Reynolds number that is too large, and missing viscosity.

    Args:
        case: Case of a channel flow (Poiseuille).

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    return rheology_problems(case.kind, case.scene) + viscosity_problems(case.kind, case.scene)


def _solve(
    scene: Poiseuille, _folder: Path, progress: Callable[[float], None], checkpoint: "Checkpoint"
) -> "FlowResult":
    from reflowshock.particles.flows.methods import solve_flow

    return solve_flow(scene, progress, checkpoint)


def channel_curves(scene: Poiseuille, result: "FlowResult") -> "list[Chart]":
    """Return charts of the final velocity profile next to the exact one, and of the largest speed over time.

    Args:
        scene: Parameters of the flow, the scene of the case.
        result: Result of the flow: snapshots, history (name -> samples, time in s) and metrics.

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.particles.flows.channel import exact_speeds
    from reflowshock.workflow.report.charts import Axis, Chart, Series
    from reflowshock.workflow.report.colours import BLUE, RED

    end, history = result.pictures[-1], result.history
    order = np.argsort(end.points[:, 2])
    height = end.points[order, 2]
    exact = exact_speeds(height, end.time, scene)
    speeds = [
        Series("particles", height / scene.width, end.velocity[order, 0] / scene.speed, BLUE, line="none", marks=True),
        Series("exact", height / scene.width, exact / scene.speed, RED),
    ]
    unit = scene.density * scene.width**2 / scene.viscosity
    largest = Series("particles", history["time"] / unit, history["largest_speed"])
    return [
        Chart(Axis("height / width"), Axis("speed / steady speed in the middle"), speeds),
        Chart(Axis("time [w² / nu]"), Axis("largest speed"), [largest]),
    ]


POISEUILLE = FlowKind(
    case=PoiseuilleCase,
    effects=FLOW_EFFECTS,
    problems=channel_problems,
    solve=_solve,
    limits=lambda _scene: {"volume_drift": VOLUME_DRIFT, "profile_error_at_end": PROFILE_ERROR},
    curves=channel_curves,
    caption="Final velocity profile with the exact one; largest speed over time.",
    headline=("profile_error_at_end", "reynolds", "volume_drift", "particles", "seconds"),
    counts=(10, 14, 20, 28),
    measures=lambda _scene: Measures({"profile_error_at_end": "velocity profile"}, "starting channel flow"),
    costs=plane_costs,
)
