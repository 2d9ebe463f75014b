"""Tables of the plan of a structure: its layers, and what either solver would cost."""

from rich.table import Table

from workflow.plan_table import new_table, short
from workflow.structure_case import StructureCase
from workflow.structure_forecast import StructureForecast


def layers(outlook: StructureForecast) -> Table:
    """Elements and critical steps of the layers, top first."""
    table = new_table("\nLayers, top first", "layer", "elements", "critical step", "material")
    for name, layer in reversed(outlook.layers.items()):
        remark = "; mass scaled to the smallest step of the others" if layer.mass_scaled else ""
        table.add_row(name, f"{layer.elements}", short(layer.critical_step), layer.material + remark)
    table.add_row("all", f"{sum(layer.elements for layer in outlook.layers.values())}", "", "", style="bold")
    return table


def motion(case: StructureCase, outlook: StructureForecast) -> Table:
    """Steps and cost of both solvers."""
    table = new_table("\nMotion", "what", "value", "remark")
    fraction = case.dynamics.numerics.step_fraction
    table.add_row("explicit step", short(outlook.step), f"{fraction:g} of the smallest critical step")
    table.add_row("explicit steps", f"{outlook.steps}", f"{short(case.dynamics.duration)} in all")
    return table
