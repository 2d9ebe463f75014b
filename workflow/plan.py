"""What a run would do, and what it would cost. Nothing is run, nothing is written."""

from collections.abc import Mapping

from rich.console import Console
from rich.table import Table

from reflowshock.workflow.board_drop.case import BoardDropCase, PackageCase
from reflowshock.workflow.board_drop.forecast import Forecast, forecast
from reflowshock.workflow.board_drop.shock_forecast import ShockForecast
from reflowshock.workflow.case.fields import display, leaves
from reflowshock.workflow.case.kind import FULL, Case
from reflowshock.workflow.effects.page import effects_table
from reflowshock.workflow.pipeline.reader import available_cores
from reflowshock.workflow.pipeline.stage_forecast import stage_seconds
from reflowshock.workflow.process.plan_table import duration, new_table, short
from reflowshock.workflow.process.terminal import styled
from reflowshock.workflow.solder.forecast import SceneForecast, forecast_scene
from reflowshock.workflow.store.keys import Change
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import Verdict, examine, why_stale
from reflowshock.workflow.store.store import Store
from reflowshock.workflow.structure import plan as structure_plan
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.forecast import StructureForecast, forecast_structure

LONGEST_LIST = 4
REFLOW_SPEED = "Costs assume the reflow speed in particles/parameters/estimate.py, as benchmarks/ measured it."
SCHEMES = {
    "energy": "least energy of the tracked surface at exactly the volume",
    "inertia": "tetrahedra that move with the liquid, second order in space and time; cost of all steps allowed",
    "gripc": "pressure correction as Hu et al. print it, for comparison only; its steps are not foreseen in the cost",
}


def show_plan(store: Store, point: Point, console: Console) -> None:
    """Print stages to run and why, effects, sizes, time steps, predicted cost and rank placement."""
    case = point.case
    scale = "" if case.scale == FULL else f", scale {case.scale}"
    console.print(styled("[bold]{}{}[/]  {}\n", case.case.name, scale, case.case.title))
    if isinstance(case, PackageCase):
        outlook = forecast(case)
        _show(store, point, outlook, console, "reflow" if outlook.shock is None else "reflow and shock")
        console.print(_sizes(case, outlook) if outlook.parts else f"\n{_joints(case, outlook)}")
        if not isinstance(case, BoardDropCase) or outlook.shock is None:
            console.print(styled("\n[dim]{}", REFLOW_SPEED))
            return
        console.print(_shock(case, outlook.shock))
        rate = f"{outlook.shock.updates_per_second:.1e} element updates per second and rank (fem/estimates/estimate.py)"
        console.print(styled("\n[dim]Costs assume {}", rate))
        console.print(
            styled("[dim]and the reflow speed in particles/parameters/estimate.py, both as benchmarks/ measured them.")
        )
    elif isinstance(case, StructureCase):
        motion = forecast_structure(case)
        _show(store, point, motion, console, "motion")
        for shown in (structure_plan.layers(motion), structure_plan.solvers(case, motion)):
            console.print(shown)
    else:
        body = forecast_scene(case)
        _show(store, point, body, console, "reflow")
        console.print(_particles(body))
        console.print(styled("\n[dim]{}", REFLOW_SPEED))


def _show(
    store: Store, point: Point, outlook: Forecast | SceneForecast | StructureForecast, console: Console, what: str
) -> None:
    console.print(_stages(store, point, foreseen_costs(point.case, outlook.seconds)))
    console.print(effects_table(point.case, outlook.effects, what))


def _particles(outlook: SceneForecast) -> Table:
    table = new_table("\nReflow", "what", "value", "remark")
    table.add_row("particles", f"{outlook.particles}", f"{1e6 * outlook.spacing:.3g} um apart at the start")
    table.add_row("scheme", outlook.scheme, SCHEMES[outlook.scheme])
    table.add_row(
        "capillary limit", short(outlook.capillary_limit), "time step at which explicit surface tension breaks"
    )
    ratio = outlook.largest_step / outlook.capillary_limit
    table.add_row("largest time step", short(outlook.largest_step), f"{ratio:.3g} times the limit")
    return table


def change_text(change: Change, case: Case) -> str:
    """Say what a parameter changed from and to, in the user's unit."""
    fields = {key: field for key, _, field in leaves(case)}

    def text(value: object) -> str:
        if value is None:
            return "nothing"
        if change.key not in fields:
            return str(value)
        return display(tuple(value) if isinstance(value, list) else value, fields[change.key])

    return f"{change.key}: {text(change.old)} -> {text(change.new)}"


def reason(verdict: Verdict, case: Case) -> str:
    """Say why a stage will run or not."""
    if not verdict.stale:
        redone = ", ".join(verdict.because_of)
        return f"up to date, if {redone} comes out the same" if redone else "up to date"
    if verdict.missing:
        return "no product yet"
    if verdict.damaged:
        return why_stale(verdict)
    changes = [change_text(change, case) for change in verdict.changes]
    if len(changes) > LONGEST_LIST:
        changes = [*changes[:LONGEST_LIST], f"and {len(changes) - LONGEST_LIST} more"]
    if verdict.because_of:
        changes.append("follows " + ", ".join(verdict.because_of))
    return "\n".join(changes) or "no product yet"


def predicted_seconds(store: Store, point: Point, until: str) -> float:
    """Predict the wall time [s] of all that has to be made up to a stage, corrected by what accuracy measured here."""
    from reflowshock.workflow.convergence.calibration import calibration_of

    known, seconds = calibration_of(point.case), stage_seconds(point.case)
    verdicts = examine(store, point)
    stages = [stage.name for stage in point.case.pipeline.upstream(until) if verdicts[stage.name].stale]
    own = [(name, seconds[name]) for name in stages if name in seconds]
    return sum(known.seconds(name, foreseen) if known is not None else foreseen for name, foreseen in own)


def foreseen_costs(case: Case, seconds: Mapping[str, float]) -> dict[str, str]:
    """Write the predicted wall time of stages; corrected by what the command accuracy measured here."""
    from reflowshock.workflow.convergence.calibration import calibration_of

    known, texts = calibration_of(case), {}
    for stage, foreseen in seconds.items():
        measured = known is not None and known.knows(stage)
        cost = known.seconds(stage, foreseen) if known is not None else foreseen
        source = f" (measured: accuracy, {known.points} points)" if known is not None and measured else ""
        texts[stage] = f"about {duration(cost)}{source}"
    return texts


def _stages(store: Store, point: Point, costs: Mapping[str, str]) -> Table:
    table = new_table(f"Stages, in {store.folder}", "stage", "", "cost", "why")
    for name, verdict in examine(store, point).items():
        mark = styled("[yellow]run[/]" if verdict.stale else "[green]skip[/]")
        cost = costs.get(name, "") if verdict.stale else ""
        table.add_row(name, mark, cost, reason(verdict, point.case))
    return table


def _sizes(case: PackageCase, outlook: Forecast) -> Table:
    table = new_table("\nSizes and critical time steps", "part", "hexahedra", "critical step", "time step")
    step = {name: level for level in (outlook.shock.levels if outlook.shock else ()) for name in level.parts}
    for name, part in outlook.parts.items():
        remark = f"{short(step[name].step)}, {step[name].count} in a window" if name in step else ""
        if part.mass_scaled:
            remark += "; mass scaled to the smallest step of the others"
        table.add_row(name, f"{part.elements}", short(part.critical_step), remark)
    total = sum(part.elements for part in outlook.parts.values())
    table.add_row("all", f"{total}", "", "", style="bold")
    table.caption = _joints(case, outlook)
    table.caption_justify = "left"
    return table


def _joints(case: PackageCase, outlook: Forecast) -> str:
    smallest, largest = outlook.particles
    particles = f"{smallest}" if smallest == largest else f"{smallest} to {largest}"
    distinct = f"up to {outlook.distinct}" if outlook.load_steps else f"{outlook.distinct}"
    heated = f", {outlook.load_steps} load steps with liquid solder" if outlook.load_steps else ""
    ranks = f", on {case.reflow.ranks} MPI ranks" if case.reflow.ranks is not None else ""
    return f"{outlook.joints} joints, {distinct} of them distinct, {particles} particles each{heated}{ranks}"


def _shock(case: BoardDropCase, shock: ShockForecast) -> Table:
    every = case.shock.ranks.total
    table = new_table("\nShock", "what", "value", "remark")
    scheme, why = shock.scheme
    table.add_row("scheme", scheme.replace("_", " "), why)
    table.add_row("fine joints", *_fine_joints(case))
    table.add_row("window", short(shock.window), f"step of the macro model, {shock.windows} windows")
    table.add_row("steps in a window", *_levels(shock))
    table.add_row("step ratio m", f"{shock.substeps}", f"step of the DNS {short(shock.window / shock.substeps)}")
    if shock.search:
        table.add_row("coarse run", f"about {duration(shock.search)}", "all joints coarse: it finds the critical ones")
    table.add_row("two-scale", f"about {duration(shock.two_scale)}", _placement(case) + _absent("two_scale", case))
    if case.shock.identical_joints:
        again = shock.two_scale if "two_scale" in case.shock.numerics.modes else shock.dns
        table.add_row("identical joints", f"about {duration(again)}", "the first mode again: what shapes change")
    part = f"; the first {short(shock.dns_share * case.shock.duration)}" if shock.dns_share < 1.0 else ""
    dns = f"all {every} ranks on one model{part}" + _absent("dns", case)
    table.add_row("DNS", f"about {duration(shock.dns)}", dns)
    table.add_row(
        "DNS, implicit steps", f"about {duration(shock.implicit)}", "one rank; elastic only (shock.numerics.dns_solver)"
    )
    per_time = " for as much simulated time" if part else ""
    table.add_row("two-scale / DNS", f"{shock.ratio:.2f}", f"predicted ratio of wall times{per_time}")
    return table


def _levels(shock: ShockForecast) -> tuple[str, str]:
    """Say how many steps the levels take in a window, and what share of the elements is not at the window's."""
    elements = [level.elements for level in shock.levels]
    counts = ", ".join(str(level.count) for level in shock.levels)
    share = 1.0 - elements[0] / sum(elements)
    return (
        counts,
        f"of {' + '.join(map(str, elements))} hexahedra; meso share f = {share:.2f}, elements beside them left out",
    )


def _fine_joints(case: BoardDropCase) -> tuple[str, str]:
    """Say how many joints are fine, and which."""
    coupling = case.shock.coupling
    if coupling.fine_joints == "critical":
        return f"{coupling.critical_joints}", "the most stressed ones of a run with coarse joints before"
    if coupling.fine_joints == "all":
        return "all", "one-way: coarse in the macro model" if coupling.direction == "one_way" else ""
    return f"{len(set(coupling.fine_joints))}", ", ".join(coupling.fine_joints)


def _placement(case: BoardDropCase) -> str:
    """Say which MPI rank works on which model."""
    ranks, cores = case.shock.ranks, f"on {available_cores()} cores"
    if ranks.total == 1:
        return f"one rank, {cores}"
    if ranks.placement == "shared":
        return f"all {ranks.total} ranks on both models in turn, {cores}"
    macro = f"{ranks.macro} of {ranks.total}" if ranks.macro else f"some of {ranks.total}"
    own = f"{macro} ranks on the macro model, the others on the meso model, at the same time"
    if ranks.placement == "disjoint":
        return f"{own}, {cores}"
    return f"all {ranks.total} ranks on both models in turn, or each on one, as speeds measured by the run say, {cores}"


def _absent(mode: str, case: BoardDropCase) -> str:
    return "" if mode in case.shock.numerics.modes else "; not in shock.numerics.modes"
