"""A trial: what is done with the parameters of a hard case, and the measures that it returns."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel


@dataclass(frozen=True, slots=True)
class Measured:
    """A number with its unit: any that pint knows, "%" or "" for a pure number."""

    value: float
    unit: str = ""


class Refused(ValueError):
    """What the program refuses in words, before or instead of a result: no miss of a random case, else of any."""


def as_given(table: dict, folder: Path) -> dict:
    """Leave a table of SI values as it is: it names no files."""
    return table


@dataclass(frozen=True, slots=True)
class Trial:
    """Something that is computed in this process, in about a second.

    Attributes:
        parameters: model of the table ``[parameters]``; units as in all parameter models.
        run: computes; a measure that is missing, nan or infinite is a miss, and so is an exception.
        measures: all that `run` may return, name -> unit of which a bound must be; None where only `run` knows.
        located: takes names of files in a table of SI values as relative to the folder of the hard case.
    """

    parameters: type[BaseModel]
    run: Callable[[Any], Mapping[str, Measured]]
    measures: Mapping[str, str] | None
    located: Callable[[dict, Path], dict] = as_given
