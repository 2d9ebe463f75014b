"""A trial: what is done with the parameters of a hard case, and the measures that it returns."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import BaseModel

FAMILIES = ("reflow", "droplets", "elements", "coupling", "remesh")
# Each has a table TRIALS: name -> Trial; names are unique among all.
TABLES = (*(f"trials.{family}" for family in FAMILIES), "run_trial")


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
        run: computes, pure numbers or others; one that is missing, nan or infinite is a miss, and so is an exception.
        measures: all that `run` may return, name -> unit of which a bound must be; None where only `run` knows.
        located: takes names of files in a table of SI values as relative to the folder of the hard case.
    """

    parameters: type[BaseModel]
    run: Callable[[Any], Mapping[str, float | Measured]]
    measures: Mapping[str, str] | None
    located: Callable[[dict, Path], dict] = as_given

    def measure(self, parameters: BaseModel) -> dict[str, Measured]:
        """Compute; return all measures with their units."""
        found = self.run(parameters)
        return {name: value if isinstance(value, Measured) else Measured(float(value)) for name, value in found.items()}


def pure_trial(parameters: type[BaseModel], place: str, measures: str) -> Trial:
    """Return the trial of a function that returns pure numbers, whose solver is loaded when it is first run.

    Args:
        parameters: its only argument.
        place: module of `trials` and function, with a colon between.
        measures: names of what it returns, with spaces between.
    """
    module, function = place.split(":")

    def run(given: BaseModel) -> Mapping[str, float]:
        return getattr(import_module(f"{__package__}.trials.{module}"), function)(given)

    return Trial(parameters, run, dict.fromkeys(measures.split(), ""))


@cache
def trials() -> dict[str, Trial]:
    """Return the trials of all families by name; loads no solver."""
    tables = [import_module(f"{__package__}.{name}").TRIALS for name in TABLES]
    return {name: trial for table in tables for name, trial in table.items()}
