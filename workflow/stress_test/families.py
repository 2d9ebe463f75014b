"""The families of hard cases: which modules hold their trials and their random cases."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from reflowshock.workflow.stress_test.trial import Trial

if TYPE_CHECKING:
    from reflowshock.workflow.stress_test.random_trial import RandomTrial

# Each module of trials has a table TRIALS: name -> Trial; names are unique among all families. Each module of random
# cases has a list RANDOM of `RandomTrial`; it may load hypothesis.
TRIALS_OF = {
    "reflow": "reflowshock.cases.hard.trials.reflow",
    "elements": "reflowshock.workflow.stress_test.trials_elements",
    "coupling": "reflowshock.workflow.stress_test.trials_coupling",
    "remesh": "reflowshock.cases.hard.trials.remesh",
}
RANDOM_OF: dict[str, str] = {
    "reflow": "reflowshock.workflow.stress_test.random_reflow",
    "elements": "reflowshock.workflow.stress_test.random_elements",
    "coupling": "reflowshock.workflow.stress_test.random_coupling",
    "remesh": "reflowshock.workflow.stress_test.random_remesh",
}
OF_ALL_FAMILIES = "reflowshock.workflow.stress_test.trials_run"
FAMILIES = ("reflow", "elements", "coupling", "remesh")


@cache
def trials() -> dict[str, Trial]:
    """Return the trials of all families by name; loads no solver."""
    modules = [import_module(name) for name in (*TRIALS_OF.values(), OF_ALL_FAMILIES)]
    return {name: trial for module in modules for name, trial in module.TRIALS.items()}


def random_trials(family: str) -> list[RandomTrial]:
    """Return the random trials of a family."""
    return list(import_module(RANDOM_OF[family]).RANDOM) if family in RANDOM_OF else []
