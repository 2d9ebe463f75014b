"""Checks that several flows share: rheology and viscosity; texts of lengths and angles in messages."""

from reflowshock.particles.flows.flow import FlowScene
from reflowshock.particles.flows.methods import SOLVERS, computes
from reflowshock.particles.flows.rheology import Rheology
from reflowshock.problem import Problem
from reflowshock.units import from_si

LARGEST_REYNOLDS = 1000.0  # of vortices and channels: above it the flow becomes turbulent and leaves the exact solution


def rheology_problems(kind: str, scene: FlowScene) -> list[Problem]:
    """Find a method that does not compute the flow, and contradictions in the viscosity law.

    These are keys of the other law, and a viscosity at infinity that is not below the one at rest.

    Args:
        kind: Table of the scene in the case file.
        scene: Parameters of the flow.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    if not computes(scene):
        flows = ", ".join(name for name, solvers in SOLVERS.items() if type(scene).__name__ in solvers)
        message = "does not compute this flow"
        return [Problem(f"{kind}.numerics.method", message, scene.numerics.method, flows)]
    rheology: Rheology | None = scene.rheology
    if rheology is None:
        return []
    foreign_key = "viscosity_at_infinity" if rheology.law == "power_law" else "bound"
    if foreign_key in rheology.model_fields_set:
        message = f"has no meaning in the law {rheology.law}"
        return [Problem(f"{kind}.rheology.{foreign_key}", message, getattr(rheology, foreign_key), "omit it")]
    if rheology.viscosity_at_infinity >= scene.liquid_viscosity:
        viscosity = from_si(rheology.viscosity_at_infinity, "mPa*s", digits=3)
        allowed = f"< {from_si(scene.liquid_viscosity, 'mPa*s', digits=3)}, the viscosity at rest"
        message = "is not below the viscosity at rest"
        return [Problem(f"{kind}.rheology.viscosity_at_infinity", message, viscosity, allowed)]
    return []


def viscosity_problems(kind: str, scene: FlowScene) -> list[Problem]:
    """Find a Reynolds number at which the laminar exact solution is unstable, and viscosity that is switched off.

    Args:
        kind: Table of the scene in the case file.
        scene: Parameters of the flow.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    problems = []
    if scene.reynolds_number > LARGEST_REYNOLDS:
        least = scene.viscosity * scene.reynolds_number / LARGEST_REYNOLDS
        message = f"makes the Reynolds number {scene.reynolds_number:.3g}, at which the exact flow is unstable"
        viscosity, allowed = (from_si(value, "Pa*s", digits=3) for value in (scene.viscosity, least))
        problems.append(Problem(f"{kind}.viscosity", message, viscosity, f">= {allowed}"))
    if scene.effects.viscosity == "off":
        message = "this flow is driven or damped by viscosity"
        problems.append(Problem(f"{kind}.effects.viscosity", message, "off", "auto, on"))
    return problems


def degrees(angle: float) -> str:
    """Format an angle [rad] in degrees with three digits and the unit."""
    return from_si(angle, "deg", digits=3)


def metres(length: float) -> str:
    """Format a length [m] in metres with three digits and the unit."""
    return from_si(length, "m", digits=3)


def micrometres(length: float) -> str:
    """Format a length [m] in micrometres with three digits and the unit."""
    return from_si(length, "um", digits=3)
