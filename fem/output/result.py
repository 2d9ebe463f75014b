"""``history.npz`` and ``result.json``: what a run leaves besides its fields."""

import json
import resource
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.dynamics.history import History
from reflowshock.fem.elements.hexahedron import HEXAHEDRON
from reflowshock.fem.estimates.effects import ADDED_MASS_LIMIT
from reflowshock.fem.estimates.material_effects import failure_effect, material_effects
from reflowshock.fem.loads.shock_pulse import shock_pulse
from reflowshock.fem.materials.kinematics import finite_rotation
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.output.failure import Verdicts, failed_joints, failure_criteria, judge, worst
from reflowshock.fem.output.watch_joints import FLOW_LAYERS, LAYERS
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.setup.shock_models import Model

FORCE_RESIDUAL_LIMIT = 1e-10
# Above it hourglass stiffness carries a part of the load, or incompatible modes are out of balance; 10 % is the usual
# bound (Belytschko, Liu, Moran & Elkhodary, Nonlinear Finite Elements, 2nd ed., 8.7).
HOURGLASS_LIMIT = 0.1
METHODS = {"direct": "direct acceleration input", "large_mass": "large mass at the mounting holes"}


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
class Found:
    """What a run has found.

    Attributes:
        history: Samples and energy balance.
        peaks: Cell field -> part -> largest value of an element at the times of the fields.
    """

    history: History
    peaks: dict[str, dict[str, float]]

    @property
    def neglected_strain(self) -> float:
        """Largest strain that small kinematics have left out."""
        return max(self.peaks["neglected_strain"].values())


# The models of this rank, the steps of the run, and what is told of its coupling.
Built = tuple[dict[Role, Model], Steps, dict[str, Any]]


def write_result(comms: Communicators, request: RunInput, built: Built, found: Found, timings: Timings) -> None:
    """Write both files on rank 0; collective."""
    (models, steps, coupling), history = built, found.history
    summary = model_summary(comms, request, models, steps)
    if comms.world.rank == 0:
        history.write(request.output)
        arrays = history.arrays()
        verdicts = judge(failure_criteria(request.shock.failure), arrays)
        told = coupling_of(request, coupling)
        result = {
            "metrics": cost_metrics(summary, updates_a_window(summary, told), timings)
            | health_metrics(history)
            | shock_metrics(arrays)
            | {"peak_neglected_strain": quantity(found.neglected_strain)}
            | failure_metrics(verdicts),
            "health": health(history, summary, request) | worst(verdicts),
            "effects": effects(request, summary, found.neglected_strain),
            "failure": verdicts,
            "timings": timings.seconds,
            "coupling": told | {"placement": timings.balance},
            "continued_from": timings.first,
            "model": summary,
            "parts": list(next(iter(models.values())).tables.part_names),
        }
        (request.output / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")


def coupling_of(request: RunInput, coupling: dict[str, Any]) -> dict[str, Any]:
    """Return what a run tells of its coupling: of a DNS only which joints are fine."""
    fine = {"fine_joints": request.shock.coupling.fine_joints}
    coupling = coupling | {"direction": request.shock.coupling.direction}
    return fine | coupling if request.mode == "two_scale" else fine


def quantity(value: Any, unit: str = "") -> dict[str, Any]:
    """Return a metric as the report reads it."""
    return {"value": value, "unit": unit}


def model_summary(comms: Communicators, request: RunInput, models: dict[Role, Model], steps: Steps) -> dict[str, Any]:
    """Return sizes, steps and masses of the run; collective, complete on all ranks."""
    mine = {role: (len(model.body.local.cells), model.tables.nodes) for role, model in models.items()}
    everyone = comms.world.allgather(mine)
    tables = [model.tables for model in models.values()]
    plan = steps.plan
    return {
        "mode": request.mode,
        "ranks": comms.world.size,
        "placement": comms.placement.name,
        "elements": {role: sum(rank[role][0] for rank in everyone if role in rank) for role in comms.first},
        "nodes": {role: next(rank[role][1] for rank in everyone if role in rank) for role in comms.first},
        "tied_nodes": comms.world.allreduce(max(len(item.tie.slave) for item in tables), MPI.MAX),
        "largest_tie_move": comms.world.allreduce(max(item.moved for item in tables), MPI.MAX),
        "critical_steps": steps.critical,
        "cut_critical_step": steps.interface,
        "window": plan.window,
        "step": plan.step,
        "substeps": plan.substeps,
        "windows": plan.windows,
        "added_mass": steps.added_mass,
        "model_mass": steps.model_mass,
        "memory": comms.world.allreduce(peak_memory()),
    }


def peak_memory() -> int:
    """Return the largest memory [B] that this process has had so far."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def updates_a_window(summary: dict[str, Any], coupling: dict[str, Any]) -> int:
    """Return how many elements are updated in a window, each as often as its level is."""
    levels = coupling.get("levels", [{"elements": sum(summary["elements"].values()), "step": summary["step"]}])
    return sum(level["elements"] * round(summary["window"] / level["step"]) for level in levels)


def cost_metrics(summary: dict[str, Any], updates: int, timings: Timings) -> dict[str, Any]:
    """Return the speed of a run with so many updates of elements in a window."""
    windows, substeps = summary["windows"] - timings.first, summary["substeps"]
    return {
        "steps_per_second": quantity(windows * substeps / timings.windows, "1/s"),
        "window_seconds": quantity(timings.windows / windows, "s"),
        "element_updates_per_second": quantity(windows * updates / timings.windows, "1/s"),
        "step_ratio": quantity(substeps),
        "added_mass": quantity(summary["added_mass"], "kg"),
        "peak_memory": quantity(summary["memory"], "B"),
    }


def health_metrics(history: History) -> dict[str, Any]:
    """Return the residuals; the energy fraction is by how much both models' works across the interface differ."""
    interface = float(np.abs(history.arrays()["interface"]).max())
    return {
        "energy_balance_error": quantity(history.balance.balance_error),
        "interface_force_residual": quantity(history.balance.force_residual),
        "interface_energy_fraction": quantity(interface / history.balance.largest if interface else 0.0),
    }


def shock_metrics(arrays: dict[str, NDArray]) -> dict[str, Any]:
    """Return peaks of the histories."""
    metrics = {
        "peak_board_strain": quantity(float(arrays["board_strain"].max())),
        "peak_board_displacement": quantity(float(np.abs(arrays["board_centre"][:, 2]).max()), "m"),
    }
    joints = arrays["joints"]
    if not len(joints):
        return metrics
    peak = np.maximum(arrays["von_mises_board"], arrays["von_mises_package"]).max(axis=0)
    peel = np.maximum(arrays["peel_board"], arrays["peel_package"]).max(axis=0)
    critical = int(np.argmax(peak))
    start = max(float(arrays[name][0, critical]) for name in LAYERS[:2])
    return metrics | {
        "critical_joint": quantity(str(joints[critical])),
        "peak_von_mises": quantity(float(peak[critical]), "Pa"),
        "peak_peel_stress": quantity(float(peel[critical]), "Pa"),
        "peak_element_stress": quantity(float(arrays["von_mises_max"].max()), "Pa"),
        **({"residual_stress_critical_joint": quantity(start, "Pa")} if start > 0.0 else {}),
        **flow_metrics(arrays),
    }


def flow_metrics(arrays: dict[str, NDArray]) -> dict[str, Any]:
    """Return how far the solder has flowed, where it yields."""
    if "plastic_strain_max" not in arrays:
        return {}
    work = max(float(arrays[name].max()) for name in FLOW_LAYERS)
    return {
        "peak_plastic_strain": quantity(float(arrays["plastic_strain_max"].max())),
        "peak_plastic_work_density": quantity(work, "J/m^3"),
    }


def failure_metrics(verdicts: Verdicts) -> dict[str, Any]:
    """Return how many joints fail, where they are judged."""
    return {"failed_joints": quantity(len(failed_joints(verdicts)))} if verdicts else {}


def health(history: History, summary: dict[str, Any], request: RunInput) -> dict[str, Any]:
    """Return the checks of a finished run."""
    checks = {
        "energy_balance_error": (history.balance.balance_error, request.shock.numerics.energy_balance_limit),
        "interface_force_residual": (history.balance.force_residual, FORCE_RESIDUAL_LIMIT),
        "added_mass_fraction": (summary["added_mass"] / summary["model_mass"], ADDED_MASS_LIMIT),
    }
    return checked(checks | hourglass_check(history, request.shock.numerics.formulation))


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


def effects(request: RunInput, summary: dict[str, Any], neglected_strain: float) -> dict[str, Any]:
    """Return which effects the run simulated, and why."""
    finite, why = finite_rotation("shock.numerics", request.shock.numerics.decided_kinematics, neglected_strain)
    scaled, tied = request.shock.numerics.mass_scaled, summary["tied_nodes"]
    ratio = f"step ratio m = {summary['substeps']}"
    pulse, damping = shock_pulse(request.shock), request.shock.damping.coefficients
    return {
        "two_scale": {"on": request.mode == "two_scale", "why": f"mode {request.mode}; {ratio}"},
        "tie": {"on": tied > 0, "why": f"{tied} joint nodes lie on facets that do not match them"},
        "mass_scaling": {
            "on": summary["added_mass"] > 0.0,
            "why": f"shock.numerics.mass_scaled = {list(scaled)}; adds {summary['added_mass']:.3e} kg",
        },
        "input_g": {
            "on": True,
            "why": f"{pulse.source}, {METHODS[request.shock.method]}; package facing down: the board is pushed along +z"
            " of the table's frame",
        },
        "gravity": pulse.gravity,
        "damping": {
            "on": any(damping),
            "why": f"Rayleigh damping, alpha = {damping[0]:.4g} 1/s, beta = {damping[1]:.4g} s",
        },
        "finite_rotation": {"on": finite, "why": why},
        **material_effects(request.materials.by_role),
        **failure_effect(request.shock.failure),
    }
