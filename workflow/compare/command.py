"""The command line of ``compare``."""

from pathlib import Path
from typing import Annotated

import typer

from reflowshock.workflow.process.terminal import console


def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="run folders, two or more")],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="also write an HTML page")] = None,
) -> None:
    """Show runs side by side: parameters and results in which they differ.

    The first run is the reference of all changes. The runs must be of the same kind of case. With --out an HTML page
    with all results and charts is written, too; without it nothing is written.
    """
    from reflowshock.workflow.compare.page import show, write
    from reflowshock.workflow.compare.runs import read_runs

    compared = read_runs(runs)
    if out is not None:
        write(compared, out)
    show(compared, console)
    if out is not None:
        console.print(f"page: {out}")
