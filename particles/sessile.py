"""A sessile drop on a uniform wall: the same flow with one wall and a free contact line (Hu et al., section 4.1)."""

from math import inf

import numpy as np

from particles.cloud import box_cloud
from particles.contact_line import ContactLine
from particles.effects import decide_effects
from particles.flow import LiquidFlow
from particles.geometry import JointGeometry
from particles.parameters import Solder
from particles.reflow import start_flow, stop_rule
from particles.rest import Run, run_to_rest


def solve_drop(solder: Solder, contact_angle: float, count: int) -> tuple[LiquidFlow, Run]:
    """Let a cube of solder flow to a cap.

    Args:
        solder: its volume is the cube's; effects are decided for a joint of the cube's size.
        contact_angle: of the uniform wall [rad].
        count: particles along an edge of the cube.

    Returns:
        The flow at rest, and its run.
    """
    edge = float(np.cbrt(solder.volume))
    cloud = box_cloud(edge, count)
    decisions = decide_effects(JointGeometry(edge, 0.5 * edge, 0.5 * edge), solder)
    effects = {name: decision["on"] for name, decision in decisions.items()}
    line = ContactLine(0, inf, contact_angle, contact_angle, len(cloud.rings[0]))
    flow = start_flow(cloud, solder, effects, (line,))
    return flow, run_to_rest(flow, stop_rule(cloud, solder, effects))
