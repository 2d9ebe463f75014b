"""Content of ``result.json`` for a package on a board."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.tables import JointTables
from reflowshock.fem.dynamics.history import History
from reflowshock.fem.estimates.drop_effect import DropRun
from reflowshock.fem.estimates.drop_effects import reported_effects
from reflowshock.fem.loads.pulse import STANDARD_GRAVITY
from reflowshock.fem.loads.shock_pulse import shock_pulse
from reflowshock.fem.output.acceleration import drop_accelerations, peaks_of
from reflowshock.fem.output.point_metrics import gauge_lengths, gauge_metrics, mode_metrics, point_metrics
from reflowshock.fem.output.ranking import (
    ENDS,
    PEEL,
    PLASTIC_WORK,
    VON_MISES,
    critical_joint,
    has_flow,
    joint_figures,
    ranking_measure,
)
from reflowshock.fem.output.response_spectrum import response_spectrum
from reflowshock.fem.output.result import Outcome, Timings, health, model_summary, peak_memory, quantity, sizes
from reflowshock.fem.output.structure_modes import ModeTable
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.shock import Shock

FORCE_RESIDUAL_LIMIT = 1e-10
NO_FORCE = 1e-6  # [N], a quarter of a small joint's weight
SECTION_RESIDUAL_LIMIT = 1e-6
SAMPLES = 4000  # samples of the input for its response spectrum
METHODS = {"direct": "direct acceleration input", "large_mass": "large mass at the mounting holes"}


@dataclass(frozen=True, slots=True)
class PackageReport:
    """Report of a package on a board; implements ``Report``."""

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
            "gauge_lengths": gauge_lengths(tables[0].fitted.points),
        }

    def sections(
        self,
        outcome: Outcome[JointTables],
        arrays: Mapping[str, NDArray],
        summary: dict[str, Any],
        timings: Timings,
    ) -> dict[str, Any]:
        """Return metrics, health checks, effects and coupling."""
        coupling = _coupling_of(self.request, outcome.coupling)
        checks = {
            "interface_force_residual": (outcome.history.balance.force_residual, FORCE_RESIDUAL_LIMIT),
            "section_force_residual": (_section_residual(arrays), SECTION_RESIDUAL_LIMIT),
        }
        return {
            "metrics": _cost_metrics(summary, _updates_a_window(summary, coupling), timings)
            | _health_metrics(outcome.history, arrays)
            | _shock_metrics(arrays)
            | _acceleration_metrics(arrays, self.request)
            | point_metrics(arrays)
            | gauge_metrics(arrays, self.request.shock.filter)
            | mode_metrics(outcome.modes)
            | _response_metrics(outcome.modes, self.request.shock, float(arrays["time"][-1]))
            | {"peak_neglected_strain": quantity(outcome.neglected_strain)},
            "health": health(self.request, outcome, checks),
            "effects": _effects(self.request, summary, outcome.neglected_strain),
            "coupling": coupling | {"placement": timings.balance},
        }


def _coupling_of(request: RunInput, coupling: dict[str, Any]) -> dict[str, Any]:
    """Return the coupling record of a run; for a DNS only its fine joints."""
    fine = {"fine_joints": request.shock.coupling.fine_joints}
    coupling = coupling | {"direction": request.shock.coupling.direction}
    return fine | coupling if request.mode == "two_scale" else fine


def _updates_a_window(summary: dict[str, Any], coupling: dict[str, Any]) -> int:
    """Return the number of element updates in a window, with each element counted once per step of its level."""
    levels = coupling.get("levels", [{"elements": sum(summary["elements"].values()), "step": summary["step"]}])
    return sum(level["elements"] * round(summary["window"] / level["step"]) for level in levels)


def _cost_metrics(summary: dict[str, Any], updates: int, timings: Timings) -> dict[str, Any]:
    """Return the metrics of speed and memory, from the number of element updates in a window."""
    windows, substeps = summary["windows"] - timings.first, summary["substeps"]
    return {
        "steps_per_second": quantity(windows * substeps / timings.windows, "1/s"),
        "window_seconds": quantity(timings.windows / windows, "s"),
        "window_core_seconds": quantity(timings.balance["window_core_seconds"], "s"),
        "element_updates_per_second": quantity(windows * updates / timings.windows, "1/s"),
        "step_ratio": quantity(substeps),
        "added_mass": quantity(summary["added_mass"], "kg"),
        "peak_memory": quantity(summary["memory"], "B"),
    }


def _health_metrics(history: History, arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return residuals, and the difference of both models' interface work over the largest energy."""
    interface = float(np.abs(arrays["interface"]).max())
    return {
        "energy_balance_error": quantity(history.balance.balance_error),
        "interface_force_residual": quantity(history.balance.force_residual),
        "interface_energy_fraction": quantity(interface / history.balance.largest if interface else 0.0),
    }


def _shock_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return the peaks of the histories as metrics."""
    metrics = {
        "simulated_time": quantity(float(arrays["time"][-1]), "s"),
        "peak_board_strain": quantity(float(arrays["board_strain"].max())),
        "peak_board_displacement": quantity(float(np.abs(arrays["board_centre"][:, 2]).max()), "m"),
    }
    return metrics | _joint_metrics(arrays) if len(arrays["joints"]) else metrics


def _joint_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return peaks over time of the critical joint's worse pad and of all joints, mesh-dependent ones last."""
    critical = critical_joint(arrays)
    layer = VON_MISES.worse(arrays)
    start = float(layer[0, critical])
    values = {
        "critical_joint": quantity(str(arrays["joints"][critical])),
        "critical_end": quantity(ranking_measure(arrays).worse_end(arrays, critical)),
        **{name: quantity(*figure) for name, figure in joint_figures(arrays, critical).items()},
        "joint_layer": quantity(float(arrays["joint_layer"]), "m"),
        "peak_peel_stress": quantity(float(PEEL.peaks(arrays).max()), "Pa"),
        "peak_von_mises": quantity(float(layer.max()), "Pa"),
        **({"residual_stress_critical_joint": quantity(start, "Pa")} if start > 0.0 else {}),
        "peak_element_stress": quantity(float(arrays["von_mises_max"].max()), "Pa"),
    }
    return values | _flow_metrics(arrays)


def _acceleration_metrics(arrays: Mapping[str, NDArray], request: RunInput) -> dict[str, Any]:
    """Return the peak filtered accelerations of package and watch points."""
    pulse, low_pass = shock_pulse(request.shock).pulse, request.shock.filter
    return peaks_of(drop_accelerations(arrays, pulse, low_pass, request.watch), low_pass)


def _response_metrics(modes: ModeTable | None, shock: Shock, end: float) -> dict[str, Any]:
    """Return the shock response of the input, up to the end of the run [s], at the board's first frequency."""
    if modes is None:
        return {}
    pulse, times = shock_pulse(shock).pulse, np.linspace(0.0, end, SAMPLES + 1)
    values = np.array([pulse.value(time) for time in times.tolist()])
    [response] = response_spectrum(values, end / SAMPLES, modes.frequency[:1])
    return {"response_at_first_frequency": quantity(float(response) / STANDARD_GRAVITY, "G")}


def _flow_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return the largest plastic work density and plastic strain of all joints; empty if solder does not yield."""
    if not has_flow(arrays):
        return {}
    return {
        "peak_plastic_work_density": quantity(float(PLASTIC_WORK.peaks(arrays).max()), "J/m^3"),
        "peak_plastic_strain": quantity(float(arrays["plastic_strain_max"].max())),
    }


def _section_residual(arrays: Mapping[str, NDArray]) -> float:
    """Return the largest imbalance of a joint's section forces and inertia, relative to the largest section force.

    The reference is at least ``NO_FORCE``, since only round-off exists before the first wave arrives.
    """
    if not len(arrays["joints"]):
        return 0.0
    largest = max(float(np.abs(arrays[f"section_{end}"][..., :3]).max()) for end in ENDS)
    return float(arrays["section_imbalance"].max()) / max(largest, NO_FORCE)


def _effects(request: RunInput, summary: dict[str, Any], neglected_strain: float) -> dict[str, Any]:
    """Return the simulated effects with the reason for each."""
    tied, ratio = summary["tied_nodes"], f"step ratio m = {summary['substeps']}"
    shock, pulse = request.shock, shock_pulse(request.shock)
    return {
        "two_scale": {"on": request.mode == "two_scale", "why": f"mode {request.mode}; {ratio}"},
        "tie": {"on": tied > 0, "why": f"{tied} joint nodes lie on facets of a non-matching mesh"},
        "input_g": {
            "on": True,
            "why": f"{pulse.source}, {METHODS[shock.method]}; the package faces down, so the board is pushed along +z"
            " of the table's frame",
        },
        **reported_effects(
            DropRun(shock, request.materials.by_role, pulse.gravity, summary["added_mass"], neglected_strain)
        ),
    }
