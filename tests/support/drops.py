"""Drops on a wall or pad."""

from math import isfinite

from reflowshock.particles.parameters.scenes import Drop
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.drop_at_rest import flow_to_rest
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run


def solve_drop(solder: Solder, count: int, pad_radius: float = float("inf")) -> tuple[LiquidFlow, Run]:
    """Return the flow at rest of a cube with ``count`` particles per edge on a pad or a uniform wall, and its run."""
    drop = Drop(
        volume=solder.volume,
        contact_angle=solder.pad_contact_angle,
        mask_contact_angle=solder.mask_contact_angle,
        pad_radius=pad_radius if isfinite(pad_radius) else None,
        particles_per_edge=count,
    )
    return flow_to_rest(drop, solder)
