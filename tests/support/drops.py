"""Drops on a wall or pad."""

from math import isfinite

from reflowshock.particles.parameters.scenes import Drop
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.drop_at_rest import flow_to_rest
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run


def solve_drop(solder: Solder, count: int, pad_radius: float = float("inf")) -> tuple[LiquidFlow, Run]:
    """Let a cube of solder come to rest on a pad or a uniform wall.

    Args:
        solder: Volume, fluid and contact angles.
        count: Number of particles along an edge of the cube.
        pad_radius: Radius of the pad [m]; infinite for a uniform wall.

    Returns:
        Flow at rest (body, physics, time), and the records of its steps.
    """
    drop = Drop(
        volume=solder.volume,
        contact_angle=solder.pad_contact_angle,
        mask_contact_angle=solder.mask_contact_angle,
        pad_radius=pad_radius if isfinite(pad_radius) else None,
        particles_per_edge=count,
    )
    return flow_to_rest(drop, solder)
