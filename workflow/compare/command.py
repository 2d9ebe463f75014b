"""The command line of ``compare``."""

from pathlib import Path
from typing import Annotated

import typer

from reflowshock.workflow.process.terminal import console


def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="run folders, two or more")],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="also write an HTML page")] = None,
) -> None:
    """Show runs side by side: parameters and results in which they differ."""
    from reflowshock.workflow.compare.page import show, write
    from reflowshock.workflow.compare.runs import read_runs

    compared = read_runs(runs)
    if out is not None:
        write(compared, out)
    show(compared, console)
    if out is not None:
        console.print(f"page: {out}")
