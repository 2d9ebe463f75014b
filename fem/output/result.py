"""Result files of a run: ``history.npz`` and ``result.json``."""

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

# Above this fraction hourglass stiffness carries part of the load; 10 % is the usual bound (Belytschko, Liu, Moran &
# Elkhodary, Nonlinear Finite Elements, 2nd ed., 8.7).
HOURGLASS_LIMIT = 0.1


@dataclass(frozen=True, slots=True)
class Timings:
    """Wall-clock times of a run on rank 0.

    Attributes:
        setup: Time before the first window [s].
        windows: Time of windows and samples [s].
        fields: Time of writing field files [s].
        balance: Predicted and measured load balance, see ``planner.summary`` and ``Stopwatch.summary``.
        first: Window from which the run was restarted, or zero.
    """

    setup: float
    windows: float
    fields: float
    balance: dict[str, Any]
    first: int = 0

    @property
    def seconds(self) -> dict[str, float]:
        """Wall-clock times by name [s]."""
        return {"setup": self.setup, "windows": self.windows, "fields": self.fields}


@dataclass(frozen=True, slots=True)
class Outcome(Generic[TablesT_co]):
    """Results of a run before they are written.

    Attributes:
        models: Models of this rank.
        steps: Time steps and masses.
        history: Samples and energy balance.
        peaks: Largest element value of each cell field in each part over the field samples.
        coupling: Coupling record of two models; empty for a single model.
        modes: Natural modes, None if they were not requested.
        factor: Factorisation cost of an implicit solver, None for an explicit one.
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
        """Largest strain that small kinematics neglected."""
        return max(self.peaks["neglected_strain"].values())

    @property
    def tables(self) -> Tables:
        """Tables of a model of this rank."""
        return next(iter(self.models.values())).tables


class Report(Protocol):
    """Interface of the problem-specific part of ``result.json``."""

    @property
    def request(self) -> RunInput | StructureInput:
        """Input of the run."""

    def summary(self, comms: Communicators, outcome: Outcome[Any]) -> dict[str, Any]:
        """Return sizes, steps and masses; collective, complete on all ranks."""

    def sections(
        self, outcome: Outcome[Any], arrays: Mapping[str, NDArray], summary: dict[str, Any], timings: Timings
    ) -> dict[str, Any]:
        """Return the sections of the result, such as metrics and health checks, from history arrays and summary."""


def write_result(comms: Communicators, report: Report, outcome: Outcome[Any], timings: Timings) -> None:
    """Write ``history.npz`` and ``result.json`` to the output folder on rank 0; collective.

    Args:
        comms: Communicators of the run and of its models.
        report: Problem-specific part of ``result.json``, with the input and its output folder.
        outcome: Results of the run: models, steps, history and peaks.
        timings: Wall-clock times [s].
    """
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
    """Return a metric for ``result.json``, ``{"value": value, "unit": unit}``.

    Args:
        value: Number or text that JSON can store.
        unit: Unit of the value; empty for dimensionless numbers and texts.
    """
    return {"value": value, "unit": unit}


def model_summary(comms: Communicators, steps: Steps, mode: str) -> dict[str, Any]:
    """Return mode, ranks, time steps and masses of a run.

    A window is the time between two exchanges of macro and meso model, or a step of a single model.

    Args:
        comms: Communicators of the run and of its models.
        steps: Time steps and masses.
        mode: Name of the mode, returned unchanged.

    Returns:
        ``mode`` (as given), ``ranks`` (count), ``placement`` (name), ``critical_steps`` (material role -> step [s]),
        ``window``, ``step`` [s], ``substeps``, ``windows`` (counts), ``added_mass`` and ``model_mass`` [kg].
    """
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
    """Return the numbers of elements and of nodes of every model.

    Collective; each rank passes its own models, and every rank gets the numbers of all models.

    Args:
        comms: Communicators of the run and of its models.
        models: Models of this rank.

    Returns:
        Elements by model, and nodes by model.
    """
    counts = {role: (len(model.body.local.cells), model.tables.nodes) for role, model in models.items()}
    by_rank = comms.world.allgather(counts)
    elements = {role: sum(rank[role][0] for rank in by_rank if role in rank) for role in comms.first}
    return elements, {role: next(rank[role][1] for rank in by_rank if role in rank) for role in comms.first}


def peak_memory() -> int:
    """Return the peak memory of this process, from its start until now [B]; each rank has its own."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def health(
    request: RunInput | StructureInput, outcome: Outcome[Any], more: Mapping[str, tuple[float, float]] = {}
) -> dict[str, Any]:
    """Return the health checks of a finished run: energy balance, added mass, hourglass energy.

    Args:
        request: Input of the run, with the limit of the energy balance.
        outcome: History and steps of the run.
        more: Additional checks, name -> (value, limit).

    Returns:
        Name -> ``{"value", "limit", "ok"}``, where ``ok`` means that the value is at most the limit. Names are
        ``energy_balance_error``, those of ``more``, ``added_mass_fraction`` and, for hexahedra with hourglass energy,
        ``hourglass_energy_fraction``.
    """
    balance, steps = outcome.history.balance, outcome.steps
    checks = {
        "energy_balance_error": (balance.balance_error, request.numerics.energy_balance_limit),
        **more,
        "added_mass_fraction": (steps.added_mass / steps.model_mass, ADDED_MASS_LIMIT),
    }
    return make_checks(checks | _hourglass_check(outcome.history, request.formulation))


def _hourglass_check(history: History, formulation: str) -> dict[str, tuple[float, float]]:
    """Return the hourglass energy relative to the largest energy, and its limit; empty without hourglass energy.

    One-point elements are not checked, because their hourglass energy includes the bending of layers.
    """
    if formulation != HEXAHEDRON.name:
        return {}
    hourglass = float(np.abs(history.arrays()["hourglass"]).max())
    return {"hourglass_energy_fraction": (hourglass / history.balance.largest, HOURGLASS_LIMIT)} if hourglass else {}


def make_checks(checks: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Return health checks for ``result.json``: name -> ``{"value", "limit", "ok"}``.

    Args:
        checks: Name -> (value, limit); ``ok`` is true if the value is at most the limit.
    """
    return {name: {"value": value, "limit": limit, "ok": value <= limit} for name, (value, limit) in checks.items()}
