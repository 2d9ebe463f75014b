"""Content of ``result.json`` for a structure."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.structure_tables import StructureTables
from reflowshock.fem.estimates.structure_effects import effects
from reflowshock.fem.loads.structure_pulses import pulses_of
from reflowshock.fem.mesh.point_table import PointTable
from reflowshock.fem.model.factorisation import FactorCost
from reflowshock.fem.output.acceleration import peaks_of, watch_accelerations
from reflowshock.fem.output.point_metrics import gauge_lengths, gauge_metrics, mode_metrics, point_metrics
from reflowshock.fem.output.result import Outcome, Timings, health, model_summary, quantity, sizes
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.inputs import StructureInput


@dataclass(frozen=True, slots=True)
class StructureReport:
    """Report of a structure; implements ``Report``."""

    request: StructureInput

    def summary(self, comms: Communicators, outcome: Outcome[StructureTables]) -> dict[str, Any]:
        """Return sizes, steps, masses and watch point positions; collective, complete on all ranks."""
        structure, steps = self.request.structure, outcome.steps
        tables = next(iter(outcome.models.values())).tables
        watch = tables.fitted.points
        elements, nodes = sizes(comms, outcome.models)
        return model_summary(comms, steps, self.request.mode) | {
            "solver": self.request.solver,
            "element": structure.element,
            "formulation": structure.formulation if structure.element == "hexahedron" else "",
            "elements": sum(elements.values()),
            "nodes": sum(nodes.values()) - len(tables.interface),
            "critical_step": steps.macro_critical,
            "steps": steps.plan.windows * steps.plan.substeps,
            "samples": steps.plan.windows // steps.plan.stride,
            "watch": {
                name: {"node_at": node.tolist(), "strain_at": strain.tolist()}
                for name, node, strain in zip(watch.names, watch.points, watch.strain_points, strict=True)
            },
            "models": elements,
            "gauge_lengths": gauge_lengths(watch),
        }

    def sections(
        self,
        outcome: Outcome[StructureTables],
        arrays: Mapping[str, NDArray],
        summary: dict[str, Any],
        timings: Timings,
    ) -> dict[str, Any]:
        """Return metrics, health checks, effects, load balance, and the coupling of two models."""
        tables = next(iter(outcome.models.values())).tables
        coupling = {"coupling": outcome.coupling | {"placement": timings.balance}} if outcome.coupling else {}
        return {
            "metrics": _cost_metrics(summary, timings)
            | _factor_metrics(outcome.factor)
            | {"energy_balance_error": quantity(outcome.history.balance.balance_error)}
            | _energy_metrics(arrays)
            | point_metrics(arrays)
            | gauge_metrics(arrays, self.request.dynamics.filter)
            | _acceleration_metrics(arrays, self.request)
            | _layer_metrics(outcome.peaks)
            | mode_metrics(outcome.modes),
            "health": health(self.request, outcome),
            "effects": effects(self.request, summary["added_mass"], outcome.neglected_strain)
            | _strain_effect(tables.fitted.points),
            "balance": timings.balance,
            **coupling,
        }


def _cost_metrics(summary: dict[str, Any], timings: Timings) -> dict[str, Any]:
    """Return steps, speed and masses; critical step and element updates only for explicit solvers."""
    rate = summary["steps"] * (1.0 - timings.first / summary["windows"]) / timings.windows
    metrics = {
        "step": quantity(summary["step"], "s"),
        "steps": quantity(summary["steps"]),
        "steps_per_second": quantity(rate, "1/s"),
        "model_mass": quantity(summary["model_mass"], "kg"),
        "added_mass": quantity(summary["added_mass"], "kg"),
    }
    if summary["solver"] == "implicit":
        return metrics
    return metrics | {
        "critical_step": quantity(summary["critical_step"], "s"),
        "element_updates_per_second": quantity(rate * summary["elements"], "1/s"),
    }


def _factor_metrics(cost: FactorCost | None) -> dict[str, Any]:
    """Return size and memory of the factored matrix; empty for explicit solvers."""
    if cost is None:
        return {}
    return {"factor_entries": quantity(cost.entries), "factor_memory": quantity(cost.memory / 1e6, "MB")}


def _strain_effect(watch: PointTable) -> dict[str, Any]:
    """Return whether strain and stress of all watch points are evaluated at the points themselves."""
    displaced = watch.displaced
    heights = [f"{name} at z = {watch.strain_points[watch.names.index(name), 2]:.4g} m" for name in displaced]
    why = f"a single layer of elements gives values at its middle: {', '.join(heights)}"
    return {"strain_at_surface": {"on": not displaced, "why": why if displaced else "linear fit to element means"}}


def _energy_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return the peak of each energy of the energy balance that is not always zero [J]."""
    names = ("kinetic", "internal", "plastic", "hourglass", "damping", "external")
    peaks = {name: float(np.abs(arrays[name]).max()) for name in names if name in arrays}
    return {f"peak_{name}_energy": quantity(peak, "J") for name, peak in peaks.items() if peak > 0.0}


def _acceleration_metrics(arrays: Mapping[str, NDArray], request: StructureInput) -> dict[str, Any]:
    """Return the peak filtered accelerations of watch points."""
    return peaks_of(watch_accelerations(arrays, request, pulses_of(request.loads)), request.dynamics.filter)


def _layer_metrics(peaks: dict[str, dict[str, float]]) -> dict[str, Any]:
    """Return the largest element values of each layer over the field samples."""
    names = {
        "von_mises": ("peak_element_stress", "Pa"),
        "neglected_strain": ("peak_neglected_strain", ""),
        "plastic_strain": ("peak_element_plastic_strain", ""),
    }
    return {
        f"{names[field][0]}@{layer}": quantity(peak, names[field][1])
        for field, layers in peaks.items()
        for layer, peak in layers.items()
    }
