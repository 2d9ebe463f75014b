"""Predicted size, time steps and cost of a structure, and its tables in the output of ``plan``."""

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
START_UP_SECONDS = 4.0  # time for the ranks of a solver to load libraries and kernels


@dataclass(frozen=True, slots=True)
class LayerForecast:
    """Layer of the mesh: material, number of elements, smallest critical time step [s], whether it is mass scaled."""

    material: str
    elements: int
    critical_step: float
    mass_scaled: bool


@dataclass(frozen=True, slots=True)
class CoupledForecast:
    """Two coupled models: fine layers, window [s], substeps per window, predicted wall time on one core [s]."""

    fine: tuple[str, ...]
    window: float
    substeps: int
    seconds: float


@dataclass(frozen=True, slots=True)
class StructureForecast:
    """Predicted size and cost of a run.

    Attributes:
        effects: State of each effect, ``{"on", "why"}``.
        layers: Size and critical step of each layer.
        steps: Time step of each solver [s].
        solvers: Cost of the solvers on one core, and the cheaper one.
        coupled: Forecast of the two-scale run; None without coupling.
        seconds: Wall time of each stage [s].
    """

    effects: Mapping[str, Any]
    layers: dict[str, LayerForecast]
    steps: dict[str, float]
    solvers: "SolverForecast"
    coupled: CoupledForecast | None
    seconds: dict[str, float]


def forecast_structure(case: StructureCase) -> StructureForecast:
    """Predict sizes, time steps and cost of a run, without running it.

    Args:
        case: Case of a structure.

    Returns:
        Effects, size and critical step of each layer, time step and cost of each solver, wall time by stage [s].
    """
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
    seconds = {"shock": sum(START_UP_SECONDS + cost[solver] for solver in dynamics.solvers)}
    return StructureForecast(effects(case.problem, added_mass(case, layers)), layers, steps, solvers, coupled, seconds)


def forecast_coupled(case: StructureCase, layers: Mapping[str, LayerForecast], update: float) -> CoupledForecast | None:
    """Predict window (time between exchanges of both models) and cost of a two-scale run, without buffers and levels.

    Args:
        case: Case of a structure.
        layers: Size and critical step of each layer.
        update: Wall time of one update of one element on one core [s].

    Returns:
        Fine layers, window and cost; None for a case without coupling.
    """
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
    """Predict the critical time step of the explicit scheme with damping, the smallest of all layers [s].

    Args:
        case: Case of a structure, with its damping and mass scaling.
        layers: Number of elements and critical step of each layer by name; mass-scaled layers are left out.
    """
    from reflowshock.fem.estimates.estimate import damped_critical_step

    undamped = min(layer.critical_step for layer in layers.values() if not layer.mass_scaled)
    return damped_critical_step(undamped, case.dynamics.damping.coefficients[1])


def forecast_steps(case: StructureCase, layers: Mapping[str, LayerForecast]) -> dict[str, float]:
    """Predict the time step [s] of each solver: "explicit", "dns" (one model, explicit) and "implicit".

    Args:
        case: Case of a structure.
        layers: Size and critical step of each layer by name.
    """
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
    """Yield problems of time steps: undefined, too many, above the critical step, or windows longer than a pulse.

    Args:
        case: Case of a structure; a window is the time between two exchanges of its models.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    import numpy as np

    try:
        with np.errstate(all="ignore"):
            layers = forecast_layers(case)
    except np.linalg.LinAlgError:
        yield Problem(
            "structure", "the critical time step cannot be computed: sizes, densities or moduli are out of range"
        )
        return
    numerics, critical = case.dynamics.numerics, critical_step(case, layers)
    exact = numerics.critical_step == "element" and case.structure.holes is None
    if numerics.explicit_step and exact and numerics.explicit_step > critical and "explicit" in case.dynamics.solvers:
        message = "exceeds the critical step, so the solution would be unstable"
        allowed = f"<= {short(critical)}; critical_step = power_iteration may allow more"
        yield Problem("dynamics.numerics.explicit_step", message, short(numerics.explicit_step), allowed)
    steps = forecast_steps(case, layers)
    for solver in case.dynamics.solvers:
        yield from too_many_steps("dynamics.duration", case.dynamics.duration, steps[solver], solver)
    coupled = forecast_coupled(case, layers, 0.0)
    if coupled is not None:
        yield from shorter_than_window(case, coupled.window)


def shorter_than_window(case: StructureCase, window: float) -> Iterator[Problem]:
    """Yield problems of load pulses that are shorter than the coupling window.

    Args:
        case: Case of a structure with its loads.
        window: Length of the coupling window, the time between two exchanges of the models [s].

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of

    for name, pulse in pulses_of(case.loads).items():
        shortest = min(pulse_durations({name: pulse}), default=window)
        if shortest < window:
            message = f"is shorter than one coupling window ({short(window)})"
            allowed = f">= {short(window)}, smaller elements of the coarse layers, or no dynamics.coupling"
            yield Problem(f"loads.{name}.duration", message, short(shortest), allowed)


def forecast_layers(case: StructureCase) -> dict[str, LayerForecast]:
    """Predict the size of the mesh of every layer of a structure.

    Args:
        case: Case of a structure.

    Returns:
        Name of a layer -> number of elements and critical time step [s].
    """
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
    """Predict the mass added by raising the steps of mass-scaled layers to the smallest of the others [kg].

    Args:
        case: Case of a structure.
        layers: Size and critical step of each layer by name.
    """
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
    """Predict wall times and memory of the stages of a case.

    Args:
        case: Case of a structure.

    Returns:
        Seconds by stage, number of joints (1), and memory [B].
    """
    outlook = forecast_structure(case)
    elements = sum(layer.elements for layer in outlook.layers.values())
    implicit = outlook.solvers.implicit.memory if "implicit" in case.dynamics.solvers else 0.0
    return Size(outlook.seconds, 1, BYTES_OF_ELEMENT * elements + outlook.solvers.explicit.memory + implicit)


def structure_tables(case: StructureCase, outlook: StructureForecast) -> Iterator[RenderableType]:
    """Yield the tables that ``plan`` prints: elements and critical steps of layers; steps, cost and memory of solvers.

    Args:
        case: Case of a structure.
        outlook: Forecast by ``forecast_structure``.
    """
    yield layers_table(outlook)
    yield solvers_table(case, outlook)


def layers_table(outlook: StructureForecast) -> Table:
    """Return a table for the terminal with one row per layer, top first, and the total.

    Args:
        outlook: Forecast by ``forecast_structure``.

    Returns:
        Table of elements, critical step and material.
    """
    table = new_table("\nLayers, top first", "layer", "elements", "critical step", "material")
    for name, layer in reversed(outlook.layers.items()):
        remark = "; mass scaled to the smallest step of the others" if layer.mass_scaled else ""
        table.add_row(name, f"{layer.elements}", short(layer.critical_step), layer.material + remark)
    table.add_row("all", f"{sum(layer.elements for layer in outlook.layers.values())}", "", "", style="bold")
    return table


def solvers_table(case: StructureCase, outlook: StructureForecast) -> Table:
    """Return a table for the terminal of the solvers, with a caption that recommends one.

    Args:
        case: Case of a structure.
        outlook: Forecast by ``forecast_structure``.

    Returns:
        Table of step, number of steps, cost and memory: explicit, implicit and, if coupled, the two-scale run.
    """
    table = new_table("\nSolvers, on one core", "solver", "step", "steps", "cost", "memory", "remark")
    numerics, forecast = case.dynamics.numerics, outlook.solvers
    is_prescribed = numerics.explicit_step is not None
    fraction = "as given" if is_prescribed else f"{numerics.step_fraction:g} of the smallest critical step"
    factor = f"including {duration(forecast.implicit.setup)} for the factorisation"
    for name, cost, remark in (("explicit", forecast.explicit, fraction), ("implicit", forecast.implicit, factor)):
        unused = "" if name in case.dynamics.solvers else "; not in dynamics.solver"
        table.add_row(name, short(outlook.steps[name]), f"{cost.steps}", _about(cost), _memory(cost), remark + unused)
    if outlook.coupled:
        table.add_row("two models", *_coupled(outlook.coupled))
    table.caption, table.caption_justify = forecast.sentence, "left"
    return table


def _coupled(coupled: CoupledForecast) -> tuple[str, str, str, str, str]:
    """Return the cells of a two-scale run: window, substeps, cost, memory, remark."""
    remark = f"window; fine layers: {', '.join(coupled.fine) or 'none'}; without buffers and step levels"
    return short(coupled.window), f"m = {coupled.substeps}", f"about {duration(coupled.seconds)}", "", remark


def _about(cost: "SolverCost") -> str:
    return f"about {duration(cost.seconds)}"


def _memory(cost: "SolverCost") -> str:
    size, unit = (MEGA, "MB") if cost.memory < 100.0 * MEGA else (1000.0 * MEGA, "GB")
    figure = cost.memory / size
    return f"{figure:.2g} {unit}" if figure < 100.0 else f"{figure:.0f} {unit}"
