"""The table of the plan of solder alone: particles, scheme, time steps."""

from collections.abc import Iterator

from rich.console import RenderableType

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.text import short
from reflowshock.workflow.process.plan_table import REFLOW_SPEED, new_table
from reflowshock.workflow.process.terminal import styled
from reflowshock.workflow.solder.forecast import SceneForecast

SCHEMES = {
    "energy": "least energy of the tracked surface at exactly the volume",
    "inertia": "tetrahedra that move with the liquid, second order in space and time; cost of all steps allowed",
    "gripc": "pressure correction as Hu et al. print it, for comparison only; its steps are not foreseen in the cost",
}


def scene_tables(case: Case, outlook: SceneForecast) -> Iterator[RenderableType]:
    """Yield particles, scheme and time steps; then what the costs assume."""
    table = new_table("\nReflow", "what", "value", "remark")
    table.add_row("particles", f"{outlook.particles}", f"{1e6 * outlook.spacing:.3g} um apart at the start")
    table.add_row("scheme", outlook.scheme, SCHEMES[outlook.scheme])
    table.add_row(
        "capillary limit", short(outlook.capillary_limit), "time step at which explicit surface tension breaks"
    )
    ratio = outlook.largest_step / outlook.capillary_limit
    table.add_row("largest time step", short(outlook.largest_step), f"{ratio:.3g} times the limit")
    yield table
    yield styled("\n[dim]{}", REFLOW_SPEED)
