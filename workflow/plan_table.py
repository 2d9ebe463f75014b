"""Tables of the plan, and times in them."""

from rich.table import Table


def new_table(title: str, *columns: str) -> Table:
    """Return an empty table; its last column takes what room is left."""
    table = Table(title=title, title_justify="left", title_style="bold", expand=True, show_edge=False, pad_edge=False)
    for position, name in enumerate(columns):
        last = position == len(columns) - 1
        table.add_column(name, no_wrap=not last, ratio=1 if last else None)
    return table


def duration(seconds: float) -> str:
    """Write a wall time with two digits."""
    return f"{seconds:.2g} s" if seconds < 100 else f"{seconds / 60:.2g} min"


def short(seconds: float) -> str:
    """Write a time step in the unit that makes its figure readable."""
    factor, unit = next(((f, u) for f, u in ((1e9, "ns"), (1e6, "us")) if f * seconds < 1e3), (1e3, "ms"))
    return f"{factor * seconds:.3g} {unit}"
