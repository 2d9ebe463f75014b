"""Drop on a uniform wall in section, by the scheme ispg: a meridian, or a plane section of a drop uniform along y.

A body of revolution starts as a cylinder as high as the initial cube of other drops. A plane drop starts as the section
of the cube; the piece with the drop's volume is as deep as the cube. The same effects act as on a body, with forces of
a polyline instead of triangles.
"""

import numpy as np

from reflowshock.particles.parameters.scenes import Drop
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.flow_setup import build_physics
from reflowshock.particles.section.polyline import Polyline
from reflowshock.particles.section.section import Section, fill_block
from reflowshock.particles.section.section_step import SectionFlow, SectionStep
from reflowshock.particles.steps.time_step import TimeStep, largest_step


def start_section(drop: Drop, solder: Solder, effects: dict[str, bool]) -> SectionFlow:
    """Set up the flow of a drop's section from rest, with only the effects that are on.

    Args:
        drop: Drop with the kind of its section, plane or axisymmetric, and its resolution.
        solder: Fluid and numerics.
        effects: Name of an effect, such as "inertia" -> on or off; missing effects are off.

    Returns:
        Flow at time 0, whose free surface is a polyline in the plane of the section.
    """
    if drop.section == "plane":
        polyline, width = Polyline.plane(is_closed=False, depth=drop.edge), 0.5 * drop.edge
    else:
        polyline, width = Polyline.meridian(), drop.edge / np.sqrt(np.pi)
    body = Section.filled(fill_block(polyline, width, drop.edge, drop.count), polyline)
    largest, bound = largest_step(solder, body.cloud.spacing)
    time_step = TimeStep(largest, body.cloud.spacing, largest, bound, bound)
    return SectionFlow(body, build_physics(solder, effects, (), in_section=True), time_step, SectionStep())
