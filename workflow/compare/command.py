"""The command line of ``compare``."""

from pathlib import Path
from typing import Annotated

import typer

from reflowshock.workflow.process.terminal import console


def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="run folders, two or more")],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="write a page with all of it too")] = None,
) -> None:
    """Show runs side by side: in which parameters and answers they differ."""
    from reflowshock.workflow.compare.page import show, write
    from reflowshock.workflow.compare.runs import read_runs

    found = read_runs(runs)
    if out is not None:
        write(found, out)
    show(found, console)
    if out is not None:
        console.print(f"page: {out}")
