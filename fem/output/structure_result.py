"""``history.npz`` and ``result.json`` of a structure."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.history import History
from reflowshock.fem.elements.stress import principal_strains, von_mises
from reflowshock.fem.estimates.structure_effects import effects
from reflowshock.fem.mesh.point_table import PointTable
from reflowshock.fem.model.factorisation import FactorCost
from reflowshock.fem.output.result import ADDED_MASS_LIMIT, Timings, checked, hourglass_check, quantity
from reflowshock.fem.output.structure_modes import ModeTable
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.setup.structure_model import StructureModel


@dataclass(frozen=True, slots=True)
class Found:
    """What a run has found.

    Attributes:
        history: Samples and energy balance.
        modes: Natural modes, if this run was asked for them.
        peaks: Cell field -> layer -> largest value of an element at the times of the fields.
        factor: What the factorisation of an implicit solver took.
        coupling: How two models are coupled, if there are two.
    """

    history: History
    modes: ModeTable | None
    peaks: dict[str, dict[str, float]]
    factor: FactorCost | None
    coupling: dict[str, Any] | None


def write_result(
    comms: Communicators,
    request: StructureInput,
    models: Mapping[Role, StructureModel],
    found: Found,
    timings: Timings,
) -> None:
    """Write both files on rank 0; collective."""
    summary, history = model_summary(comms, request, models), found.history
    model = next(iter(models.values()))
    if comms.world.rank == 0:
        history.write(request.output)
        arrays = history.arrays()
        result = {
            "metrics": cost_metrics(summary, timings)
            | factor_metrics(found.factor)
            | {"energy_balance_error": quantity(history.balance.balance_error)}
            | energy_metrics(arrays)
            | point_metrics(arrays)
            | layer_metrics(found.peaks)
            | mode_metrics(found.modes),
            "health": health(history, summary, request),
            "effects": effects(request, summary["added_mass"], max(found.peaks["neglected_strain"].values()))
            | strain_effect(model.tables.watch),
            **coupling_of(found, timings),
            "timings": timings.seconds,
            "balance": timings.balance,
            "continued_from": timings.first,
            "model": summary,
            "parts": list(model.tables.part_names),
        }
        (request.output / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")


def model_summary(
    comms: Communicators, request: StructureInput, models: Mapping[Role, StructureModel]
) -> dict[str, Any]:
    """Return sizes, steps, masses and where the watch points are; collective, complete on all ranks."""
    first = next(iter(models.values()))
    steps, watch = first.steps, first.tables.watch
    elements, nodes = sizes(comms, models)
    return {
        "mode": "structure",
        "solver": request.solver,
        "element": request.structure.element,
        "formulation": request.structure.formulation if request.structure.element == "hexahedron" else "",
        "ranks": comms.world.size,
        "placement": comms.placement.name,
        "elements": sum(elements.values()),
        "nodes": sum(nodes.values()) - len(first.tables.interface),
        "critical_steps": steps.critical,
        "critical_step": steps.interface,
        "window": steps.plan.window,
        "substeps": steps.plan.substeps,
        "step": steps.plan.step,
        "steps": steps.plan.windows * steps.plan.substeps,
        "windows": steps.plan.windows,
        "samples": steps.plan.windows // steps.plan.stride,
        "added_mass": steps.added_mass,
        "model_mass": steps.model_mass,
        "watch": {
            name: {"node_at": watch.points[k].tolist(), "strain_at": watch.strain_points[k].tolist()}
            for k, name in enumerate(watch.names)
        },
        "models": elements,
    }


def sizes(comms: Communicators, models: Mapping[Role, StructureModel]) -> tuple[dict[Role, int], dict[Role, int]]:
    """Return the numbers of elements and of nodes of every model; collective, complete on all ranks."""
    mine = {role: (len(model.body.local.cells), model.tables.nodes) for role, model in models.items()}
    everyone = comms.world.allgather(mine)
    elements = {role: sum(rank[role][0] for rank in everyone if role in rank) for role in comms.first}
    return elements, {role: next(rank[role][1] for rank in everyone if role in rank) for role in comms.first}


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


def coupling_of(found: Found, timings: Timings) -> dict[str, Any]:
    """Return how two models are coupled and placed; nothing where there is one."""
    if found.coupling is None:
        return {}
    return {"coupling": found.coupling | {"placement": timings.balance}}


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


def energy_metrics(arrays: dict[str, NDArray]) -> dict[str, Any]:
    """Return the largest value of each energy that the energy balance keeps and that is not zero throughout."""
    names = ("kinetic", "internal", "plastic", "hourglass", "damping", "external")
    peaks = {name: float(np.abs(arrays[name]).max()) for name in names if name in arrays}
    return {f"peak_{name}_energy": quantity(peak, "J") for name, peak in peaks.items() if peak > 0.0}


def point_metrics(arrays: dict[str, NDArray]) -> dict[str, Any]:
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
    """Return the first natural frequency, if modes were found."""
    return {} if modes is None else {"first_frequency": quantity(float(modes.frequency[0]), "Hz")}


def health(history: History, summary: dict[str, Any], request: StructureInput) -> dict[str, Any]:
    """Return the checks of a finished run."""
    checks = {
        "energy_balance_error": (history.balance.balance_error, request.dynamics.numerics.energy_balance_limit),
        "added_mass_fraction": (summary["added_mass"] / summary["model_mass"], ADDED_MASS_LIMIT),
    }
    return checked(checks | hourglass_check(history, request.structure.formulation))
