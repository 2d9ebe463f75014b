"""A sessile drop: the same flow with one wall and a contact line that finds its place (Hu et al., 4.1 and 4.2)."""

from collections.abc import Callable
from math import inf

import numpy as np

from particles.checkpoint import Checkpoint
from particles.cloud import box_cloud
from particles.effects import decide, drop_numbers
from particles.flow import LiquidFlow
from particles.metrics import drop_metrics
from particles.parameters import Solder
from particles.reflow import collect_shape, contact_line, start_flow, stop_rule
from particles.rest import Run, run_to_rest
from particles.shape import JointShape


def solve_drop(
    solder: Solder,
    count: int,
    pad_radius: float = inf,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> tuple[LiquidFlow, Run]:
    """Let a cube of solder flow on a pad and the mask around it.

    Args:
        solder: volume, contact angles and fluid.
        count: particles along an edge of the cube.
        pad_radius: radius of the pad [m]; infinite for a uniform wall with the contact angle of the pad.
        progress: called with the fraction done.
        checkpoint: where the run continues from, to the last bit, and leaves its state.

    Returns:
        The flow at rest, and its run.
    """
    cloud = box_cloud(float(np.cbrt(solder.volume)), count)
    effects = {name: decision["on"] for name, decision in decide(drop_numbers(solder), solder).items()}
    flow = start_flow(cloud, solder, effects, (contact_line(cloud, 0, pad_radius, solder),))
    return flow, run_to_rest(flow, stop_rule(cloud, solder, effects), progress, checkpoint=checkpoint)


def drop_shape(solder: Solder, pad_radius: float, flow: LiquidFlow, run: Run) -> JointShape:
    """Collect the result of `solve_drop`."""
    return collect_shape(solder, flow, run, drop_metrics(solder, pad_radius, flow, run))
