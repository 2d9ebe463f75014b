"""What ``result.json`` tells of a package on a board."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.tables import JointTables
from reflowshock.fem.dynamics.history import History
from reflowshock.fem.estimates.drop_effects import DropRun, told
from reflowshock.fem.loads.shock_pulse import shock_pulse
from reflowshock.fem.output.result import Outcome, Timings, health, model_summary, peak_memory, quantity, sizes
from reflowshock.fem.output.watch_joints import FLOW_LAYERS, LAYERS
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.inputs import RunInput

FORCE_RESIDUAL_LIMIT = 1e-10
METHODS = {"direct": "direct acceleration input", "large_mass": "large mass at the mounting holes"}


@dataclass(frozen=True, slots=True)
class PackageReport:
    """The result of a package on a board; a ``result.Report``."""

    request: RunInput

    def summary(self, comms: Communicators, outcome: Outcome[JointTables]) -> dict[str, Any]:
        """Return sizes, steps and masses; collective, complete on all ranks."""
        tables = [model.tables for model in outcome.models.values()]
        elements, nodes = sizes(comms, outcome.models)
        return model_summary(comms, outcome.steps, self.request.mode) | {
            "elements": elements,
            "nodes": nodes,
            "tied_nodes": comms.world.allreduce(max(len(item.tie.slave) for item in tables), MPI.MAX),
            "largest_tie_move": comms.world.allreduce(max(item.moved for item in tables), MPI.MAX),
            "cut_critical_step": outcome.steps.macro_critical,
            "memory": comms.world.allreduce(peak_memory()),
        }

    def sections(
        self,
        outcome: Outcome[JointTables],
        arrays: Mapping[str, NDArray],
        summary: dict[str, Any],
        timings: Timings,
    ) -> dict[str, Any]:
        """Return metrics, health, effects and the coupling."""
        coupling = coupling_of(self.request, outcome.coupling)
        residual = outcome.history.balance.force_residual, FORCE_RESIDUAL_LIMIT
        return {
            "metrics": cost_metrics(summary, updates_a_window(summary, coupling), timings)
            | health_metrics(outcome.history, arrays)
            | shock_metrics(arrays)
            | {"peak_neglected_strain": quantity(outcome.neglected_strain)},
            "health": health(self.request, outcome, {"interface_force_residual": residual}),
            "effects": effects(self.request, summary, outcome.neglected_strain),
            "coupling": coupling | {"placement": timings.balance},
        }


def coupling_of(request: RunInput, coupling: dict[str, Any]) -> dict[str, Any]:
    """Return what a run tells of its coupling: of a DNS only which joints are fine."""
    fine = {"fine_joints": request.shock.coupling.fine_joints}
    coupling = coupling | {"direction": request.shock.coupling.direction}
    return fine | coupling if request.mode == "two_scale" else fine


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


def health_metrics(history: History, arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return the residuals; the energy fraction is by how much both models' works across the interface differ."""
    interface = float(np.abs(arrays["interface"]).max())
    return {
        "energy_balance_error": quantity(history.balance.balance_error),
        "interface_force_residual": quantity(history.balance.force_residual),
        "interface_energy_fraction": quantity(interface / history.balance.largest if interface else 0.0),
    }


def shock_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
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


def flow_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return how far the solder has flowed, where it yields."""
    if "plastic_strain_max" not in arrays:
        return {}
    work = max(float(arrays[name].max()) for name in FLOW_LAYERS)
    return {
        "peak_plastic_strain": quantity(float(arrays["plastic_strain_max"].max())),
        "peak_plastic_work_density": quantity(work, "J/m^3"),
    }


def effects(request: RunInput, summary: dict[str, Any], neglected_strain: float) -> dict[str, Any]:
    """Return which effects the run simulated, and why."""
    tied, ratio = summary["tied_nodes"], f"step ratio m = {summary['substeps']}"
    shock, pulse = request.shock, shock_pulse(request.shock)
    return {
        "two_scale": {"on": request.mode == "two_scale", "why": f"mode {request.mode}; {ratio}"},
        "tie": {"on": tied > 0, "why": f"{tied} joint nodes lie on facets that do not match them"},
        "input_g": {
            "on": True,
            "why": f"{pulse.source}, {METHODS[shock.method]}; package facing down: the board is pushed along +z"
            " of the table's frame",
        },
        **told(DropRun(shock, request.materials.by_role, pulse.gravity, summary["added_mass"], neglected_strain)),
    }
