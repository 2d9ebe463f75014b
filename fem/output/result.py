"""``history.npz`` and ``result.json``: what a run leaves besides its fields."""

import json
import resource
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.tables import Tables, TablesT_co
from reflowshock.fem.dynamics.history import History
from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.estimates.drop_effects import ADDED_MASS_LIMIT
from reflowshock.fem.model.factorisation import FactorCost
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.output.structure_modes import ModeTable
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import RunInput, StructureInput
from reflowshock.fem.setup.models import Model

# Above it hourglass stiffness carries a part of the load, or incompatible modes are out of balance; 10 % is the usual
# bound (Belytschko, Liu, Moran & Elkhodary, Nonlinear Finite Elements, 2nd ed., 8.7).
HOURGLASS_LIMIT = 0.1


@dataclass(frozen=True, slots=True)
class Timings:
    """Wall seconds of the parts of a run on rank 0.

    Attributes:
        setup: Until the first window.
        windows: Windows and samples.
        fields: Field files.
        balance: Placement, predicted and measured, see ``planner.summary`` and ``Stopwatch.summary``.
        first: Window from which the run continued, or zero.
    """

    setup: float
    windows: float
    fields: float
    balance: dict[str, Any]
    first: int = 0

    @property
    def seconds(self) -> dict[str, float]:
        """Return the wall seconds by name."""
        return {"setup": self.setup, "windows": self.windows, "fields": self.fields}


@dataclass(frozen=True, slots=True)
class Outcome(Generic[TablesT_co]):
    """What a run has found.

    Attributes:
        models: The models of this rank.
        steps: Steps and masses.
        history: Samples and energy balance.
        peaks: Cell field -> part -> largest value of an element at the times of the fields.
        coupling: How two models are coupled; empty where there is one.
        modes: Natural modes, if this run was asked for them.
        factor: What the factorisation of an implicit solver took.
    """

    models: Mapping[Role, Model[TablesT_co]]
    steps: Steps
    history: History
    peaks: dict[str, dict[str, float]]
    coupling: dict[str, Any]
    modes: ModeTable | None = None
    factor: FactorCost | None = None

    @property
    def neglected_strain(self) -> float:
        """Largest strain that small kinematics have left out."""
        return max(self.peaks["neglected_strain"].values())

    @property
    def tables(self) -> Tables:
        """Return the tables of one of the models of this rank."""
        return next(iter(self.models.values())).tables


class Report(Protocol):
    """What one kind of problem tells in its result besides what all runs do."""

    @property
    def request(self) -> RunInput | StructureInput:
        """Return the input."""

    def summary(self, comms: Communicators, outcome: Outcome[Any]) -> dict[str, Any]:
        """Return sizes, steps and masses; collective, complete on all ranks."""

    def sections(
        self, outcome: Outcome[Any], arrays: Mapping[str, NDArray], summary: dict[str, Any], timings: Timings
    ) -> dict[str, Any]:
        """Return metrics, health, effects and more, from the arrays of the history and ``summary``; on rank 0."""


def write_result(comms: Communicators, report: Report, outcome: Outcome[Any], timings: Timings) -> None:
    """Write both files on rank 0; collective."""
    summary, output = report.summary(comms, outcome), report.request.output
    if comms.world.rank == 0:
        outcome.history.write(output)
        result = report.sections(outcome, outcome.history.arrays(), summary, timings) | {
            "timings": timings.seconds,
            "continued_from": timings.first,
            "model": summary,
            "parts": list(outcome.tables.part_names),
        }
        (output / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")


def quantity(value: Any, unit: str = "") -> dict[str, Any]:
    """Return a metric as the report reads it."""
    return {"value": value, "unit": unit}


def model_summary(comms: Communicators, steps: Steps, mode: str) -> dict[str, Any]:
    """Return ranks, steps and masses of a run."""
    plan = steps.plan
    return {
        "mode": mode,
        "ranks": comms.world.size,
        "placement": comms.placement.name,
        "critical_steps": steps.critical,
        "window": plan.window,
        "step": plan.step,
        "substeps": plan.substeps,
        "windows": plan.windows,
        "added_mass": steps.added_mass,
        "model_mass": steps.model_mass,
    }


def sizes(comms: Communicators, models: Mapping[Role, Model[Any]]) -> tuple[dict[Role, int], dict[Role, int]]:
    """Return the numbers of elements and of nodes of every model; collective, complete on all ranks."""
    mine = {role: (len(model.body.local.cells), model.tables.nodes) for role, model in models.items()}
    everyone = comms.world.allgather(mine)
    elements = {role: sum(rank[role][0] for rank in everyone if role in rank) for role in comms.first}
    return elements, {role: next(rank[role][1] for rank in everyone if role in rank) for role in comms.first}


def peak_memory() -> int:
    """Return the largest memory [B] that this process has had so far."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def health(
    request: RunInput | StructureInput, outcome: Outcome[Any], more: Mapping[str, tuple[float, float]] = {}
) -> dict[str, Any]:
    """Return the checks of a finished run; ``more`` are value and limit of others, by name."""
    balance, steps = outcome.history.balance, outcome.steps
    checks = {
        "energy_balance_error": (balance.balance_error, request.numerics.energy_balance_limit),
        **more,
        "added_mass_fraction": (steps.added_mass / steps.model_mass, ADDED_MASS_LIMIT),
    }
    return checked(checks | hourglass_check(outcome.history, request.formulation))


def hourglass_check(history: History, formulation: str) -> dict[str, tuple[float, float]]:
    """Return the largest hourglass energy over the largest energy, and its limit; nothing where there is none.

    That of one point is the bending of layers, too, and is not judged.
    """
    if formulation != HEXAHEDRON.name:
        return {}
    hourglass = float(np.abs(history.arrays()["hourglass"]).max())
    return {"hourglass_energy_fraction": (hourglass / history.balance.largest, HOURGLASS_LIMIT)} if hourglass else {}


def checked(checks: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Return checks as the report reads them: name -> value and limit, which it must not exceed."""
    return {name: {"value": value, "limit": limit, "ok": value <= limit} for name, (value, limit) in checks.items()}
