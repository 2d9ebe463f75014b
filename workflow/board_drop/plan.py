"""Tables of the plan of a package: sizes, time steps, schemes, cost and rank placement."""

from collections.abc import Iterator

from rich.console import RenderableType
from rich.table import Table

from reflowshock.workflow.board_drop.duration import longest_duration
from reflowshock.workflow.board_drop.forecast import PackageForecast
from reflowshock.workflow.board_drop.shock_forecast import ShockForecast
from reflowshock.workflow.case.text import duration, short
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.environment import available_cores
from reflowshock.workflow.process.rank_count import decide_ranks
from reflowshock.workflow.process.terminal import REFLOW_SPEED, new_table, style_text

SETTLES = "ends half a swing of the board after the largest stress of the joints"
DECAYS = f"{SETTLES}; two more swings of a coarse run, or of this one, exclude larger ones later"


def package_tables(case: PackageCase, outlook: PackageForecast) -> Iterator[RenderableType]:
    """Yield the lines of ``plan`` for a package without a shock: its joints, and the assumed speed of the reflow.

    Args:
        case: Case of a package.
        outlook: Forecast of the case: number and particles of its joints, wall times.

    Yields:
        Lines of text for the terminal.
    """
    yield f"\n{_joints(case, outlook)}"
    yield style_text("\n[dim]{}", REFLOW_SPEED)


def board_drop_tables(case: BoardDropCase, outlook: PackageForecast) -> Iterator[RenderableType]:
    """Yield the tables and lines of ``plan`` for a board drop: mesh sizes, shock, and the assumed speeds.

    Args:
        case: Case of a board drop.
        outlook: Forecast of the case, with its shock.

    Yields:
        Tables and lines of text for the terminal.
    """
    assert outlook.shock is not None
    yield _sizes(case, outlook)
    yield _shock(case, outlook.shock, outlook.search)
    rate = f"{outlook.shock.updates_per_second:.1e} element updates per second and rank (fem/estimates/estimate.py)"
    yield style_text("\n[dim]Costs assume {}", rate)
    yield style_text(
        "[dim]and the reflow speed in particles/parameters/estimate.py, both as benchmarks/ measured them."
    )


def _sizes(case: PackageCase, outlook: PackageForecast) -> Table:
    table = new_table("\nSizes and critical time steps", "part", "hexahedra", "critical step", "time step")
    step = {name: level for level in (outlook.shock.levels if outlook.shock else ()) for name in level.parts}
    for name, part in outlook.parts.items():
        remark = f"{short(step[name].step)}, {step[name].count} per window" if name in step else ""
        if part.scaled_step > part.critical_step:
            remark += f"; mass scaled to a critical step of {short(part.scaled_step)}"
        table.add_row(name, f"{part.elements}", short(part.critical_step), remark)
    total = sum(part.elements for part in outlook.parts.values())
    table.add_row("all", f"{total}", "", "", style="bold")
    table.caption = _joints(case, outlook)
    table.caption_justify = "left"
    return table


def _joints(case: PackageCase, outlook: PackageForecast) -> str:
    smallest, largest = outlook.particles
    particles = f"{smallest}" if smallest == largest else f"{smallest} to {largest}"
    distinct = f"up to {outlook.distinct}" if outlook.load_steps else f"{outlook.distinct}"
    heated = f", {outlook.load_steps} load steps with liquid solder" if outlook.load_steps else ""
    ranks = f", on {case.reflow.ranks} MPI ranks" if case.reflow.ranks is not None else ""
    scheme = ", by ISPG" if case.solder.numerics.scheme == "ispg" else ""
    return f"{outlook.joints} joints, {distinct} of them distinct, {particles} particles each{scheme}{heated}{ranks}"


def _expected(shock: ShockForecast, seconds: float) -> str:
    """Return the expected and the longest wall time as text, from the wall time [s] of the longest duration."""
    most = f", at most {duration(seconds)}" if shock.share < 1.0 else ""
    return f"about {duration(shock.share * seconds)}{most}"


def _shock(case: BoardDropCase, shock: ShockForecast, search: float) -> Table:
    rank_count = case.ranks
    table = new_table("\nShock", "what", "value", "remark")
    table.add_row("scheme", shock.scheme.replace("_", " "), shock.reason)
    table.add_row("fine joints", *_fine_joints(case))
    if case.shock.duration == "auto":
        longest, expected = short(longest_duration(case)), short(shock.share * longest_duration(case))
        ending = DECAYS if case.shock.damping.acts else SETTLES
        table.add_row("duration", f"about {expected}, at most {longest}", ending)
    table.add_row("window", short(shock.window), f"step of the macro model, {shock.windows} windows")
    table.add_row("steps per window", *_levels(shock))
    table.add_row("step ratio m", f"{shock.substeps}", f"step of the DNS {short(shock.window / shock.substeps)}")
    if search:
        table.add_row("search", f"about {duration(search)}", "coarse joints, larger elements: critical joints and end")
    table.add_row("two-scale", _expected(shock, shock.two_scale), _placement(case) + _absent("two_scale", case))
    if case.shock.identical_joints:
        again = shock.two_scale if "two_scale" in case.shock.numerics.modes else shock.dns
        table.add_row("identical joints", _expected(shock, again), "the first mode again, with identical joint shapes")
    part = f"; the first {short(shock.dns_share * longest_duration(case))}" if shock.dns_share < 1.0 else ""
    dns = f"all {rank_count} ranks on one model{part}" + _absent("dns", case)
    table.add_row("DNS", _expected(shock, shock.dns), dns)
    table.add_row(
        "DNS, implicit steps", f"about {duration(shock.implicit)}", "one rank; elastic only (shock.numerics.dns_solver)"
    )
    per_time = " for as much simulated time" if part else ""
    table.add_row("two-scale / DNS", f"{shock.ratio:.2f}", f"predicted ratio of wall times{per_time}")
    return table


def _levels(shock: ShockForecast) -> tuple[str, str]:
    """Return the steps of the levels in a window, and the share of elements below the window level, as text."""
    elements = [level.elements for level in shock.levels]
    counts = ", ".join(str(level.count) for level in shock.levels)
    share = 1.0 - elements[0] / sum(elements)
    return (
        counts,
        f"of {' + '.join(map(str, elements))} hexahedra; meso share f = {share:.2f}, buffer elements not counted",
    )


def _fine_joints(case: BoardDropCase) -> tuple[str, str]:
    """Return the number of fine joints and their names, as text."""
    coupling = case.shock.coupling
    if coupling.fine_joints == "critical":
        return f"{coupling.critical_joints}", "the most stressed joints of a preceding run with coarse joints"
    if coupling.fine_joints == "all":
        return "all", "one-way: coarse in the macro model" if coupling.direction == "one_way" else ""
    return f"{len(set(coupling.fine_joints))}", ", ".join(coupling.fine_joints)


def _placement(case: BoardDropCase) -> str:
    """Return the placement of the models on the MPI ranks, as text."""
    ranks, cores = case.shock.ranks, f"on {available_cores()} cores"
    if ranks.total == "auto":
        now = decide_ranks(case.least_ranks, case.ranks, available_cores())
        return f"for {ranks.most} ranks, {cores}; decided when it starts, now {now}"
    if ranks.total == 1:
        return f"one rank, {cores}"
    if ranks.placement == "shared":
        return f"all {ranks.total} ranks on both models in turn, {cores}"
    macro = f"{ranks.macro} of {ranks.total}" if ranks.macro else f"some of {ranks.total}"
    disjoint = f"{macro} ranks on the macro model, the others on the meso model, at the same time"
    if ranks.placement == "disjoint":
        return f"{disjoint}, {cores}"
    shared = f"all {ranks.total} ranks on both models in turn, or each on one"
    return f"{shared}, decided by speeds measured during the run, {cores}"


def _absent(mode: str, case: BoardDropCase) -> str:
    return "" if mode in case.shock.numerics.modes else "; not in shock.numerics.modes"
