"""A sessile drop: the same flow with one wall and a contact line that finds its place (Hu et al., 4.1 and 4.2)."""

from math import inf

import numpy as np

from particles.cloud import box_cloud
from particles.effects import decide_effects
from particles.flow import LiquidFlow
from particles.geometry import JointGeometry
from particles.parameters import Solder
from particles.reflow import contact_line, start_flow, stop_rule
from particles.rest import Run, run_to_rest


def solve_drop(solder: Solder, count: int, pad_radius: float = inf) -> tuple[LiquidFlow, Run]:
    """Let a cube of solder flow on a pad and the mask around it.

    Args:
        solder: volume, contact angles and fluid; effects are decided for a joint of the cube's size.
        count: particles along an edge of the cube.
        pad_radius: radius of the pad [m]; infinite for a uniform wall with the contact angle of the pad.

    Returns:
        The flow at rest, and its run.
    """
    edge = float(np.cbrt(solder.volume))
    cloud = box_cloud(edge, count)
    decisions = decide_effects(JointGeometry(edge, 0.5 * edge, 0.5 * edge), solder)
    effects = {name: decision["on"] for name, decision in decisions.items()}
    flow = start_flow(cloud, solder, effects, (contact_line(cloud, 0, pad_radius, solder),))
    return flow, run_to_rest(flow, stop_rule(cloud, solder, effects))
