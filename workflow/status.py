"""Status of a run folder: state, time and key figures of each stage."""

import time

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from reflowshock.units import from_si
from reflowshock.workflow.case.stage import ERRORS
from reflowshock.workflow.case.text import duration
from reflowshock.workflow.pipeline.companions import companion_points
from reflowshock.workflow.process.progress_file import read_progress
from reflowshock.workflow.process.terminal import style_text
from reflowshock.workflow.store.companions import UNTIL, companion_title
from reflowshock.workflow.store.folders import is_busy
from reflowshock.workflow.store.point import Point
from reflowshock.workflow.store.state import StageState, examine
from reflowshock.workflow.store.store import Store

LOOK = 0.5  # interval between two updates [s]
SHOWN_UNITS = {"m": "mm", "m^3": "mm^3", "Pa": "MPa", "J": "mJ", "J/m^3": "kJ/m^3", "kg": "mg", "s": "ns"}
FIGURES = {
    "geometry": ("joint_count", "elements_board", "elements_board_patch", "elements"),
    "reflow": (
        "distinct_shapes", "load_steps", "coupling_residual_max", "standoff_min", "standoff_max",
        "joint_width_min", "joint_width_max", "joint_width_error_max",
        "height", "max_width", "waist", "contact_angle", "height_error", "max_width_error", "verdict",
    ),
    "surface": ("surface_volume_error_max",),
    "solder_mesh": ("joint_volume_error_max", "joint_scaled_jacobian_min", "joint_critical_time_step"),
    "shock": (
        "critical_joint", "peel_stress", "layer_von_mises", "layer_plastic_work",
        "shape_effect_on_peak_stress", "residual_stress_largest",
        "peak_board_strain", "deflection_over_thickness", "step_ratio", "critical_joint_stress_error",
        "die_displacement_error", "two_scale_dns_core_ratio", "first_frequency", "steps", "energy_balance_error",
    ),
    "comparison": (
        "displacement_difference", "strain_difference", "wave_speed_error", "transmitted_velocity_error",
        "reflected_velocity_error", "tip_deflection_error", "swing_frequency_error",
    ),
    "errors": ("companion_cost_share",),
    "report": (),
}  # fmt: skip


def follow_run(store: Store, point: Point, console: Console) -> None:
    """Show the progress and the remaining time of the running stages until the run ends.

    Args:
        store: Store of the run folder, in which another process runs.
        point: Case of the run with its settings.
        console: Console to print to.
    """
    if not is_busy(store.folder):
        console.print(f"no run is active in {store.folder}")
        return
    printed = ""
    with Live(console=console, transient=True, auto_refresh=False) as live:
        while is_busy(store.folder):
            lines = [line for stage in point.digests if (line := _progress(store, point, stage))]
            lines += _companion_progress(store, point)
            live.update(Text("\n".join(lines) or "waiting for the next stage …"), refresh=True)
            begun = ", ".join(line.partition(":")[0] for line in lines)
            if not console.is_terminal and begun and begun != printed:
                printed = begun
                console.print("\n".join(lines))
            time.sleep(LOOK)


def _companion_progress(store: Store, point: Point) -> list[str]:
    """Return the progress of the shock of each companion as text, empty if it is not running."""
    companions = companion_points(store, point).items()
    lines = {name: _progress(store, companion, UNTIL) for name, companion in companions}
    return [f"{companion_title(name)}, {line}" for name, line in lines.items() if line]


def _progress(store: Store, point: Point, stage: str) -> str:
    """Return the progress of a stage as text, or an empty string if it is not running."""
    progress = read_progress(store.work_folder(point, stage))
    if progress is None:
        return ""
    left = f", about {duration(progress.left)} left" if progress.left is not None else ""
    return f"{stage}: {progress.what}, {100.0 * progress.share:.0f} %{left}"


def show_status(store: Store, point: Point, console: Console) -> None:
    """Print state, wall time and main figures of each stage of a run; nothing is changed.

    Args:
        store: Store of the run folder, whose files are checked.
        point: Case of the run with its settings.
        console: Console to print to.
    """
    table = Table(title=f"{point.case.case.name} in {store.folder}", title_justify="left", expand=True)
    table.add_column("stage", no_wrap=True)
    table.add_column("state", no_wrap=True)
    table.add_column("time", justify="right", no_wrap=True)
    table.add_column("figures", ratio=1)
    for name, state in examine(store, point).items():
        if name == ERRORS.name:
            _add_companions(table, store, point)
        _add_row(table, store.record(point, name), name, name, state)
    console.print(table)


def _add_companions(table: Table, store: Store, point: Point) -> None:
    """Add a row for the shock of each companion."""
    for name, companion in companion_points(store, point).items():
        state = examine(store, companion)[UNTIL]
        _add_row(table, store.record(companion, UNTIL), f"{UNTIL}, {companion_title(name)}", UNTIL, state)


def _add_row(table: Table, record: dict | None, title: str, stage: str, state: StageState) -> None:
    """Add the row of a stage from its record, which may be missing."""
    known = record or {"metrics": {}, "health": {}}
    seconds = f"{known['seconds']:.1f} s" if "seconds" in known else ""
    figures = ", ".join(state.damaged) or _figures(stage, known["metrics"])
    table.add_row(title, _state(state, known["health"]), seconds, figures)


def metric_text(metric: dict) -> str:
    """Format the value of a metric in a customary unit, such as MPa for stresses.

    Args:
        metric: Record with ``value`` (SI) and ``unit``.
    """
    value, unit = metric["value"], metric["unit"]
    if isinstance(value, str | bool | int) or value is None:
        return f"{value} {unit}".strip()
    return from_si(value, SHOWN_UNITS[unit], 4) if unit in SHOWN_UNITS else f"{value:.4g} {unit}".strip()


def _state(state: StageState, health: dict) -> Text:
    if state.missing:
        return style_text("[dim]missing[/]")
    if state.damaged:
        return style_text("[bold red]damaged[/]")
    if state.stale:
        return style_text("[yellow]stale[/]")
    if not all(check["ok"] for check in health.values()):
        return style_text("[bold red]unhealthy[/]")
    return style_text("[green]done[/]")


def _figures(stage: str, metrics: dict) -> str:
    names = [name for name in FIGURES[stage] if name in metrics]
    return ", ".join(f"{name.replace('_', ' ')} {metric_text(metrics[name])}" for name in names)
