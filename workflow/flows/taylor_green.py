"""Taylor-Green vortices: four vortices in a periodic box, whose speed viscosity reduces by exp(-8 pi^2 nu t / L^2)."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.particles.flows.flow_effects import FLOW_EFFECTS
from reflowshock.particles.flows.vortices import TaylorGreen
from reflowshock.problem import Problem
from reflowshock.workflow.flows.cost import plane_costs
from reflowshock.workflow.flows.flow_kind import VOLUME_DRIFT, FlowCase, FlowKind, Measures, Row, flow_pipeline
from reflowshock.workflow.flows.problems import rheology_problems, viscosity_problems

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.flows.result import FlowResult
    from reflowshock.workflow.report.charts import Chart

DECAY_ERROR = 0.05  # largest allowed error of the decay rate


class TaylorGreenCase(FlowCase):
    """Case of Taylor-Green vortices."""

    kind = "taylor_green"
    stages = flow_pipeline("taylor_green")

    taylor_green: TaylorGreen


def vortex_problems(case: TaylorGreenCase) -> list[Problem]:
    """Find a viscosity that is not constant, a Reynolds number that is too large, and missing viscosity.

    Args:
        case: Case of decaying vortices (Taylor-Green).

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    scene = case.taylor_green
    problems = rheology_problems(case.kind, scene)
    if scene.rheology is not None:
        message = "the exact solution requires a constant viscosity"
        problems.append(Problem(f"{case.kind}.rheology", message, scene.rheology.law, "constant viscosity"))
    return problems + viscosity_problems(case.kind, scene)


def _solve(
    scene: TaylorGreen, _folder: Path, progress: Callable[[float], None], checkpoint: "Checkpoint"
) -> "FlowResult":
    from reflowshock.particles.flows.methods import solve_flow

    return solve_flow(scene, progress, checkpoint)


def vortex_curves(_scene: TaylorGreen, result: "FlowResult") -> "list[Chart]":
    """Return charts of the largest speed over time next to the exact one, and of the kinetic energy.

    Args:
        _scene: Not used; all functions of charts take the parameters of the flow.
        result: Result of the flow: snapshots, history (name -> samples, time in s) and metrics.

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.workflow.report.charts import Axis, Chart, Series
    from reflowshock.workflow.report.colours import RED

    history = result.history
    time, axis = 1e3 * history["time"], Axis("time [ms]")
    speeds = [
        Series("particles", time, history["largest_speed"]),
        Series("exact", time, history["exact_speed"], RED, line="dashed"),
    ]
    energy = [Series("kinetic energy", time, history["kinetic_energy"] / history["kinetic_energy"][0])]
    return [
        Chart(axis, Axis("largest speed / initial largest speed"), speeds),
        Chart(axis, Axis("kinetic energy / initial kinetic energy"), energy),
    ]


def _plan_rows(_scene: TaylorGreen) -> list[Row]:
    return [("exact solution", "Taylor & Green", "the largest speed decays as exp(-8 pi² nu t / L²)")]


TAYLOR_GREEN = FlowKind(
    case=TaylorGreenCase,
    effects=FLOW_EFFECTS,
    problems=vortex_problems,
    solve=_solve,
    limits=lambda _scene: {"volume_drift": VOLUME_DRIFT, "decay_rate_error": DECAY_ERROR},
    curves=vortex_curves,
    caption="Largest speed with the exact one, and kinetic energy.",
    headline=("decay_rate_error", "speed_error", "reynolds", "volume_drift", "particles", "seconds"),
    counts=(16, 24, 32, 48),
    measures=lambda _scene: Measures(
        {"decay_rate_error": "decay rate", "speed_error": "largest speed"}, "Taylor & Green"
    ),
    costs=plane_costs,
    plan_rows=_plan_rows,
)
