"""Tables of the plan of a structure: its layers, and what either solver would cost."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.table import Table

from reflowshock.workflow.case.text import duration, short
from reflowshock.workflow.process.plan_table import new_table
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.forecast import CoupledForecast, StructureForecast

if TYPE_CHECKING:
    from reflowshock.fem.estimates.solver_cost import SolverCost

MEGA = 1.0e6


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
