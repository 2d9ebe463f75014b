"""Trials: functions that take the parameters of a hard case and return its measures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import BaseModel

FAMILIES = ("reflow", "droplets", "elements", "coupling", "remesh")
# Each module has a table TRIALS: name -> Trial. Names are unique over all modules.
TABLES = (*(f"trials.{family}" for family in FAMILIES), "run_trial")


@dataclass(frozen=True, slots=True)
class Measured:
    """A number with its unit: any unit of pint, or "%" or "" for pure numbers."""

    value: float
    unit: str = ""


class Refused(ValueError):
    """Refusal of the program to compute a case; a miss, except for random cases."""


def as_given(table: dict, folder: Path) -> dict:
    """Return a table of SI values unchanged, since it names no files."""
    return table


@dataclass(frozen=True, slots=True)
class Trial:
    """A computation of about one second in this process.

    Attributes:
        parameters: Model of the table ``[parameters]``.
        run: Function from parameters to measures. Exceptions and missing, nan or infinite measures are misses.
        measures: Names of all measures -> unit of their bounds; None if they are unknown before the run.
        located: Function that resolves file names in a table of SI values against the folder of the hard case.
    """

    parameters: type[BaseModel]
    run: Callable[[Any], Mapping[str, float | Measured]]
    measures: Mapping[str, str] | None
    located: Callable[[dict, Path], dict] = as_given

    def measure(self, parameters: BaseModel) -> dict[str, Measured]:
        """Run the trial and return all measures with their units."""
        results = self.run(parameters)
        return {
            name: value if isinstance(value, Measured) else Measured(float(value)) for name, value in results.items()
        }


def pure_trial(parameters: type[BaseModel], function_path: str, measures: str) -> Trial:
    """Return the trial of a function that returns pure numbers; its module is imported on the first run.

    Args:
        parameters: Model of the only argument.
        function_path: ``"module:function"`` in the folder ``trials``.
        measures: Names of the returned measures, separated by spaces.
    """
    module, function = function_path.split(":")

    def run(values: BaseModel) -> Mapping[str, float]:
        return getattr(import_module(f"{__package__}.trials.{module}"), function)(values)

    return Trial(parameters, run, dict.fromkeys(measures.split(), ""))


@cache
def trials() -> dict[str, Trial]:
    """Return the trials of all families by name, without loading a solver."""
    tables = [import_module(f"{__package__}.{name}").TRIALS for name in TABLES]
    return {name: trial for table in tables for name, trial in table.items()}
