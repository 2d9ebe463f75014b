"""Steady motion: a freely sliding body reaches its goal in a few steps of any size."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.plate import Pad
from reflowshock.particles.physics.forces import SurfaceTension, Wetting
from reflowshock.particles.physics.operators import Mass
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.relaxation import Relaxation
from reflowshock.particles.steps.time_step import TimeStep
from reflowshock.particles.surface.contact_line import ContactLine

PULL, SPACING = 0.05, 0.2


@dataclass
class Slope:
    """Uniform force along x with its potential energy, as on a slightly tilted wall."""

    pull: float

    def energy(self, body):
        return -self.pull * body.points[: body.cloud.surface_count, 0].mean()

    def force(self, body):
        count = body.cloud.surface_count
        force = np.zeros_like(body.points)
        force[:count, 0] = self.pull / count
        return force


def drop(pull):
    """Return a drop of 90 degrees at rest on a uniform wall, pulled by a tangential force."""
    cloud = box_cloud(1.0, 6)
    ring = cloud.rings[0]
    local = cloud.plates[0].local(cloud.points[ring])
    line = ContactLine(0, (Pad((0.0, 0.0), np.inf, 0.5 * np.pi),), 2.6, local, np.array([len(ring)]))
    tension = SurfaceTension(1.0)
    wetting = Wetting(1.0, (line,), (tension,))
    physics = Physics((tension, wetting), (Mass(1.0), tension), (), (wetting,), (line,))
    flow = LiquidFlow(Body.at_rest(cloud), physics, TimeStep(0.05, SPACING, 0.05), Relaxation(1.0))
    for _ in range(60):
        flow.step()
    flow.physics = replace(physics, forces=(*physics.forces, Slope(pull)))
    return flow


def place(flow):
    """Return the mean of x over the surface particles of a flow [m]."""
    return flow.body.points[: flow.body.cloud.surface_count, 0].mean()


def test_a_slide_goes_on_at_its_speed():
    flow = drop(PULL)
    start, records = place(flow), []
    while place(flow) < start + 0.5 * SPACING and len(records) < 100:
        records.append(flow.step())
    long = [record for record in records if record.binding == "steady motion"]
    plain = [record for record in records if record.binding == "capillary multiple"]
    assert place(flow) >= start + 0.5 * SPACING
    assert max(record.displacement for record in plain) < 0.01
    assert 0.05 < max(record.displacement for record in long) <= 0.25
    assert long[0].speed == pytest.approx(plain[-1].speed, rel=0.3)
    energies = [record.energy for record in records]
    assert (np.diff(energies) <= 1e-9 * abs(energies[0])).all()


def test_a_body_at_rest_does_not_go_on():
    flow = drop(0.0)
    records = [flow.step() for _ in range(10)]
    assert max(record.displacement for record in records) < 1e-3
