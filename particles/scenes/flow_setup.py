"""Set-up of a liquid flow from its particles: contact lines, active effects, step solver, time step and stop rule."""

from collections.abc import Mapping
from dataclasses import replace
from math import pi
from pkgutil import resolve_name

import numpy as np

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import Cloud
from reflowshock.particles.core.plate import Pad
from reflowshock.particles.core.symmetry import whole_line
from reflowshock.particles.parameters.effects import acting
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.operators import Mass
from reflowshock.particles.physics.physics import Acting, Physics
from reflowshock.particles.scenes.step_methods import start_solver
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import StopRule
from reflowshock.particles.steps.time_step import TimeStep, capillary_limit, largest_step, most_steps, swing_period
from reflowshock.particles.surface.contact_line import ContactLine

CALM_CAPILLARY_TIMES = 20.0


def start_flow(cloud: Cloud, solder: Solder, effects: Mapping[str, bool], lines: tuple[ContactLine, ...]) -> LiquidFlow:
    """Set up the flow of a liquid at rest, with only the active effects.

    Args:
        cloud: Particles of the liquid, its free surface and contact lines.
        solder: Fluid properties and numerics, which select the step solver.
        effects: Name of an effect, such as "inertia" -> on or off; missing effects are off.
        lines: Contact lines, one per ring of the cloud; empty for a free drop.

    Returns:
        Flow at time 0, with body, physics, step solver and time step.
    """
    largest, bound = largest_step(solder, cloud.spacing)
    time_step = TimeStep(largest, cloud.spacing, largest, bound, bound)
    solver, physics = start_solver(solder, effects, build_physics(solder, effects, lines))
    return LiquidFlow(Body.at_rest(cloud), physics, time_step, solver)


def build_physics(
    solder: Solder, effects: Mapping[str, bool], lines: tuple[ContactLine, ...], in_section: bool = False
) -> Physics:
    """Return the physics of the active effects: their forces, friction, momentum, contact lines and constraints.

    Args:
        solder: Fluid properties and walls.
        effects: Name -> on or off, as decided by ``decide_effects``; missing effects are off.
        lines: Contact lines, in the order of the plates; empty for a free drop.
        in_section: Whether the liquid is a drop in section, whose surface is a polyline.
    """
    physics = Physics((), (Mass(solder.density),), (), (), lines)
    for effect in acting(effects):
        section_name = effect.section_implementation if in_section else ""
        acting_class: type[Acting] = resolve_name(section_name or effect.implementation)
        physics = acting_class.added_to(physics, solder)
        if not effect.is_axisymmetric:
            physics = replace(physics, is_axisymmetric=False)
    return physics


def contact_line(cloud: Cloud, wall: int, radius: float, solder: Solder) -> ContactLine:
    """Set up the contact line around one pad at the origin of a plate; it can be pinned at the pad's edge.

    Args:
        cloud: Particles with one ring per plate.
        wall: Index of the plate.
        radius: Radius of the pad [m]; infinite for a uniform wall.
        solder: Contact angles of pad and mask.

    Returns:
        Contact line with the states of its vertices: pinned, on the pad or on the mask.
    """
    ring, pad = cloud.rings[wall], Pad((0.0, 0.0), radius, solder.pad_contact_angle)
    local = cloud.plates[wall].local(cloud.points[ring])
    corners = len(whole_line(cloud, len(ring))[0])
    return ContactLine(wall, (pad,), solder.mask_contact_angle, local, np.array([corners]))


def pad_lines(cloud: Cloud, solder: Solder) -> tuple[ContactLine, ...]:
    """Set up the contact lines of a remeshed body, one per plate, from the pads of the plates.

    Args:
        cloud: Particles with one ring (contact line) per plate.
        solder: Contact angle of the mask; those of the pads are stored in the plates.

    Returns:
        Contact lines in the order of the plates; empty for a free drop.
    """
    lines = []
    for wall, (ring, plate) in enumerate(zip(cloud.rings, cloud.plates, strict=True)):
        corners = np.array([pad.corners(cloud.spacing) for pad in plate.pads])
        local = plate.local(cloud.points[ring])
        lines.append(ContactLine(wall, plate.pads, solder.mask_contact_angle, local, corners))
    return tuple(lines)


def stop_rule(cloud: Cloud, solder: Solder, effects: Mapping[str, bool], angle: float | None = 0.5 * pi) -> StopRule:
    """Return the rule that ends a flow: at rest, or with inertia at the end of the process at the latest.

    Args:
        cloud: Particles of the liquid, whose spacing sets the limits.
        solder: Fluid, process and numerics.
        effects: Name of an effect, such as "inertia" -> on or off; missing effects are off.
        angle: Contact angle [rad] of the spherical cap that oscillates as slowly as the body: the contact angle of a
            drop on a uniform wall; the default for a body that edges or friction hold; None for a free drop.

    Returns:
        Largest number of steps, tolerance and duration of rest, and end of the process.
    """
    calm_time = CALM_CAPILLARY_TIMES * capillary_limit(solder.density, cloud.spacing, solder.surface_tension)
    steps, tolerance = most_steps(solder, cloud.spacing), solder.numerics.tolerance
    if not effects.get("inertia", False):
        return StopRule(steps, tolerance, calm_time)
    return StopRule(steps, tolerance, calm_time, solder.process_time, 0.25 * swing_period(solder, angle))
