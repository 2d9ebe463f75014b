"""A trial that a package computes in pure numbers, and that is loaded when it is first run."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module

from pydantic import BaseModel

from reflowshock.workflow.stress_test.trial import Measured, Trial


@dataclass(frozen=True, slots=True)
class Computed:
    """The run of a trial: a function of a module that returns pure numbers by name; it can be sent to a process."""

    module: str
    function: str

    def __call__(self, parameters: BaseModel) -> dict[str, Measured]:
        """Load the module and compute."""
        found: Mapping[str, float] = getattr(import_module(self.module), self.function)(parameters)
        return {name: Measured(float(value)) for name, value in found.items()}


def solver_trial(parameters: type[BaseModel], place: str, measures: str) -> Trial:
    """Return the trial of a function.

    Args:
        parameters: its only argument.
        place: module and function, with a colon between.
        measures: names of what it returns, with spaces between.
    """
    module, function = place.split(":")
    return Trial(parameters, Computed(module, function), dict.fromkeys(measures.split(), ""))
