"""Hard reflow cases: stability, volume and the exact shape at rest."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import slide
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.reference.young_laplace import sessile_meridian
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow, stop_rule
from reflowshock.particles.scenes.reflow import solve_joint
from reflowshock.particles.steps.rest import run_to_rest
from tests.support.drops import solve_drop

GAMMA, DENSITY, VOLUME = 0.4985, 8930.0, 1e-9
NUMERICS = SolderNumerics(time_step_limit=100)
WEIGHTLESS = SolderEffects(gravity="off")


def check(flow, run, exact, tolerance):
    """Check volume, positions, height and width of a drop at rest against its exact shape."""
    last = run.records[-1]
    assert last.volume == pytest.approx(flow.volume, rel=1e-6)
    assert np.isfinite(flow.body.points).all()
    assert last.height == pytest.approx(exact.height, rel=tolerance)
    assert run.profiles[-1].max_width == pytest.approx(exact.max_width, rel=tolerance)


@pytest.mark.parametrize(("degrees", "count"), [pytest.param(5.0, 6, marks=pytest.mark.long), (175.0, 7)])
def test_a_film_and_a_barely_touching_ball(degrees, count):
    angle = np.radians(degrees)
    angles = {"pad_contact_angle": angle, "mask_contact_angle": np.radians(179.0)}
    flow, run = solve_drop(Solder(volume=VOLUME, effects=WEIGHTLESS, numerics=NUMERICS, **angles), count)
    check(flow, run, sessile_meridian(VOLUME, angle, GAMMA), 0.015)


@pytest.mark.parametrize("degrees", [pytest.param(60.0, marks=pytest.mark.long), 120.0])
def test_bond_number_five(degrees):
    angle, gravity = np.radians(degrees), 5.0 * GAMMA / (DENSITY * VOLUME ** (2 / 3))
    flow, run = solve_drop(Solder(volume=VOLUME, pad_contact_angle=angle, gravity=gravity, numerics=NUMERICS), 7)
    check(flow, run, sessile_meridian(VOLUME, angle, GAMMA, DENSITY * gravity), 0.01)


def test_the_smallest_volume_covers_its_pad():
    """With 0.0141 mm^3 on a pad of 0.3 mm radius, V = pi h (3 a^2 + h^2) / 6 gives the height of the cap."""
    volume, radius = 0.0141e-9, 0.3e-3
    _, run = solve_drop(Solder(volume=volume, effects=WEIGHTLESS, numerics=NUMERICS), 7, pad_radius=radius)
    roots = np.roots([1.0, 0.0, 3.0 * radius**2, -6.0 * volume / np.pi])
    height = float(roots[np.isreal(roots)].real[0])
    assert run.records[-1].volume == pytest.approx(volume, rel=1e-6)
    assert run.records[-1].height == pytest.approx(height, rel=0.01)
    assert run.profiles[-1].max_width == pytest.approx(2.0 * radius, rel=5e-3)


@pytest.mark.parametrize("inertia", ["off", "on"])
@pytest.mark.parametrize("viscosity", [1e-3, pytest.param(10.0, marks=pytest.mark.long)])
def test_thin_and_thick_liquids(viscosity, inertia):
    effects = SolderEffects(viscosity="on", inertia=inertia)
    numerics = SolderNumerics(spacing=7e-5, time_step_limit=100)
    solder = Solder(volume=0.0724e-9, viscosity=viscosity, effects=effects, numerics=numerics)
    shape = solve_joint(JointGeometry(0.31e-3, 0.24e-3, 0.24e-3), solder)
    assert shape.verdict == "ok"
    assert shape.history["energy"].argmax() == 0
    assert abs(shape.metrics["volume_drift"][0]) < 1e-6
    assert abs(shape.metrics["width_error"][0]) < 5e-3


def test_a_jittered_lattice():
    """All particles are displaced at random by 0.2 spacings, those on the wall within the wall."""
    cloud, angle = box_cloud(np.cbrt(VOLUME), 7), np.radians(60.0)
    jitter = 0.2 * cloud.spacing * np.random.default_rng(5).normal(size=cloud.points.shape)
    cloud = replace(cloud, points=cloud.points + slide(cloud.plates, cloud.wall, jitter))
    solder = Solder(volume=VOLUME, pad_contact_angle=angle, effects=WEIGHTLESS, numerics=NUMERICS)
    effects = dict.fromkeys(("surface_tension", "wall_adhesion"), True)
    effects |= dict.fromkeys(("gravity", "inertia", "viscosity"), False)
    flow = start_flow(cloud, solder, effects, (contact_line(cloud, 0, np.inf, solder),))
    run = run_to_rest(flow, stop_rule(cloud, solder, effects))
    check(flow, run, sessile_meridian(flow.volume, angle, GAMMA), 0.01)
