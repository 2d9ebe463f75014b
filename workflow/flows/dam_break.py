"""Dam break: a column of liquid collapses in a tank and hits the opposite wall (Buchner 2002)."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.particles.flows.dam_break import DamBreak
from reflowshock.particles.flows.flow_effects import FLOW_EFFECTS
from reflowshock.problem import Problem
from reflowshock.workflow.case.text import number, short
from reflowshock.workflow.flows.cost import plane_costs
from reflowshock.workflow.flows.flow_kind import (
    VOLUME_DRIFT,
    FlowCase,
    FlowKind,
    Measures,
    Row,
    flow_pipeline,
    metric_text,
)
from reflowshock.workflow.flows.problems import metres, rheology_problems

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.flows.result import FlowResult
    from reflowshock.workflow.report.charts import Chart

ENERGY_RISE = 0.01  # largest allowed increase, relative to the energy at the start
HIGHEST_SENSOR = 4.0  # height of the tank's walls over the height of the column
UNITS = {"sqrt(H/g)": "√(H/g)", "rho g H": "ρgH"}


class DamBreakCase(FlowCase):
    """Case of a dam break."""

    kind = "dam_break"
    stages = flow_pipeline("dam_break")

    dam_break: DamBreak


def dam_problems(case: DamBreakCase) -> list[Problem]:
    """Find a column that does not fit into its tank, and a sensor that is not at the wall.

    Args:
        case: Case of a dam break.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    dam, problems = case.dam_break, rheology_problems("dam_break", case.dam_break)
    if dam.width > dam.tank_length - dam.spacing:
        allowed = f"> dam_break.width = {metres(dam.width)}"
        message = "must exceed the width of the column"
        problems.append(Problem("dam_break.tank_length", message, metres(dam.tank_length), allowed))
    if dam.width < dam.spacing:
        allowed = f">= {metres(dam.spacing)}, the particle spacing"
        problems.append(Problem("dam_break.width", "is narrower than one particle", metres(dam.width), allowed))
    highest = HIGHEST_SENSOR * dam.height
    if dam.sensor_height > highest:
        allowed = f"<= {metres(highest)}, {HIGHEST_SENSOR:g} times dam_break.height"
        message = "is above the walls of the tank"
        problems.append(Problem("dam_break.sensor_height", message, metres(dam.sensor_height), allowed))
    return problems


def _solve(scene: DamBreak, _folder: Path, progress: Callable[[float], None], checkpoint: "Checkpoint") -> "FlowResult":
    from reflowshock.particles.flows.methods import solve_flow

    return solve_flow(scene, progress, checkpoint)


def dam_curves(dam: DamBreak, result: "FlowResult") -> "list[Chart]":
    """Return charts of sensor pressure, front and energies, scaled by the height H of the column.

    Args:
        dam: Parameters of the flow, the scene of the case.
        result: Result of the flow: snapshots, history (name -> samples, time in s) and metrics.

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.particles.reference.dam_break import measured_pressure
    from reflowshock.workflow.report.charts import Axis, Chart, Series
    from reflowshock.workflow.report.colours import ORANGE, RED

    history = result.history
    time, axis = history["time"] / dam.unit_of_time, Axis("time [sqrt(H / g)]")
    pressure = history["sensor_pressure"] / (dam.density * dam.gravity * dam.height)
    start = history["potential_energy"][0]
    energies = [
        Series("kinetic", time, history["kinetic_energy"] / start, ORANGE),
        Series("potential", time, history["potential_energy"] / start),
    ]
    sensor = [Series("particles", time, pressure)]
    measured = measured_pressure(*(size / dam.height for size in (dam.width, dam.tank_length, dam.sensor_height)))
    if measured is not None:
        sensor.append(Series("measured (Buchner 2002)", measured[0], measured[1], RED, line="none", marks=True))
    return [
        Chart(axis, Axis("pressure at the sensor [rho g H]"), sensor),
        Chart(axis, Axis("position of the front [H]"), [Series("front", time, history["front"] / dam.height)]),
        Chart(axis, Axis("energy / initial potential energy"), energies),
    ]


def _plan_rows(dam: DamBreak) -> list[Row]:
    return [("unit of time", short(dam.unit_of_time), "sqrt(H / g)")]


def _text(name: str, metric: dict) -> str:
    if metric["unit"] in UNITS:
        return f"{number(metric['value'])} {UNITS[metric['unit']]}"
    return metric_text(name, metric)


DAM_BREAK = FlowKind(
    case=DamBreakCase,
    effects=FLOW_EFFECTS,
    problems=dam_problems,
    solve=_solve,
    limits=lambda _scene: {"volume_drift": VOLUME_DRIFT, "particles_lost": 0, "energy_rise": ENERGY_RISE},
    curves=dam_curves,
    caption="Pressure at the sensor, position of the front, and energies.",
    headline=("impact_onset", "plateau_mean", "second_rise", "volume_drift", "particles_lost", "particles", "seconds"),
    counts=(20, 28, 40, 56),
    measures=lambda _scene: Measures({"plateau_mean": "pressure of the plateau", "impact_onset": "time of impact"}),
    costs=plane_costs,
    plan_rows=_plan_rows,
    text=_text,
)
