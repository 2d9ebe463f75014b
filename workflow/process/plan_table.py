"""Tables of the plan."""

from rich.table import Table

REFLOW_SPEED = "Costs assume the reflow speed in particles/parameters/estimate.py, as benchmarks/ measured it."


def new_table(title: str, *columns: str) -> Table:
    """Return an empty table; its last column takes what room is left."""
    table = Table(title=title, title_justify="left", title_style="bold", expand=True, show_edge=False, pad_edge=False)
    for position, name in enumerate(columns):
        last = position == len(columns) - 1
        table.add_column(name, no_wrap=not last, overflow="fold", ratio=1 if last else None)
    return table
