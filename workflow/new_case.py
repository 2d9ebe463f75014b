"""Commands that write a case file: ``new`` from a template, ``init`` from five answers, ``import`` from ECAD data."""

from pathlib import Path
from typing import Annotated

import typer

from reflowshock.workflow.process.terminal import console


def new(
    name: Annotated[str, typer.Argument(help="name of the case; the file is NAME.toml")],
    template: Annotated[str, typer.Option(help="case to start from")] = "jedec_bga",
) -> None:
    """Write a complete, commented case file.

    The file NAME.toml in the current folder has every parameter of the shipped case --template, in the user's units.
    An existing file is an error; it is not replaced.
    """
    from reflowshock.workflow.pipeline.template import write_new_case

    path = write_new_case(name, template)
    console.print(f"wrote {path}; next: reflowshock plan {path}")


def init(
    name: Annotated[str | None, typer.Option(help="name of the case")] = None,
    array: Annotated[str | None, typer.Option(help='rows x columns at pitch, e.g. "6 x 6 at 0.8 mm"')] = None,
    ball: Annotated[str | None, typer.Option(help='diameter of a solder ball, e.g. "0.48 mm", or usual')] = None,
    board: Annotated[str | None, typer.Option(help='length x width x thickness, e.g. "132 x 77 x 1 mm"')] = None,
    drop: Annotated[str | None, typer.Option(help="service condition of JESD22-B110B, A to H")] = None,
) -> None:
    """Ask five questions about a package on a board, and write a case that runs.

    An option answers its question, which is then not asked. The file is written to the current folder under the name of
    the case; an existing file is not replaced.
    """
    from reflowshock.workflow.ecad.command import ask_for_case

    options = {"name": name, "array": array, "ball": ball, "board": board, "drop": drop}
    path = ask_for_case(options, lambda prompt, default: typer.prompt(prompt, default=default))
    console.print(f"wrote {path}; next: reflowshock run {path}")


def import_board(
    board: Annotated[
        Path, typer.Argument(metavar="BOARD", help="KiCad (.kicad_pcb), IPC-2581 (.xml), CSV, or a folder of Gerber X2")
    ],
    component: Annotated[
        str | None,
        typer.Option(metavar="U8", help="component whose joints are computed; without it, the components are listed"),
    ] = None,
    name: Annotated[str | None, typer.Option(help="name of the case (default: board and component)")] = None,
    thickness: Annotated[
        str | None, typer.Option(help='thickness of the board if the file does not give it, e.g. "1.6 mm"')
    ] = None,
    ball: Annotated[str | None, typer.Option(help="diameter of a solder ball (default: 0.6 of the pitch)")] = None,
    holes: Annotated[str | None, typer.Option(help="smallest diameter of mounting holes (default: 2 mm)")] = None,
) -> None:
    """Write a case file for a component of an ECAD board.

    Without --component, outline, holes and components of the board are listed and nothing is written. Values that
    neither the board nor an option gives are assumed and marked ASSUMED in the file, which is written to the current
    folder.
    """
    from reflowshock.workflow.ecad.command import read_layout, show_layout, write_case

    if component is None:
        show_layout(read_layout(board), console)
        return
    path = write_case(board, component, name, {"--thickness": thickness, "--ball": ball, "--holes": holes})
    console.print(f"wrote {path}; replace values marked ASSUMED, then: reflowshock plan {path}")
