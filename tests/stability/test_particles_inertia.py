"""Drops with inertia that start as cubes on a wall and come to rest as caps, at any viscosity.

The long tests have counterparts in ``cases/hard``, where the first case of each file is short.
"""

import numpy as np
import pytest

from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.scenes.metrics import drop_metrics
from tests.support.drops import solve_drop

PAPER = {"surface_tension": 4.985, "viscosity": 0.227}
EDGE = 1e-3


def spread(per_edge, degrees=60.0, end=0.1, **values):
    """Return the metrics of the final drop and its potential and kinetic energy at each step."""
    numerics = SolderNumerics(time_step_limit=100, max_steps=1000, spacing=EDGE / (per_edge - 1))
    effects = SolderEffects(inertia="on", viscosity="on", gravity="off")
    angle = np.radians(degrees)
    parameters = PAPER | values
    solder = Solder(
        volume=EDGE**3, pad_contact_angle=angle, process_time=end, effects=effects, numerics=numerics, **parameters
    )
    flow, run = solve_drop(solder, per_edge)
    assert np.isfinite(flow.body.points).all()
    metrics = {name: value for name, (value, _) in drop_metrics(solder, np.inf, flow, run).items()}
    assert abs(metrics["volume_drift"]) < 1e-6
    return metrics, np.array([record.energy for record in run.records])


@pytest.mark.long
@pytest.mark.parametrize("degrees", [pytest.param(30, marks=pytest.mark.long), 120])
def test_a_drop_comes_to_rest_as_the_cap(degrees):
    """The drop has the values of Hu et al., 125 particles and steps of 100 times the capillary limit."""
    metrics, energy = spread(5, degrees)
    assert abs(metrics["height_error"]) < 0.015
    assert abs(metrics["max_width_error"]) < 0.005
    assert metrics["capillary_number_at_rest"] < 1e-4
    assert energy[-1] == pytest.approx(energy.min(), rel=1e-3)


@pytest.mark.parametrize("viscosity", [pytest.param(1e-3, marks=pytest.mark.long), 10.0])
def test_thin_and_thick_liquids(viscosity):
    """At the lowest viscosity the drop still oscillates when the process ends."""
    metrics, energy = spread(5, viscosity=viscosity, end=2.5e-3)
    assert metrics["volume_drift"] < 1e-6
    assert energy.max() == energy[0]


@pytest.mark.long
@pytest.mark.parametrize("wall", [{"wall": "no-slip"}, {"wall": "slip", "slip_length": 5e-5}])
def test_no_slip_walls_do_not_change_the_shape_at_rest(wall):
    metrics, _ = spread(5, **wall)
    assert abs(metrics["height_error"]) < 0.015
    assert abs(metrics["max_width_error"]) < 0.005
