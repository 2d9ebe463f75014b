"""Droplet: free, at rest on a wall, or striking it.

The exact shapes at rest are the sphere under the Young-Laplace pressure 4 gamma / D and, on a wall, the spherical cap.
"""

from collections.abc import Callable
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.flows.droplet import DROPLET_EFFECTS, LEAST_SOUND_SPEED, Droplet, cap
from reflowshock.particles.flows.flow_effects import FLOW_EFFECTS
from reflowshock.problem import Problem
from reflowshock.units import from_si
from reflowshock.workflow.case.text import number, short
from reflowshock.workflow.flows.cost import surface_costs
from reflowshock.workflow.flows.flow_kind import (
    VOLUME_DRIFT,
    FlowCase,
    FlowKind,
    Measures,
    Row,
    flow_pipeline,
    metric_text,
)
from reflowshock.workflow.flows.problems import degrees, micrometres, rheology_problems

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.flows.result import FlowResult
    from reflowshock.workflow.report.charts import Chart, Series

FEWEST_ACROSS = 8.0  # particles across a droplet: fewer resolve no surface
FEWEST_HIGH = 3.4  # particles in the height of a cap at rest: with 2.9 to 3.3, widths are wrong by up to 14 %
# Largest volume share of satellites that are too small for particles and fly on without tension.
SPRAY = 0.01
# Smallest film of an impact in spacings: particles of a thinner one are 1.4 spacings apart, half as many as needed.
THINNEST_FILM = 0.5
# The surface volume is the volume that the surface encloses, relative to the start, at any time.
LIMITS = {"volume_drift": VOLUME_DRIFT, "surface_volume_drift": 0.02, "spray_share": SPRAY}
REST_LIMITS = {"pressure_error": 0.02, "roundness": 1.02, "base_error": 0.02, "height_error": 0.02}
OVER_DIAMETER = ("spread_max", "base_over_diameter", "height_over_diameter")


class DropletCase(FlowCase):
    """Case of a droplet: free, at rest on a wall, or striking it."""

    kind = "droplet"
    stages = flow_pipeline("droplet")

    droplet: Droplet


def droplet_problems(case: DropletCase) -> list[Problem]:
    """Find values that are given twice or have no meaning, a speed of sound too low, and particles too large.

    Args:
        case: Case of a single droplet.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    drop = case.droplet
    problems = _number_problems(drop) + particle_problems("droplet", drop)
    problems += rheology_problems("droplet", drop) + _hysteresis_problems(drop)
    height = cap(drop.angle)[1] * drop.diameter
    if drop.has_wall and not drop.impact_speed and drop.spacing > height / FEWEST_HIGH:
        message = f"is too large for the cap of {degrees(drop.angle)}, {micrometres(height)} high"
        least = ceil(FEWEST_HIGH * drop.diameter / height)
        allowed = f"<= {micrometres(height / FEWEST_HIGH)}, {least} per diameter"
        problems.append(Problem("droplet.numerics.spacing", message, micrometres(drop.spacing), allowed))
    if drop.has_wall and drop.start != "sphere":
        problems.append(Problem("droplet.start", "only a free drop starts as a cube", drop.start, "sphere"))
    return problems


def _number_problems(drop: Droplet) -> list[Problem]:
    """Find Weber and Reynolds numbers that conflict with speed or viscosity, or have no meaning."""
    problems = []
    if drop.weber is not None and drop.speed is not None:
        weber = drop.density * drop.speed**2 * drop.diameter / drop.surface_tension
        allowed = f"either speed or weber; this speed gives a Weber number of {weber:.4g}"
        problems.append(Problem("droplet.weber", "conflicts with droplet.speed", drop.weber, allowed))
    if drop.reynolds is not None and "viscosity" in drop.model_fields_set:
        allowed = "either viscosity or reynolds"
        problems.append(Problem("droplet.reynolds", "conflicts with droplet.viscosity", drop.reynolds, allowed))
    if drop.reynolds is not None and not drop.impact_speed:
        allowed = "together with droplet.speed or droplet.weber"
        problems.append(Problem("droplet.reynolds", "has no meaning without an impact", drop.reynolds, allowed))
    return problems


def _hysteresis_problems(drop: Droplet) -> list[Problem]:
    """Find advancing and receding angles without a wall, or on the wrong side of the contact angle."""
    problems = []
    for name, angle, side in (("advancing", drop.advancing_angle, 1.0), ("receding", drop.receding_angle, -1.0)):
        key = f"droplet.{name}_angle"
        if angle is not None and not drop.has_wall:
            allowed = "together with a contact angle"
            problems.append(Problem(key, "has no meaning without a wall", degrees(angle), allowed))
        elif angle is not None and side * (angle - drop.angle) < 0.0:
            allowed = f"{'>=' if side > 0.0 else '<='} {degrees(drop.angle)}, the contact angle"
            problems.append(Problem(key, "is on the wrong side of the contact angle", degrees(angle), allowed))
    return problems


def particle_problems(kind: str, drop: Droplet) -> list[Problem]:
    """Find a spacing that is given twice or too large for a drop, and a speed of sound that is too low.

    Args:
        kind: Table of the scene in the case file.
        drop: Parameters of one drop.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    problems, numerics = [], drop.numerics
    if numerics.spacing is not None and numerics.particles_per_diameter is not None:
        allowed = "either numerics.spacing or numerics.particles_per_diameter"
        message = "conflicts with numerics.particles_per_diameter"
        problems.append(Problem(f"{kind}.numerics.spacing", message, micrometres(numerics.spacing), allowed))
    if drop.spacing > drop.diameter / FEWEST_ACROSS:
        allowed = f"<= {micrometres(drop.diameter / FEWEST_ACROSS)}, {FEWEST_ACROSS:g} particles across the drop"
        message = "is too large for this drop"
        problems.append(Problem(f"{kind}.numerics.spacing", message, micrometres(drop.spacing), allowed))
    if numerics.sound_speed < LEAST_SOUND_SPEED:
        change, least = 100.0 / numerics.sound_speed**2, ceil(LEAST_SOUND_SPEED)
        message = f"is too low for {drop.fastest:.3g} m/s: densities would change by {change:.2g} %"
        allowed = f">= {least}, {from_si(least * drop.fastest, 'm/s', digits=3)}"
        problems.append(Problem(f"{kind}.numerics.sound_speed", message, numerics.sound_speed, allowed))
    return problems


def _solve(scene: Droplet, _folder: Path, progress: Callable[[float], None], checkpoint: "Checkpoint") -> "FlowResult":
    from reflowshock.particles.flows.methods import solve_flow

    return solve_flow(scene, progress, checkpoint)


def _limits(scene: Droplet) -> dict[str, float]:
    from reflowshock.particles.flows.droplet_metrics import rest_metrics

    exact_metrics = rest_metrics(scene)
    return LIMITS | {name: limit for name, limit in REST_LIMITS.items() if name in exact_metrics}


def droplet_curves(drop: Droplet, result: "FlowResult") -> "list[Chart]":
    """Return charts of the shape with the cap at rest, of the pressure or the speed, and of the energies.

    Args:
        drop: Parameters of the flow, the scene of the case.
        result: Result of the flow: snapshots, history (name -> samples, time in s) and metrics.

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.workflow.report.charts import Axis, Chart, Series
    from reflowshock.workflow.report.colours import ORANGE, RED

    history = result.history
    unit = "D / U" if drop.impact_speed else "sqrt(rho D³ / gamma)"
    time, axis = history["time"] / drop.unit_of_time, Axis(f"time [{unit}]")
    shape = [Series("width", time, history["spread"]), Series("height", time, history["height"], ORANGE)]
    surface = np.pi * drop.diameter**2 * drop.surface_tension
    energies = [
        Series("kinetic", time, history["kinetic_energy"] / surface, ORANGE),
        Series("surface and wall", time, history["surface_energy"] / surface),
    ]
    if drop.impact_speed:  # sound waves dominate its pressure and decay slowly
        label, motion = "largest speed / impact speed", history["largest_speed"] / drop.impact_speed
        total = (history["kinetic_energy"] + history["surface_energy"]) / surface
        energies.append(Series("total", time, total, RED))
    else:
        label, motion = "mean pressure / (4 gamma / D)", history["mean_pressure"] / drop.laplace_pressure
    return [
        Chart(axis, Axis("size / diameter"), [*shape, *_reference_widths(drop, time[[0, -1]])]),
        Chart(axis, Axis(label), [Series("particles", time, motion)]),
        Chart(axis, Axis("energy / surface energy of the sphere"), energies),
    ]


def _reference_widths(drop: Droplet, ends: Floats) -> "list[Series]":
    """Return horizontal lines: the cap at rest, and the largest width of an impact by published correlations.

    Args:
        drop: Parameters of the droplet.
        ends: First and last time, shape (2,).
    """
    from reflowshock.particles.reference.impact_spread import of_measured
    from reflowshock.workflow.report.charts import Series
    from reflowshock.workflow.report.colours import BLUE, ORANGE, RED

    lines = []
    if drop.has_wall:
        base, height = cap(drop.angle)
        lines += [
            Series("cap at rest, width on the wall", ends, np.array([base, base]), BLUE, line="dashed"),
            Series("cap at rest, height", ends, np.array([height, height]), ORANGE, line="dashed"),
        ]
    if widths := of_measured(drop.weber_number, drop.reynolds_number, drop.advancing):
        lines += [
            Series(f"largest width by correlations, {which}", ends, np.array([width, width]), RED, line="dashed")
            for which, width in zip(("smallest", "largest"), widths, strict=True)
        ]
    return lines


def plan_rows(drop: Droplet) -> list[Row]:
    """Return the dimensionless numbers of a droplet and its state at rest, as rows of the table that ``plan`` prints.

    Args:
        drop: Parameters of the droplet.

    Returns:
        Quantity, value and remark of each row, as text.
    """
    rows = [("Ohnesorge number", f"{drop.ohnesorge:.3g}", "viscosity / surface tension")]
    if drop.impact_speed:
        rows.append(("Weber number", f"{drop.weber_number:.3g}", from_si(drop.impact_speed, "m/s", digits=3)))
    unit = "D / U" if drop.impact_speed else "sqrt(rho D^3 / gamma)"
    rows.append(("unit of time", short(drop.unit_of_time), unit))
    if drop.has_wall:
        base, height = cap(drop.angle)
        rows.append(("cap at rest", f"{base:.3f} x {height:.3f} D", "width on the wall and height, without weight"))
    else:
        rows.append(("pressure at rest", from_si(drop.laplace_pressure, "Pa", digits=4), "4 gamma / D"))
    return rows


def _measures(drop: Droplet) -> Measures:
    if drop.impact_speed:
        return Measures({"spread_max": "largest spread"})
    if drop.has_wall:
        return Measures({"base_error": "width on the wall", "height_error": "height"}, "spherical cap")
    return Measures({"pressure_error": "pressure"}, "Young-Laplace")


def _text(name: str, metric: dict) -> str:
    return f"{number(metric['value'])} D" if name in OVER_DIAMETER else metric_text(name, metric)


DROPLET = FlowKind(
    case=DropletCase,
    effects=(*FLOW_EFFECTS, *DROPLET_EFFECTS),
    problems=droplet_problems,
    solve=_solve,
    limits=_limits,
    lower_limits={"film_over_spacing": THINNEST_FILM},
    curves=droplet_curves,
    caption="Shape of the drop; its pressure, or for an impact its largest speed; energies.",
    headline=(
        "outcome", "spread_max", "time_of_spread_max", "contact_time", "mean_pressure", "pressure_error", "roundness",
        "base_over_diameter", "height_over_diameter", "capillary_number", "weber", "reynolds", "volume_drift",
        "particles", "seconds",
    ),
    counts=(10, 12, 16, 20),
    measures=_measures,
    costs=surface_costs,
    plan_rows=plan_rows,
    text=_text,
    count_key="particles_per_diameter",
    length_unit="um",
)  # fmt: skip
