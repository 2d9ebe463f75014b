"""Single drops against exact shapes: pressure of a free drop, walls with hysteresis."""

import numpy as np
import pytest

from reflowshock.particles.parameters.scenes import Drop, Fluid
from reflowshock.particles.scenes.drop_at_rest import drop_to_rest

EDGE = 75.4e-6
WATER = Fluid(density=1000.0, surface_tension=0.072, viscosity=1e-3, numerics={"time_step_limit": 100.0})


def at_rest(fluid, **drop):
    """Return the shape of a drop at rest, from a fluid and fields of ``Drop``."""
    drop = Drop(**drop)
    return drop_to_rest(drop, fluid.resolve(drop, "auto")).shape


def test_laplace_pressure_of_a_cube_that_becomes_a_sphere():
    """Tilford et al.: 3.08 kPa. Limits: mean 0.5 %, scatter 1 %, capillary number 1e-4; second order in space."""
    counts, errors = np.array([6, 8, 11]), []
    for count in counts:
        metrics = at_rest(WATER, volume=EDGE**3, particles_per_edge=count).metrics
        errors.append(metrics["mean_pressure_error"][0])
    assert -np.polyfit(np.log(counts - 1.0), np.log(np.abs(errors)), 1)[0] > 1.8, errors
    assert metrics["mean_pressure"][0] == pytest.approx(3080.0, rel=5e-3)
    assert abs(metrics["height_error"][0]) < 2e-3
    assert abs(metrics["max_width_error"][0]) < 1e-3
    assert metrics["pressure_scatter"][0] < 1e-2
    assert metrics["capillary_number_at_rest"][0] < 1e-4
    assert abs(metrics["volume_drift"][0]) < 1e-6


@pytest.mark.parametrize(
    ("receding", "advancing"), [pytest.param(30.0, 60.0, marks=pytest.mark.long), (60.0, 120.0), (110.0, 130.0)]
)
def test_a_wall_with_hysteresis(receding, advancing):
    """A spreading cube becomes the cap of the advancing angle; otherwise its angle lies between both limits."""
    angles = {"receding_angle": np.radians(receding), "advancing_angle": np.radians(advancing)}
    solder = Fluid(numerics={"time_step_limit": 100.0}, gravity=0.0)
    metrics = at_rest(solder, volume=1e-9, particles_per_edge=7, **angles).metrics
    assert metrics["contact_angle_excess"][0] < 3.0
    assert abs(metrics["volume_drift"][0]) < 1e-6
    assert ("height_error" in metrics) == (advancing < 90.0)
    if advancing < 90.0:
        assert abs(metrics["height_error"][0]) < 5e-3
        assert abs(metrics["max_width_error"][0]) < 5e-3
