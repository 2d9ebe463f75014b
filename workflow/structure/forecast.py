"""Size, time steps and cost of a structure from its parameters, and its tables of the plan."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any

from rich.console import RenderableType
from rich.table import Table

from reflowshock.problem import Problem
from reflowshock.workflow.case.forecast import BYTES_OF_ELEMENT, Size, too_many_steps
from reflowshock.workflow.case.text import duration, short
from reflowshock.workflow.process.terminal import new_table
from reflowshock.workflow.structure.case import StructureCase

if TYPE_CHECKING:
    from reflowshock.fem.estimates.solver_cost import SolverCost, SolverForecast

MEGA = 1.0e6
SECONDS_TO_START = 4.0  # until the ranks of a solver have loaded their libraries and kernels


@dataclass(frozen=True, slots=True)
class LayerForecast:
    """A layer of the mesh: its material, number of elements, critical time step of the smallest one [s]."""

    material: str
    elements: int
    critical_step: float
    mass_scaled: bool


@dataclass(frozen=True, slots=True)
class CoupledForecast:
    """Two models of a structure: fine layers, window [s], steps in it, predicted wall time on one core [s]."""

    fine: tuple[str, ...]
    window: float
    substeps: int
    seconds: float


@dataclass(frozen=True, slots=True)
class StructureForecast:
    """What a run will be like.

    Attributes:
        effects: effect -> {"on", "why"}.
        layers: layer -> size and step.
        steps: time step [s] of each solver.
        solvers: their cost on one core, and which is cheaper.
        coupled: two models, where there are two.
        seconds: stage -> predicted wall time [s].
    """

    effects: Mapping[str, Any]
    layers: dict[str, LayerForecast]
    steps: dict[str, float]
    solvers: "SolverForecast"
    coupled: CoupledForecast | None
    seconds: dict[str, float]


def forecast_structure(case: StructureCase) -> StructureForecast:
    """Predict sizes, steps and cost."""
    from reflowshock.fem.estimates.solver_cost import forecast_solvers
    from reflowshock.fem.estimates.structure_effects import effects

    layers, dynamics = forecast_layers(case), case.dynamics
    steps = forecast_steps(case, layers)
    counts = {solver: ceil(dynamics.duration / step) for solver, step in steps.items()}
    elements = sum(layer.elements for layer in layers.values())
    solvers = forecast_solvers(case.problem, elements, counts["explicit"], counts["implicit"])
    coupled = forecast_coupled(case, layers, solvers.explicit.seconds / counts["explicit"] / elements)
    alone = solvers.explicit.seconds / case.ranks
    cost = {"explicit": alone, "implicit": solvers.implicit.seconds, "dns": alone}
    cost |= {"explicit": coupled.seconds / case.ranks} if coupled else {}
    seconds = {"shock": sum(SECONDS_TO_START + cost[solver] for solver in dynamics.solvers)}
    return StructureForecast(effects(case.problem, added_mass(case, layers)), layers, steps, solvers, coupled, seconds)


def forecast_coupled(case: StructureCase, layers: Mapping[str, LayerForecast], update: float) -> CoupledForecast | None:
    """Predict window and cost of two models from the seconds of an element's update; buffers and levels left out."""
    from reflowshock.fem.problem.structure import fine_layers

    coupling, dynamics = case.dynamics.coupling, case.dynamics
    if coupling is None:
        return None
    fine = fine_layers(coupling, {name: layer.critical_step for name, layer in layers.items()})
    unscaled = {name: layer for name, layer in layers.items() if name not in fine and not layer.mass_scaled}
    window, step = (
        dynamics.numerics.step_fraction * critical_step(case, some) for some in (unscaled or layers, layers)
    )
    elements = {name: layer.elements for name, layer in layers.items()}
    updates = sum(count * dynamics.duration / (step if name in fine else window) for name, count in elements.items())
    return CoupledForecast(fine, window, ceil(window / step), updates * update)


def critical_step(case: StructureCase, layers: Mapping[str, LayerForecast]) -> float:
    """Predict the critical step [s] of all elements, with damping."""
    from reflowshock.fem.estimates.estimate import damped_critical_step

    undamped = min(layer.critical_step for layer in layers.values() if not layer.mass_scaled)
    return damped_critical_step(undamped, case.dynamics.damping.coefficients[1])


def forecast_steps(case: StructureCase, layers: Mapping[str, LayerForecast]) -> dict[str, float]:
    """Predict the time step [s] of each solver."""
    from reflowshock.fem.estimates.solver_cost import implicit_step
    from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of

    numerics = case.dynamics.numerics
    explicit = numerics.explicit_step or numerics.step_fraction * critical_step(case, layers)
    return {
        "explicit": explicit,
        "dns": explicit,
        "implicit": implicit_step(case.dynamics, pulse_durations(pulses_of(case.loads))),
    }


def step_problems(case: StructureCase) -> Iterator[Problem]:
    """Find steps that cannot be taken: none at all, too many, or one that is known to be above the critical step."""
    import numpy as np

    try:
        with np.errstate(all="ignore"):
            layers = forecast_layers(case)
    except np.linalg.LinAlgError:
        yield Problem("structure", "has elements without a time step: sizes, densities or moduli are out of range")
        return
    numerics, critical = case.dynamics.numerics, critical_step(case, layers)
    exact = numerics.critical_step == "element" and case.structure.holes is None
    if numerics.explicit_step and exact and numerics.explicit_step > critical and "explicit" in case.dynamics.solvers:
        message = "is above the critical step: the solution would be unstable"
        allowed = f"<= {short(critical)}; critical_step = power_iteration may allow more"
        yield Problem("dynamics.numerics.explicit_step", message, short(numerics.explicit_step), allowed)
    steps = forecast_steps(case, layers)
    for solver in case.dynamics.solvers:
        yield from too_many_steps("dynamics.duration", case.dynamics.duration, steps[solver], solver)
    coupled = forecast_coupled(case, layers, 0.0)
    if coupled is not None:
        yield from shorter_than_window(case, coupled.window)


def shorter_than_window(case: StructureCase, window: float) -> Iterator[Problem]:
    """Find pulses that are over before two models meet again."""
    from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of

    for name, pulse in pulses_of(case.loads).items():
        shortest = min(pulse_durations({name: pulse}), default=window)
        if shortest < window:
            message = f"is shorter than one coupling window ({short(window)})"
            allowed = f">= {short(window)}, smaller elements of the coarse layers, or no dynamics.coupling"
            yield Problem(f"loads.{name}.duration", message, short(shortest), allowed)


def forecast_layers(case: StructureCase) -> dict[str, LayerForecast]:
    """Predict size and critical time step of every layer."""
    import numpy as np

    from reflowshock.fem.elements.box_step import box_element_step
    from reflowshock.meshing.board.box_plan import count_box

    body, materials = case.structure, case.problem.layer_materials
    layers = {}
    for name, part in count_box(case.box).items():
        step = box_element_step(body.element, body.formulation, materials[name], np.array(part.smallest))
        scaled = name in case.dynamics.numerics.mass_scaled
        layers[name] = LayerForecast(body.layers[name].material, part.elements, step, scaled)
    return layers


def added_mass(case: StructureCase, layers: Mapping[str, LayerForecast]) -> float:
    """Predict the mass [kg] that scaling adds: it raises the steps of some layers to the smallest of the others."""
    body, materials = case.structure, case.problem.layer_materials
    target = min(layer.critical_step for layer in layers.values() if not layer.mass_scaled)
    area = case.box.extent(0) * case.box.extent(1)
    return sum(
        (max(1.0, (target / layer.critical_step) ** 2) - 1.0)
        * materials[name].density
        * area
        * body.layers[name].thickness
        for name, layer in layers.items()
        if layer.mass_scaled
    )


def structure_size(case: StructureCase) -> Size:
    """Predict what the stages of a case take."""
    outlook = forecast_structure(case)
    elements = sum(layer.elements for layer in outlook.layers.values())
    implicit = outlook.solvers.implicit.memory if "implicit" in case.dynamics.solvers else 0.0
    return Size(outlook.seconds, 1, BYTES_OF_ELEMENT * elements + outlook.solvers.explicit.memory + implicit)


def structure_tables(case: StructureCase, outlook: StructureForecast) -> Iterator[RenderableType]:
    """Yield layers and solvers."""
    yield layers(outlook)
    yield solvers(case, outlook)


def layers(outlook: StructureForecast) -> Table:
    """Elements and critical steps of the layers, top first."""
    table = new_table("\nLayers, top first", "layer", "elements", "critical step", "material")
    for name, layer in reversed(outlook.layers.items()):
        remark = "; mass scaled to the smallest step of the others" if layer.mass_scaled else ""
        table.add_row(name, f"{layer.elements}", short(layer.critical_step), layer.material + remark)
    table.add_row("all", f"{sum(layer.elements for layer in outlook.layers.values())}", "", "", style="bold")
    return table


def solvers(case: StructureCase, outlook: StructureForecast) -> Table:
    """Steps, cost and memory of both solvers, and which to take."""
    table = new_table("\nSolvers, on one core", "solver", "step", "steps", "cost", "memory", "remark")
    numerics, found = case.dynamics.numerics, outlook.solvers
    given = numerics.explicit_step is not None
    fraction = "as given" if given else f"{numerics.step_fraction:g} of the smallest critical step"
    factor = f"of it {duration(found.implicit.setup)} for the factor"
    for name, cost, remark in (("explicit", found.explicit, fraction), ("implicit", found.implicit, factor)):
        unused = "" if name in case.dynamics.solvers else "; not in dynamics.solver"
        table.add_row(name, short(outlook.steps[name]), f"{cost.steps}", _about(cost), _memory(cost), remark + unused)
    if outlook.coupled:
        table.add_row("two models", *_coupled(outlook.coupled))
    table.caption, table.caption_justify = found.sentence, "left"
    return table


def _coupled(found: CoupledForecast) -> tuple[str, str, str, str, str]:
    """Window, steps in it, cost of two models."""
    remark = f"window; fine: {', '.join(found.fine) or 'nothing'}; without buffers and levels inside it"
    return short(found.window), f"m = {found.substeps}", f"about {duration(found.seconds)}", "", remark


def _about(cost: "SolverCost") -> str:
    return f"about {duration(cost.seconds)}"


def _memory(cost: "SolverCost") -> str:
    size, unit = (MEGA, "MB") if cost.memory < 100.0 * MEGA else (1000.0 * MEGA, "GB")
    figure = cost.memory / size
    return f"{figure:.2g} {unit}" if figure < 100.0 else f"{figure:.0f} {unit}"
