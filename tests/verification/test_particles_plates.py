"""Joints between plates in general positions: forces against Young-Laplace, energy and a truncated sphere."""

import numpy as np
import pytest
from scipy.optimize import brentq

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.physics.forces import Wetting
from reflowshock.particles.physics.physics import plate_wrench
from reflowshock.particles.physics.plate_motion import LIFT, SHIFT, Floating
from reflowshock.particles.reference.young_laplace import joint_meridian
from reflowshock.particles.scenes.moving_joint import settle_joint
from reflowshock.particles.scenes.reflow import LiquidJoint, solve_joint
from reflowshock.particles.steps.rest import run_to_rest

RADIUS, GAMMA = 0.24e-3, 0.4985
BALL, GAP = 0.0724e-9, 0.35e-3
PULL = np.pi * RADIUS * GAMMA


def weightless(volume, spacing):
    """Return solder without gravity, from volume [m^3] and spacing [m]."""
    numerics = SolderNumerics(spacing=spacing, time_step_limit=100)
    return Solder(volume=volume, effects=SolderEffects(gravity="off"), numerics=numerics)


def at_rest(geometry, volume=BALL, spacing=7e-5):
    """Return body, energy, and force and moment on the package at rest."""
    joint = LiquidJoint(geometry, weightless(volume, spacing))
    flow = joint.start()
    rule = joint.stop_rule(flow)
    run = run_to_rest(flow, rule)
    others = [force for force in flow.physics.forces if not isinstance(force, Wetting)]
    return flow.body, run.records[-1].energy, plate_wrench(flow.body, others, 1)


@pytest.mark.parametrize(
    "gap", [0.30e-3, *(pytest.param(gap, marks=pytest.mark.long) for gap in (0.35e-3, 0.40e-3)), 0.50e-3]
)
def test_axial_force_between_bulge_and_hourglass(gap):
    """Limits for V = pi 0.24^2 0.4 mm^3: width and waist 0.5 %, axial force 2 % of pi a gamma."""
    volume = np.pi * 0.24**2 * 0.4e-9
    shape = solve_joint(JointGeometry(gap, RADIUS, RADIUS), weightless(volume, 4e-5))
    exact = joint_meridian(volume, RADIUS, RADIUS, gap, GAMMA)
    assert shape.metrics["max_width"][0] == pytest.approx(exact.max_width, rel=5e-3)
    assert shape.metrics["waist"][0] == pytest.approx(exact.waist, rel=5e-3)
    assert shape.metrics["axial_force"][0] == pytest.approx(exact.axial_force, abs=0.02 * PULL)


def place(which, value):
    """Return the geometry of a joint with a changed gap, offset or tilt."""
    if which == "gap":
        return JointGeometry(GAP + RADIUS * value, RADIUS, RADIUS)
    if which == "offset":
        return JointGeometry(GAP, RADIUS, RADIUS, offset=(0.0, RADIUS * (0.3 + value)))
    return JointGeometry(GAP, RADIUS, RADIUS, tilt=(0.0, np.radians(3.0) + value))


@pytest.mark.parametrize(("which", "component"), [("gap", 2), ("offset", 1), ("tilt", 4)])
def test_force_on_the_plate_is_the_slope_of_the_energy(which, component):
    """The slope uses central differences of energies at rest; gap and offset are in radii, so all are energies."""
    step = 0.05 if which == "offset" else 0.01
    (_, above, _), (_, below, _) = (at_rest(place(which, value)) for value in (step, -step))
    wrench = at_rest(place(which, 0.0))[2] * np.repeat((RADIUS, 1.0), 3)
    slope = (above - below) / (2.0 * step)
    assert wrench[component] == pytest.approx(-slope, rel=5e-3)
    assert wrench[component] < 0.0


@pytest.mark.parametrize("degrees", [3.0, pytest.param(20.0, marks=pytest.mark.long)])
def test_a_pad_may_sit_anywhere_on_the_sphere(degrees):
    """Two discs cut a sphere, the upper one tilted about its centre: the sphere is in equilibrium.

    Radius, pressure 2 gamma / R and zero force and moment are exact; second order in the spacing.
    """
    tilt, half = np.radians(degrees), 0.5 * GAP
    volume = np.pi * GAP * (6 * RADIUS**2 + GAP**2) / 6
    sphere = np.hypot(RADIUS, half)
    offset = (half * np.sin(tilt), 0.0)
    geometry = JointGeometry(half * (1.0 + np.cos(tilt)), RADIUS, RADIUS, offset=offset, tilt=(0.0, tilt))
    spacings, errors = np.array([1e-4, 7e-5, 5e-5]), []
    for spacing in spacings:
        body, _, wrench = at_rest(geometry, volume, spacing)
        surface = body.points[: body.cloud.surface_count] - np.array([0.0, 0.0, half])
        radius = np.abs(np.linalg.norm(surface, axis=1) / sphere - 1.0).max()
        pressure = abs(body.surface_pressure * sphere / (2.0 * GAMMA) - 1.0)
        force, moment = np.linalg.norm(wrench[:3]) / PULL, np.linalg.norm(wrench[3:]) / (PULL * RADIUS)
        errors.append((radius, pressure, force, moment))
    order = np.polyfit(np.log(spacings), np.log(errors), 1)[0]
    assert (order > 1.5).all(), errors
    assert (np.array(errors[-1]) < (0.01, 0.01, 0.02, 0.002)).all()


def test_energy_of_a_small_tilt_is_half_stiffness_times_its_square():
    energies = [at_rest(JointGeometry(GAP, RADIUS, RADIUS, tilt=(0.0, np.radians(d))))[1] for d in (0.0, 1.5, 3.0)]
    assert energies[2] - energies[0] == pytest.approx(4.0 * (energies[1] - energies[0]), rel=0.02)


@pytest.mark.parametrize("load", [0.0, pytest.param(-1e-4, marks=pytest.mark.long), 2e-4])
def test_collapse_height_under_a_load(load):
    """A floating plate comes to rest where the Young-Laplace force balances the load."""
    plate = Floating(1, LIFT, np.array([0.0, 0.0, load]))
    shape = settle_joint(JointGeometry(GAP, RADIUS, RADIUS), weightless(BALL, 5e-5), (plate,))

    def excess(gap):
        return joint_meridian(BALL, RADIUS, RADIUS, gap, GAMMA).axial_force + load

    assert shape.metrics["standoff"][0] == pytest.approx(brentq(excess, 0.25e-3, 0.40e-3), rel=5e-3)
    assert shape.metrics["axial_force"][0] == pytest.approx(-load, abs=0.002 * PULL)
    assert abs(shape.metrics["width_error"][0]) < 5e-3


def test_an_offset_plate_centres_itself():
    """From 0.3 radius of offset, free to lift and shift, less than 1 % of the radius remains."""
    plate = Floating(1, np.vstack((LIFT, SHIFT)), np.array([0.0, 0.0, 1e-4]))
    geometry = JointGeometry(GAP, RADIUS, RADIUS, offset=(0.3 * RADIUS, 0.0))
    shape = settle_joint(geometry, weightless(BALL, 7e-5), (plate,))
    centre = shape.surface_points[shape.ring_package].mean(axis=0)
    assert np.abs(centre[:2]).max() < 0.01 * RADIUS
    assert abs(shape.metrics["volume_drift"][0]) < 1e-6
