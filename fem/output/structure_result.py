"""What ``result.json`` tells of a structure."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.structure_tables import StructureTables
from reflowshock.fem.elements.stress import principal_strains, von_mises
from reflowshock.fem.estimates.structure_effects import effects
from reflowshock.fem.loads.structure_pulses import pulses_of
from reflowshock.fem.mesh.point_table import PointTable
from reflowshock.fem.model.factorisation import FactorCost
from reflowshock.fem.output.acceleration import watch_accelerations
from reflowshock.fem.output.result import Outcome, Timings, health, model_summary, quantity, sizes
from reflowshock.fem.output.structure_modes import ModeTable
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.inputs import StructureInput


@dataclass(frozen=True, slots=True)
class StructureReport:
    """The result of a structure; a ``result.Report``."""

    request: StructureInput

    def summary(self, comms: Communicators, outcome: Outcome[StructureTables]) -> dict[str, Any]:
        """Return sizes, steps, masses and where the watch points are; collective, complete on all ranks."""
        structure, steps = self.request.structure, outcome.steps
        tables = next(iter(outcome.models.values())).tables
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
                for name, node, strain in zip(
                    tables.watch.names, tables.watch.points, tables.watch.strain_points, strict=True
                )
            },
            "models": elements,
        }

    def sections(
        self,
        outcome: Outcome[StructureTables],
        arrays: Mapping[str, NDArray],
        summary: dict[str, Any],
        timings: Timings,
    ) -> dict[str, Any]:
        """Return metrics, health, effects, the time of windows, and the coupling of two models."""
        tables = next(iter(outcome.models.values())).tables
        coupling = {"coupling": outcome.coupling | {"placement": timings.balance}} if outcome.coupling else {}
        return {
            "metrics": cost_metrics(summary, timings)
            | factor_metrics(outcome.factor)
            | {"energy_balance_error": quantity(outcome.history.balance.balance_error)}
            | energy_metrics(arrays)
            | point_metrics(arrays)
            | acceleration_metrics(arrays, self.request)
            | layer_metrics(outcome.peaks)
            | mode_metrics(outcome.modes),
            "health": health(self.request, outcome),
            "effects": effects(self.request, summary["added_mass"], outcome.neglected_strain)
            | strain_effect(tables.watch),
            "balance": timings.balance,
            **coupling,
        }


def cost_metrics(summary: dict[str, Any], timings: Timings) -> dict[str, Any]:
    """Return steps, speed and masses; a critical step and updates of elements are those of explicit steps only."""
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


def factor_metrics(cost: FactorCost | None) -> dict[str, Any]:
    """Return the size of a factored matrix, if there is one."""
    if cost is None:
        return {}
    return {"factor_entries": quantity(cost.entries), "factor_memory": quantity(cost.memory / 1e6, "MB")}


def strain_effect(watch: PointTable) -> dict[str, Any]:
    """Return whether strain and stress of all watch points are those of the points themselves."""
    away = watch.displaced
    places = [f"{name} at z = {watch.strain_points[watch.names.index(name), 2]:.4g} m" for name in away]
    why = f"one layer of elements, which gives the value of its middle: {', '.join(places)}"
    return {"strain_at_surface": {"on": not away, "why": why if away else "a linear fit to the means of elements"}}


def energy_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return the largest value of each energy that the energy balance keeps and that is not zero throughout."""
    names = ("kinetic", "internal", "plastic", "hourglass", "damping", "external")
    peaks = {name: float(np.abs(arrays[name]).max()) for name in names if name in arrays}
    return {f"peak_{name}_energy": quantity(peak, "J") for name, peak in peaks.items() if peak > 0.0}


def point_metrics(arrays: Mapping[str, NDArray]) -> dict[str, Any]:
    """Return peaks at watch points and supports: ``<metric>@<name>``."""
    metrics: dict[str, Any] = {}
    for name in arrays["watch"]:
        displacement, stress = arrays[f"displacement@{name}"], arrays[f"stress@{name}"]
        metrics |= {
            f"peak_displacement@{name}": quantity(float(np.linalg.norm(displacement, axis=1).max()), "m"),
            f"displacement_range@{name}": quantity(float(np.ptp(displacement, axis=0).max()), "m"),
            f"peak_strain@{name}": quantity(float(np.abs(principal_strains(arrays[f"strain@{name}"])).max())),
            f"peak_von_mises@{name}": quantity(float(von_mises(stress).max()), "Pa"),
        }
        if f"plastic_strain@{name}" in arrays:
            metrics[f"peak_plastic_strain@{name}"] = quantity(float(arrays[f"plastic_strain@{name}"].max()))
    for name in arrays["supports"]:
        reaction = np.linalg.norm(arrays[f"reaction@{name}"], axis=1)
        metrics[f"peak_reaction@{name}"] = quantity(float(reaction.max()), "N")
    return metrics


def acceleration_metrics(arrays: Mapping[str, NDArray], request: StructureInput) -> dict[str, Any]:
    """Return the peaks of the accelerations of watch points after the filter."""
    found = watch_accelerations(arrays, request, pulses_of(request.loads))
    if not found:
        return {}
    peaks = [course.peaks_in_g(name) for name, course in found.items()]
    metrics = {metric: quantity(value, "G") for point in peaks for metric, value in point.items()}
    return metrics | {"acceleration_filter": quantity(request.dynamics.filter.label)}


def layer_metrics(peaks: dict[str, dict[str, float]]) -> dict[str, Any]:
    """Return the largest element values of each layer at the times of the fields."""
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


def mode_metrics(modes: ModeTable | None) -> dict[str, Any]:
    """Return the first four natural frequencies, or as many as were found."""
    found = [] if modes is None else modes.frequency.tolist()
    names = ("first", "second", "third", "fourth")
    return {f"{name}_frequency": quantity(value, "Hz") for name, value in zip(names, found, strict=False)}
