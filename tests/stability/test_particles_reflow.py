"""Hard reflow cases: rest, conserved volume, decreasing energy and the reported outcome."""

import numpy as np
import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.scenes.reference_shapes import reference_drop
from reflowshock.particles.scenes.reflow import LiquidJoint, solve_joint
from reflowshock.particles.steps.rest import run_to_rest
from tests.support.drops import solve_drop

BALL, RADIUS = 0.0724e-9, 0.24e-3
MM = 1e-3


def cylinder(fill, gap, radius=RADIUS):
    """Return the volume of a cylinder in a gap, times a factor ``fill`` [m^3]."""
    return fill * np.pi * radius**2 * gap


def check_energy_falls(energy):
    """Check that the energy of no step exceeds that before it, up to rounding."""
    assert np.diff(energy).max() < 1e-9 * abs(energy[0])


def check(shape, verdict):
    """Check verdict, volume, positions and width of a joint at rest."""
    assert shape.verdict == verdict
    assert abs(shape.metrics["volume_drift"][0]) < 1e-6
    assert np.isfinite(shape.points).all()
    assert abs(shape.metrics["width_error"][0]) < 0.01


@pytest.mark.parametrize(
    ("gap", "board", "package", "volume", "verdict"),
    [
        pytest.param(0.22, 0.24, 0.24, BALL, "overflow", marks=pytest.mark.long),
        pytest.param(0.45, 0.24, 0.24, BALL, "ok", marks=pytest.mark.long),
        (0.45, 0.24, 0.24, cylinder(0.5, 0.45e-3), "ok"),
        pytest.param(0.80, 0.24, 0.24, cylinder(1.3, 0.80e-3), "ok", marks=pytest.mark.long),
        pytest.param(0.31, 0.30, 0.20, BALL, "ok", marks=pytest.mark.long),
        (0.31, 0.12, 0.24, BALL, "overflow"),
        pytest.param(0.31, 0.24, 0.24, cylinder(3.0, 0.31e-3), "overflow", marks=pytest.mark.long),
    ],
    ids=["squeezed", "stretched", "deep neck", "slender", "unequal discs", "tiny disc", "three times too much"],
)
def test_extreme_joints(gap, board, package, volume, verdict):
    numerics = SolderNumerics(spacing=7e-5)
    solder = Solder(volume=volume, numerics=numerics)
    shape = solve_joint(JointGeometry(gap * MM, board * MM, package * MM), solder)
    check(shape, verdict)
    check_energy_falls(shape.history["energy"])


@pytest.mark.parametrize("limit", [5.0, pytest.param(20.0, marks=pytest.mark.long), 100.0])
@pytest.mark.parametrize("spacing", [1e-4, 5e-5])
def test_time_steps_far_beyond_the_capillary_limit(limit, spacing):
    """Explicit surface tension is unstable at 4 times the limit."""
    numerics = SolderNumerics(spacing=spacing, time_step_limit=limit)
    shape = solve_joint(JointGeometry(0.31e-3, RADIUS, RADIUS), Solder(volume=BALL, numerics=numerics))
    check(shape, "ok")
    check_energy_falls(shape.history["energy"])
    assert shape.metrics["time_step_over_capillary_limit"][0] > 0.5 * limit


@pytest.mark.long
def test_a_joint_without_equilibrium_opens():
    gap = 0.6e-3
    solder = Solder(volume=cylinder(0.4, gap), numerics=SolderNumerics(spacing=7e-5))
    shape = solve_joint(JointGeometry(gap, RADIUS, RADIUS), solder)
    assert shape.verdict == "open"
    value = {name: number for name, (number, _) in shape.metrics.items()}
    assert value["volume_board"] + value["volume_package"] == pytest.approx(solder.volume, rel=1e-9)
    for plate in ("board", "package"):  # one cap per pad; gravity changes its height by 0.3 %
        part = solder.model_copy(update={"volume": value[f"volume_{plate}"]})
        assert value[f"drop_height_{plate}"] == pytest.approx(reference_drop(part, RADIUS, 0.0).height, rel=1e-2)
    middle = 0.5 * gap
    sides = [set(np.sign(shape.points[ring, 2] - middle)) for ring in shape.rings]
    assert sides == [{-1.0}, {1.0}]
    corners = np.sign(shape.points[shape.triangles, 2] - middle)
    assert np.all(corners == corners[:, :1])  # no triangle between the drops


def test_too_little_solder_for_any_neck_stays_on_the_board_and_is_open():
    gap = 0.34e-3
    solder = Solder(volume=0.012e-9, numerics=SolderNumerics(spacing=6e-5))
    shape = solve_joint(JointGeometry(gap, RADIUS, RADIUS), solder)
    assert shape.verdict == "open"
    assert len(shape.rings) == 1
    assert shape.metrics["drop_height"][0] < 0.5 * gap
    assert abs(shape.metrics["width_error"][0]) < 0.01
    assert abs(shape.metrics["volume_drift"][0]) < 1e-6


@pytest.mark.parametrize("properties", ["physical", pytest.param("paper", marks=pytest.mark.long)])
def test_inertia_never_gains_energy(properties):
    """Without viscosity and from a cube, the total of kinetic and potential energy decreases."""
    values = {"physical": {}, "paper": {"surface_tension": 4.985, "viscosity": 0.227}}[properties]
    numerics = SolderNumerics(spacing=1e-4, time_step_limit=5)
    solder = Solder(volume=BALL, numerics=numerics, effects=SolderEffects(inertia="on"), **values)
    geometry = JointGeometry(0.31e-3, RADIUS, RADIUS)
    joint = LiquidJoint(geometry, solder)
    flow = joint.start()
    rule = joint.stop_rule(flow)
    total = [flow.physics.energy(flow.body)]

    def add(_fraction):
        total.append(flow.physics.energy(flow.body) + flow.solver.kinetic_energy(flow.body))

    shape = joint.shape(flow, run_to_rest(flow, rule, add))
    check(shape, "ok")
    assert np.diff(total).max() < 1e-6 * total[0]
    energy = shape.history["energy"]
    assert energy.max() < total[0]
    assert energy[-1] == pytest.approx(energy.min(), rel=1e-4)


@pytest.mark.long
@pytest.mark.parametrize("degrees", [30, 148])
def test_extreme_contact_angles(degrees):
    """One cube spreads to a film of a third of its height, the other almost detaches from its wall."""
    numerics = SolderNumerics(time_step_limit=100)
    flow, run = solve_drop(Solder(volume=1e-9, pad_contact_angle=np.radians(degrees), numerics=numerics), 7)
    check_energy_falls(np.array([record.energy for record in run.records]))
    assert flow.body.volume()[0] == pytest.approx(1e-9, rel=1e-6)
