"""Tables of the plan, and times in them."""

from rich.table import Table


def new_table(title: str, *columns: str) -> Table:
    """Return an empty table; its last column takes what room is left."""
    table = Table(title=title, title_justify="left", title_style="bold", expand=True, show_edge=False, pad_edge=False)
    for position, name in enumerate(columns):
        last = position == len(columns) - 1
        table.add_column(name, no_wrap=not last, overflow="fold", ratio=1 if last else None)
    return table


def duration(seconds: float) -> str:
    """Write a wall time with two digits, in the unit that makes its figure readable."""
    units = ((1.0, "s"), (60.0, "min"), (3600.0, "h"))
    size, unit = next(((s, u) for s, u in units if seconds < 100.0 * s), (86400.0, "days"))
    return f"{seconds / size:.2g} {unit}" if seconds < 100.0 * size else f"{seconds / size:.0f} {unit}"


def short(seconds: float) -> str:
    """Write a time step in the unit that makes its figure readable."""
    factor, unit = next(((f, u) for f, u in ((1e9, "ns"), (1e6, "us")) if f * seconds < 1e3), (1e3, "ms"))
    return f"{factor * seconds:.3g} {unit}"
