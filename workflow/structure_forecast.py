"""Size, time steps and cost of a structure's motion, from its parameters alone."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

from workflow.structure_case import StructureCase


@dataclass(frozen=True, slots=True)
class LayerForecast:
    """A layer of the mesh: its material, number of elements, critical time step of the smallest one [s]."""

    material: str
    elements: int
    critical_step: float
    mass_scaled: bool


@dataclass(frozen=True, slots=True)
class StructureForecast:
    """What a run will be like.

    Attributes:
        effects: effect -> {"on", "why"}.
        layers: layer -> size and step.
        step: explicit time step [s].
        steps: number of explicit steps.
        seconds: stage -> predicted wall time [s].
    """

    effects: Mapping[str, Any]
    layers: dict[str, LayerForecast]
    step: float
    steps: int
    seconds: dict[str, float]


def forecast_structure(case: StructureCase) -> StructureForecast:
    """Predict sizes, steps and cost."""
    layers = forecast_layers(case)
    numerics = case.dynamics.numerics
    step = numerics.step_fraction * min(layer.critical_step for layer in layers.values() if not layer.mass_scaled)
    return StructureForecast(structure_effects(case), layers, step, ceil(case.dynamics.duration / step), {})


def forecast_layers(case: StructureCase) -> dict[str, LayerForecast]:
    """Predict size and critical time step of every layer."""
    import numpy as np

    from fem.box_step import box_element_step
    from meshing.box_plan import count_box

    body, materials = case.structure, case.scene.layer_materials
    layers = {}
    for name, part in count_box(case.box).items():
        step = box_element_step(body.element, body.formulation, materials[name], np.array(part.smallest))
        scaled = name in case.dynamics.numerics.mass_scaled
        layers[name] = LayerForecast(body.layers[name].material, part.elements, step, scaled)
    return layers


def structure_effects(case: StructureCase) -> dict[str, dict]:
    """Say which effects are simulated, and why."""
    dynamics, damping = case.dynamics, case.dynamics.damping
    yielding = [name for name, material in case.scene.layer_materials.items() if getattr(material, "plasticity", None)]
    damped = [name for name, value in damping if value and name != "frequency"]
    return {
        "finite_rotation": _effect(dynamics.kinematics == "finite", f"dynamics.kinematics = {dynamics.kinematics}"),
        "plasticity": _effect(bool(yielding), f"layers with a plastic material: {_names(yielding)}"),
        "damping": _effect(bool(damped), f"dynamics.damping: {_names(damped)}"),
        "mass_scaling": _effect(
            bool(dynamics.numerics.mass_scaled), f"layers: {_names(dynamics.numerics.mass_scaled)}"
        ),
        "gravity": _effect(
            any(load.kind == "gravity" for load in case.loads.values()), "a load of kind gravity, or none"
        ),
    }


def _effect(on: bool, why: str) -> dict:
    return {"on": on, "why": why}


def _names(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
