"""Parsing of command lines by the program's own parser, without running them."""

import shlex
from collections.abc import Mapping
from itertools import takewhile
from typing import Any

import typer

from reflowshock.workflow import cli


def commands() -> Mapping[str, Any]:
    """Return the visible commands of the program by name, as objects of its command line parser."""
    group = typer.main.get_command(cli.app)
    return {name: command for name, command in group.commands.items() if not command.hidden}


def parse(line: str) -> tuple[str, dict]:
    """Return command and parameters of a line "reflowshock COMMAND ..."; raise an error if parsing fails."""
    program, command, *arguments = takewhile(lambda word: word not in ">|", shlex.split(line, comments=True))
    assert program.rpartition("/")[2] == "reflowshock", line
    context = commands()[command].make_context(command, arguments)
    return command, context.params
