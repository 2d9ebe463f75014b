"""Merging liquid bridges between two plates: exact cylinder, and two joints on their pads."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.particles.core.cloud import joint_cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import Pad, Plate
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.bridge import solve_bridge
from reflowshock.particles.scenes.drops import run_drops
from reflowshock.particles.scenes.flow_setup import pad_lines, start_flow, stop_rule
from reflowshock.particles.scenes.reflow import solve_joint
from reflowshock.particles.surface.profile import fit_profile

MM = 1e-3
ON = {"surface_tension": True, "gravity": False, "wall_adhesion": True, "viscosity": False, "inertia": False}


def check_energy_falls(energy):
    """Check that the energy never rises by more than 1e-4 of its start."""
    assert np.diff(energy).max() < 1e-4 * abs(energy[0])


def test_two_liquid_bridges_on_uniform_plates_become_one_cylinder():
    """At 90 degrees the shape at rest is a cylinder of the total volume with the pressure gamma / R."""
    gap, distance, volume = 0.3 * MM, 0.8 * MM, np.pi * 0.36**2 * 0.3 * MM**3
    numerics = SolderNumerics(spacing=0.09 * MM)
    solder = Solder(volume=volume, pad_contact_angle=0.5 * np.pi, numerics=numerics)
    plates = (Plate.horizontal(0.0), Plate.horizontal(gap, side=1.0))
    uniform = tuple(replace(plate, pads=(Pad((0.0, 0.0), np.inf, 0.5 * np.pi),)) for plate in plates)

    def start(cloud):
        return start_flow(cloud, solder, ON, pad_lines(cloud, solder))

    flows = []
    for x in (-0.5 * distance, 0.5 * distance):
        cloud = joint_cloud(JointGeometry(gap, 0.3 * MM, 0.3 * MM), volume, numerics.spacing)
        flows.append(start(replace(cloud, points=cloud.points + np.array([x, 0.0, 0.0]), plates=uniform)))
    rule = stop_rule(flows[0].body.cloud, solder, ON)
    (drop,) = run_drops(flows, rule, lambda body: start(body.cloud))
    body, radius = drop.flow.body, np.sqrt(2.0 * volume / (np.pi * gap))
    assert drop.origins == (0, 1)
    assert [plate.side for plate in body.plates] == [-1.0, 1.0]
    assert body.volume()[0] == pytest.approx(2.0 * volume, rel=1e-3)
    assert fit_profile(body.points, body.triangles, body.span()).max_width == pytest.approx(2.0 * radius, rel=2e-3)
    assert np.ptp(body.points, axis=0) == pytest.approx((2.0 * radius, 2.0 * radius, gap), rel=5e-3)
    assert body.surface_pressure == pytest.approx(solder.surface_tension / radius, rel=5e-3)
    check_energy_falls(np.array([record.energy for record in drop.records]))


@pytest.mark.long
def test_two_overfilled_joints_become_one_body_on_four_pads():
    geometry = JointGeometry(0.31 * MM, 0.24 * MM, 0.24 * MM)
    solder = Solder(volume=0.26 * MM**3, numerics=SolderNumerics(spacing=0.1 * MM))
    alone = solve_joint(geometry, solder)
    assert alone.verdict == "overflow"
    assert abs(alone.metrics["width_error"][0]) < 0.01
    shape = solve_bridge((geometry, geometry), (alone, alone), 1.0 * MM, solder)
    assert shape.verdict == "bridged"
    assert abs(shape.metrics["volume_drift"][0]) < 1e-3
    assert shape.metrics["volume"][0] == pytest.approx(2.0 * solder.volume, rel=1e-3)
    assert len(shape.rings) == 2
    for ring in shape.rings:  # the contact line encloses both pads
        x, y = shape.points[ring, :2].T
        assert x.max() > 0.73 * MM and x.min() < -0.73 * MM
        assert np.abs(x).max() < 0.85 * MM and np.abs(y).max() > 0.4 * MM
    x, y, z = shape.surface_points.T
    assert (x.max(), y.max()) == pytest.approx((-x.min(), -y.min()), rel=0.01)
    assert z.min() == 0.0 and z.max() == pytest.approx(geometry.gap)
    # The final surface and wetting energy of the bridge is lower than the sum of both joints.
    assert shape.history["energy"][-1] < 2.0 * alone.history["energy"][-1]
