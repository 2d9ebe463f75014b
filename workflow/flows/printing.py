"""Printing: drops of ink land on a plate and on each other, and are cured by light or freeze."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.particles.flows.droplet import DROPLET_EFFECTS
from reflowshock.particles.flows.flow_effects import FLOW_EFFECTS
from reflowshock.particles.flows.freezing import Freezing
from reflowshock.particles.flows.printing import PRINTING_EFFECTS, Printing
from reflowshock.problem import Problem
from reflowshock.units import from_si
from reflowshock.workflow.case.text import number, short
from reflowshock.workflow.flows.cost import SECONDS_PER_PARTICLE_IN_SPACE, SECONDS_PER_STEP_IN_SPACE, Cost
from reflowshock.workflow.flows.droplet import SPRAY, particle_problems
from reflowshock.workflow.flows.droplet import plan_rows as droplet_rows
from reflowshock.workflow.flows.flow_kind import FlowCase, FlowKind, Measures, Row, flow_pipeline, metric_text
from reflowshock.workflow.flows.problems import micrometres, rheology_problems

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.flows.result import FlowResult
    from reflowshock.workflow.report.charts import Chart

LEAST_PITCH = 0.25  # over the diameter of a drop: with less, drops pile up in one place
# Volume drift compares particles and solid bodies with the printed ink; volume error compares the part with it.
LIMITS = {"volume_drift": 0.01, "volume_error": 0.01, "spray_share": SPRAY}
# One core of an Intel Xeon, cases/printing, 64 drops: cured ink next to a drop, per step and relative to its particles;
# measurement of the printed part, per drop and reported layer.
SECONDS_PER_STEP_ON_INK, SOLID_SHARE, SECONDS_PER_DROP_AND_LAYER = 1.0e-3, 0.5, 1.5e-2
INK_UNITS = {"m": (1e6, "µm"), "m^3": (1e15, "pL")}  # also for a value of zero


class PrintingCase(FlowCase):
    """Case of a part that is printed drop by drop."""

    kind = "printing"
    stages = flow_pipeline("printing", "part.stl", "height_map.npy", "height_map.csv", "height_map.png", "layers.csv")

    printing: Printing


def printing_problems(case: PrintingCase) -> list[Problem]:
    """Find drops that pile up, particles too large, a speed of sound too low, short delays, and impossible freezing.

    Args:
        case: Case of a part that is printed drop by drop.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    scene = case.printing
    problems = particle_problems("printing", scene.drop) + rheology_problems("printing", scene)
    least = LEAST_PITCH * scene.length
    if scene.pitch < least:
        allowed = f">= {micrometres(least)}, {LEAST_PITCH:g} diameters of a drop"
        problems.append(Problem("printing.pitch", "drops would pile up", micrometres(scene.pitch), allowed))
    if scene.delay < scene.length / scene.speed:
        delay, least_delay = (from_si(time, "us", digits=3) for time in (scene.delay, scene.length / scene.speed))
        allowed = f">= {least_delay}, in which a drop travels its diameter"
        problems.append(Problem("printing.delay", "a drop would hit the previous one in flight", delay, allowed))
    if scene.freezing is not None:
        problems += _freezing_problems(scene, scene.freezing)
    elif scene.effects.freezing == "on":
        message = "requires a table [printing.freezing]"
        problems.append(Problem("printing.effects.freezing", message, "on", "auto, off"))
    if scene.numerics.device != "cpu":
        problems.append(
            Problem("printing.numerics.device", "printing runs on a CPU only", scene.numerics.device, "cpu")
        )
    return problems


def _freezing_problems(scene: Printing, freezing: Freezing) -> list[Problem]:
    """Find a plate that is too warm, drops that land frozen, light in addition to freezing, and short delays."""
    melting = f"{from_si(freezing.melting_point, 'degC', digits=4)}, the melting point"
    if freezing.substrate_temperature >= freezing.melting_point:
        plate = from_si(freezing.substrate_temperature, "degC", digits=4)
        message = "the plate is too warm to freeze drops"
        return [Problem("printing.freezing.substrate_temperature", message, plate, f"< {melting}")]
    if freezing.temperature < freezing.melting_point:
        ink = from_si(freezing.temperature, "degC", digits=4)
        return [Problem("printing.freezing.temperature", "drops would land frozen", ink, f">= {melting}")]
    if not scene.freezes:
        return []
    if scene.cure is not None:
        allowed = "printing.cure or printing.freezing; with effects.freezing = off light cures the drops"
        return [Problem("printing.cure", "drops freeze before light cures them", "given", allowed)]
    if scene.drops > 1 and scene.delay < scene.cooling_time:
        delay, least = (from_si(time, "us", digits=4) for time in (scene.delay, scene.cooling_time))
        allowed = f">= {least}, in which a drop freezes and cools to the temperature of the plate"
        return [Problem("printing.delay", "a drop would land on a warm one", delay, allowed)]
    return []


def _solve(scene: Printing, folder: Path, progress: Callable[[float], None], checkpoint: "Checkpoint") -> "FlowResult":
    from reflowshock.particles.printing.part_files import write_part
    from reflowshock.particles.printing.printing import solve_printing
    from reflowshock.workflow.flows.printed_part import draw_heights

    result, part = solve_printing(scene, progress, checkpoint)
    write_part(folder, part)
    draw_heights(folder / "height_map.png", part.x, part.y, part.heights)
    return result


def printing_curves(scene: Printing, result: "FlowResult") -> "list[Chart]":
    """Return charts of the height of the part and of the energies of the liquid over the number of drops.

    Args:
        scene: Parameters of the flow, the scene of the case.
        result: Result of the flow: snapshots, history (name -> samples, time in s) and metrics.

    Returns:
        Interactive charts for the report page.
    """
    from reflowshock.workflow.report.charts import Axis, Chart, Series
    from reflowshock.workflow.report.colours import ORANGE

    history = result.history
    drops, axis = history["drops"], Axis("number of drops")
    unit = np.pi * scene.length**2 * scene.surface_tension
    energies = [
        Series("kinetic", drops, history["kinetic_energy"] / unit, ORANGE, line="none", marks=True),
        Series("surface and wetting", drops, history["surface_energy"] / unit, line="none", marks=True),
    ]
    return [
        Chart(axis, Axis("height [µm]"), [Series("highest point", drops, 1e6 * history["height"])]),
        Chart(axis, Axis("energy / surface energy of a sphere"), energies),
    ]


def _costs(scene: Printing, steps: int, shear_factor: float) -> Mapping[str, Cost]:
    """Return the cost of printing: drops move one after the other, with the cured ink within their reach."""
    each = SECONDS_PER_PARTICLE_IN_SPACE * shear_factor
    step = SECONDS_PER_STEP_IN_SPACE + SECONDS_PER_STEP_ON_INK
    liquid_particles = scene.drop.particles * max(1.0, min(scene.cure_time / scene.delay, float(scene.drops)))
    end = SECONDS_PER_DROP_AND_LAYER * scene.drops * scene.layers
    return {"cpu": Cost(steps, step, each * liquid_particles * (1.0 + SOLID_SHARE), end)}


def _plan_rows(scene: Printing) -> list[Row]:
    """Return the numbers of one drop, the pattern, and the time until a drop is solid."""
    solid, end = ("frozen", "freezes") if scene.freezes else ("cured", "is cured")
    when = "before the next drop lands" if scene.cure_time <= scene.delay else "after the next drop has landed"
    rest = "until it is solid" if scene.freezes else f"per drop; remaining liquid is assumed at rest until it {end}"
    width = f"{scene.pitch / scene.base:.3g} times the width of a drop on the plate, {micrometres(scene.base)}"
    layers = f"{scene.layers} layer{'s' if scene.layers > 1 else ''}"
    return [
        *droplet_rows(scene.drop),
        ("drops", f"{scene.drops}", f"{scene.columns} x {scene.rows} in {layers}"),
        ("pitch", micrometres(scene.pitch), width),
        (f"{solid} after", short(scene.cure_time), when),
        ("computed time", short(scene.followed), rest),
    ]


def _text(name: str, metric: dict) -> str:
    """Write lengths and volumes in micrometres and picolitres."""
    if metric["unit"] not in INK_UNITS:
        return metric_text(name, metric)
    factor, unit = INK_UNITS[metric["unit"]]
    return f"{number(factor * metric['value'])} {unit}"


def _add_part(products: Path, context: dict) -> None:
    from reflowshock.workflow.flows.printed_part import add_part

    add_part(products, context)


PRINTING = FlowKind(
    case=PrintingCase,
    effects=(*FLOW_EFFECTS, *DROPLET_EFFECTS, *PRINTING_EFFECTS),
    problems=printing_problems,
    solve=_solve,
    limits=lambda _scene: LIMITS,
    curves=printing_curves,
    caption="Printed height and energies of the liquid ink after each drop.",
    headline=(
        "volume_error", "connected_parts_max", "roughness_sa", "height_max", "voids", "drops", "weber", "volume_drift",
        "particles", "seconds",
    ),
    counts=(8, 9, 10, 12),
    measures=lambda _scene: Measures({"roughness_sa": "roughness Sa", "height_max": "height of the part"}),
    costs=_costs,
    plan_rows=_plan_rows,
    text=_text,
    count_key="particles_per_diameter",
    length_unit="um",
    add_products=_add_part,
)  # fmt: skip
