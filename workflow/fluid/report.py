"""Report of a flow: particles in time, histories against exact or measured ones, metrics with their limits."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.parameters.droplets import cap
from reflowshock.particles.reference.dam_break import measured_pressure
from reflowshock.particles.reference.impact_spread import of_measured
from reflowshock.workflow.case.text import number, percent, quantity, short
from reflowshock.workflow.fluid.case import DamBreakCase, DropletCase, FlowCase, PoiseuilleCase, PrintingCase
from reflowshock.workflow.fluid.printed_part import add_part
from reflowshock.workflow.report.charts import Axis, Chart, Series
from reflowshock.workflow.report.colours import BLUE, ORANGE, RED
from reflowshock.workflow.report.scene import Field, Group, Scene
from reflowshock.workflow.report.tables import figures_of, limited_metrics

if TYPE_CHECKING:
    from reflowshock.particles.sph.flow import FlowResult

IN_PLANE, IN_SPACE = (0.0, -1.0, 0.0), (0.3, -1.0, 0.25)  # where the viewer looks from
NO_FACES = np.zeros((0, 3), dtype=int)
HEADLINE = (
    "outcome", "spread_max", "time_of_spread_max", "contact_time", "mean_pressure", "pressure_error", "roundness",
    "base_over_diameter", "height_over_diameter", "capillary_number", "volume_error",
    "connected_parts_max", "roughness_sa", "height_max", "voids", "drops",
    "impact_onset", "plateau_mean", "second_rise", "decay_rate_error", "speed_error", "profile_error_at_end",
    "weber", "reynolds", "volume_drift", "particles_lost", "particles", "seconds",
)  # fmt: skip
INK = {"m": (1e6, "µm"), "m^3": (1e15, "pL")}  # also where it is none
UNITS = {"sqrt(H/g)": "√(H/g)", "rho g H": "ρgH"}
OVER_DIAMETER = ("spread_max", "base_over_diameter", "height_over_diameter")
CAPTIONS = {
    "dam_break": "Pressure at the sensor; front of the liquid; energies.",
    "poiseuille": "Speeds at the end, and the exact ones; largest speed in time.",
    "droplet": "Shape of the drop; the pressure in it, or the largest speed of one that strikes a wall; its energies.",
    "printing": "Height of what is printed; kinetic and surface energy of what is liquid; particles after drops.",
    "taylor_green": "The largest speed in time, and the exact one; kinetic energy.",
}


def add_flow(run_folder: Path, case: FlowCase, context: dict, summary: dict) -> None:
    """Add the section on the flow."""
    from reflowshock.particles.scenes.products import read_flow

    result = read_flow(run_folder / "particles")
    metrics, text = summary["metrics"], _ink_text if isinstance(case, PrintingCase) else _text
    context["headline"] = figures_of(HEADLINE, metrics, text)
    context["tables"]["flow"] = limited_metrics(metrics, summary["health"], text)
    context["flow_caption"] = CAPTIONS[case.kind]
    if isinstance(case, DamBreakCase):
        context["curves"]["flow"] = dam_curves(case, result.history)
    elif isinstance(case, PoiseuilleCase):
        end = result.pictures[-1]
        context["curves"]["flow"] = channel_curves(case, end.time, end.points, end.velocity, result.history)
    elif isinstance(case, PrintingCase):
        context["curves"]["flow"] = printing_curves(case, result.history)
        add_part(run_folder / "particles", context)
    elif isinstance(case, DropletCase):
        context["curves"]["flow"] = droplet_curves(case, result.history)
    else:
        context["curves"]["flow"] = vortex_curves(result.history)
    context["scenes"]["flow"] = flow_scene(result, case)


def dam_curves(case: DamBreakCase, history: Mapping[str, Floats]) -> list[Chart]:
    """Return pressure at the sensor, front and energies in the units of the column."""
    dam = case.dam_break
    time, axis = history["time"] / dam.unit_of_time, Axis("time [sqrt(H / g)]")
    pressure = history["sensor_pressure"] / (dam.density * dam.gravity * dam.height)
    start = history["potential_energy"][0]
    energies = [
        Series("kinetic", time, history["kinetic_energy"] / start, ORANGE),
        Series("potential", time, history["potential_energy"] / start),
    ]
    sensor = [Series("particles", time, pressure)]
    measured = measured_pressure(*(one / dam.height for one in (dam.width, dam.tank_length, dam.sensor_height)))
    if measured is not None:
        sensor.append(Series("measured (Buchner 2002)", measured[0], measured[1], RED, line="none", marks=True))
    return [
        Chart(axis, Axis("pressure at the sensor [rho g H]"), sensor),
        Chart(axis, Axis("front [H]"), [Series("front", time, history["front"] / dam.height)]),
        Chart(axis, Axis("energy over that at the start"), energies),
    ]


def channel_curves(
    case: PoiseuilleCase, time: float, points: Floats, velocity: Floats, history: Mapping[str, Floats]
) -> list[Chart]:
    """Return speeds across the channel at a time [s] beside the exact ones, and the largest speed in time."""
    from reflowshock.particles.scenes.viscous_flows import exact_speeds

    scene = case.poiseuille
    order = np.argsort(points[:, 2])
    height = points[order, 2]
    exact = exact_speeds(height, time, scene)
    speeds = [
        Series("particles", height / scene.width, velocity[order, 0] / scene.speed, BLUE, line="none", marks=True),
        Series("exact", height / scene.width, exact / scene.speed, RED),
    ]
    unit = scene.density * scene.width**2 / scene.viscosity
    return [
        Chart(Axis("height over width"), Axis("speed over that of the middle"), speeds),
        Chart(
            Axis("time [w² / nu]"),
            Axis("largest speed"),
            [Series("particles", history["time"] / unit, history["largest_speed"])],
        ),
    ]


def vortex_curves(history: Mapping[str, Floats]) -> list[Chart]:
    """Return the largest speed beside the exact one, and the kinetic energy."""
    time = 1e3 * history["time"]
    speeds = [
        Series("particles", time, history["largest_speed"]),
        Series("exact", time, history["exact_speed"], RED, line="dashed"),
    ]
    energy = [Series("kinetic energy", time, history["kinetic_energy"] / history["kinetic_energy"][0])]
    axis = Axis("time [ms]")
    return [
        Chart(axis, Axis("largest speed over that at the start"), speeds),
        Chart(axis, Axis("kinetic energy over that at the start"), energy),
    ]


def droplet_curves(case: DropletCase, history: Mapping[str, Floats]) -> list[Chart]:
    """Return width, base and height beside those of the cap at rest, pressure, and speeds and energies."""
    drop = case.droplet
    unit = "D / U" if drop.impact_speed else "sqrt(rho D³ / gamma)"
    time, axis = history["time"] / drop.unit_of_time, Axis(f"time [{unit}]")
    shape = [Series("width", time, history["spread"]), Series("height", time, history["height"], ORANGE)]
    ends = time[[0, -1]]
    if drop.has_wall:
        base, height = cap(drop.angle)
        shape += [
            Series("cap at rest, width on the wall", ends, np.array([base, base]), BLUE, line="dashed"),
            Series("cap at rest, height", ends, np.array([height, height]), ORANGE, line="dashed"),
        ]
    if between := of_measured(drop.weber_number, drop.reynolds_number, drop.advancing):
        shape += [
            Series(f"largest width by correlations, {which}", ends, np.array([width, width]), RED, line="dashed")
            for which, width in zip(("least", "largest"), between, strict=True)
        ]
    surface = np.pi * drop.diameter**2 * drop.surface_tension
    energies = [
        Series("kinetic", time, history["kinetic_energy"] / surface, ORANGE),
        Series("surface and wall", time, history["surface_energy"] / surface),
    ]
    if drop.impact_speed:  # its pressure is that of sound that dies out slowly
        motion = Axis("largest speed over that of the impact"), history["largest_speed"] / drop.impact_speed
        total = (history["kinetic_energy"] + history["surface_energy"]) / surface
        energies.append(Series("both", time, total, RED))
    else:
        motion = Axis("mean pressure over 4 gamma / D"), history["mean_pressure"] / drop.laplace_pressure
    return [
        Chart(axis, Axis("over the diameter"), shape),
        Chart(axis, motion[0], [Series("particles", time, motion[1])]),
        Chart(axis, Axis("energy over that of the sphere's surface"), energies),
    ]


def printing_curves(case: PrintingCase, history: Mapping[str, Floats]) -> list[Chart]:
    """Return the height of the part, and energies of what is liquid, over the drops that have landed."""
    scene = case.printing
    drops, axis = history["drops"], Axis("drops that have landed")
    unit = np.pi * scene.length**2 * scene.surface_tension
    energies = [
        Series("kinetic", drops, history["kinetic_energy"] / unit, ORANGE, line="none", marks=True),
        Series("surface and wetting", drops, history["surface_energy"] / unit, line="none", marks=True),
    ]
    return [
        Chart(axis, Axis("height [µm]"), [Series("highest point", drops, 1e6 * history["height"])]),
        Chart(axis, Axis("energy over that of a sphere's surface"), energies),
    ]


def flow_scene(result: "FlowResult", case: FlowCase) -> Scene:
    """Return the particles at the stored times, coloured by speed and pressure, and the walls."""
    in_space = isinstance(case, DropletCase | PrintingCase)
    frames = [short(one.time) if in_space else f"{1e3 * one.time:.4g} ms" for one in result.pictures]
    speeds = [np.sqrt((one.velocity**2).sum(axis=1)) for one in result.pictures]
    highest = max(float(np.quantile(one, 0.99)) for one in speeds)
    pressures = np.concatenate([one.pressure for one in result.pictures])
    low, high = (float(value) for value in np.quantile(pressures, (0.02, 0.98)))
    size = 0.9 * case.scene.spacing
    groups = [
        Group(
            "liquid", one.points, NO_FACES, np.zeros(len(one.points), dtype=int), "#5f86ad", only=frame, size=size,
            values={"speed": speed[None], "pressure": one.pressure[None]},
        )
        for frame, (one, speed) in enumerate(zip(result.pictures, speeds, strict=True))
    ]  # fmt: skip
    if len(result.walls):
        groups.append(Group("walls", result.walls, NO_FACES, np.ones(len(result.walls), dtype=int), size=size))
    fields = [Field("speed", "m/s", 0.0, highest), Field("pressure", "Pa", low, high)]
    return Scene(
        groups, ["liquid", "wall"], fields, frames, start=len(frames) - 1, view=IN_SPACE if in_space else IN_PLANE
    )


def _ink_text(name: str, metric: dict) -> str:
    """Write lengths and volumes of printed ink in its units."""
    if metric["unit"] not in INK:
        return _text(name, metric)
    factor, unit = INK[metric["unit"]]
    return f"{number(factor * metric['value'])} {unit}"


def _text(name: str, metric: dict) -> str:
    if name in OVER_DIAMETER:
        return f"{number(metric['value'])} D"
    if metric["unit"] in UNITS:
        return f"{number(metric['value'])} {UNITS[metric['unit']]}"
    if metric["unit"] == "" and ("error" in name or name.endswith(("_drift", "_rise"))):
        return percent(metric["value"])
    return quantity(metric)
