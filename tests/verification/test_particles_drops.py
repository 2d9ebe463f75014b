"""Merging drops: the exact shape of the total volume at rest."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.surface_measure import centre_of_volume
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.drops import OverlappingDrops, run_drops
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow, stop_rule
from reflowshock.particles.surface.cloud_level_set import cloud_from_level_set
from reflowshock.particles.surface.profile import fit_profile
from tests.support.level_sets import ball, cap_radius, grid_around_ball

ANGLE = np.radians(60.0)
ON = {"surface_tension": True, "gravity": False, "wall_adhesion": True, "viscosity": False, "inertia": False}
FREE = ON | {"wall_adhesion": False}


def start_on_wall(cloud, solder):
    """Return the flow of a cloud that wets a wall, at time 0."""
    lines = tuple(contact_line(cloud, wall, inf, solder) for wall in range(len(cloud.rings)))
    return start_flow(cloud, solder, ON, lines)


def cubes_on_a_wall(edges, centres, count, solder):
    """Return flows of cubes on a wall, from edges and centres along x [m]."""
    flows = []
    for edge, centre in zip(edges, centres, strict=True):
        flow = start_on_wall(box_cloud(edge, count), solder)
        flow.body.points[:, 0] += centre
        flows.append(flow)
    return flows


def solder_of(spacing):
    """Return solder with a particle spacing [m]."""
    return Solder(volume=1e-9, pad_contact_angle=ANGLE, numerics=SolderNumerics(spacing=spacing, max_steps=600))


def centre(body):
    """Return the centre of volume of a body, shape (3,) [m]."""
    return centre_of_volume(body.points, body.triangles)


def touching_balls(radii, solder):
    """Return flows of balls in a row along x that touch, from their radii [m]."""
    spacing, flows, left_end = solder.numerics.spacing, [], 0.0
    for radius in radii:
        volume = 4.0 / 3.0 * np.pi * radius**3
        level = ball(grid_around_ball((0, 0, 0), radius, spacing), (0, 0, 0), radius)
        flow = start_flow(cloud_from_level_set(level, volume, ()), solder, FREE, ())
        flow.body.points[:, 0] += left_end + radius
        left_end += 2.0 * radius + 0.5 * spacing
        flows.append(flow)
    return flows


def test_drops_that_become_one_keep_their_momentum():
    solder = solder_of(1.5e-4)
    flows = touching_balls((0.5e-3, 0.5e-3), solder)
    flows[0].body.velocity[:] = (0.3, 0.0, 0.1)
    rule = replace(stop_rule(flows[0].body.cloud, solder, FREE), end_time=0.0)
    (drop,) = run_drops(flows, rule, lambda body: start_flow(body.cloud, solder, FREE, ()))
    body = drop.flow.body
    assert body.volumes @ body.velocity == pytest.approx(0.5 * body.volumes.sum() * np.array([0.3, 0.0, 0.1]))


@pytest.mark.long
@pytest.mark.parametrize("radii", [(0.5e-3, 0.5e-3), (0.5e-3, 0.35e-3)])
def test_two_free_drops_become_one_sphere(radii):
    solder = solder_of(1e-4)
    flows = touching_balls(radii, solder)
    cloud = flows[0].body.cloud
    volumes, centres = zip(*((flow.body.volume()[0], centre(flow.body)) for flow in flows), strict=True)
    (drop,) = run_drops(flows, stop_rule(cloud, solder, FREE), lambda body: start_flow(body.cloud, solder, FREE, ()))
    drift = centre(drop.flow.body) - np.average(centres, 0, volumes)
    assert np.linalg.norm(drift) < 0.01 * max(radii)
    assert [record.step for record in drop.records] == list(range(1, len(drop.records) + 1))
    body = drop.flow.body
    total = 4.0 / 3.0 * np.pi * sum(radius**3 for radius in radii)
    assert body.volume()[0] == pytest.approx(total, rel=1e-3)
    exact = np.cbrt(3.0 * total / (4.0 * np.pi))
    surface = body.points[: body.cloud.surface_count]
    assert np.linalg.norm(surface - centre(body), axis=1) == pytest.approx(exact, rel=1e-2)


@pytest.mark.long
def test_two_drops_that_spread_into_each_other_become_one_cap():
    edge = np.cbrt(0.5e-9)
    solder = solder_of(1e-4)
    flows = cubes_on_a_wall((edge, edge), (-0.62e-3, 0.62e-3), 7, solder)
    rule = stop_rule(flows[0].body.cloud, solder, ON)
    (drop,) = run_drops(flows, rule, lambda body: start_on_wall(body.cloud, solder))
    assert drop.origins == (0, 1)
    before = max(len(parent.records) for parent in drop.parents)
    assert [record.step - before for record in drop.records] == list(range(1, len(drop.records) + 1))
    body, radius = drop.flow.body, cap_radius(1e-9, ANGLE)
    assert body.volume()[0] == pytest.approx(1e-9, rel=1e-3)
    surface = body.points[: body.cloud.surface_count]
    assert np.ptp(surface[:, 2]) == pytest.approx(radius * (1.0 - np.cos(ANGLE)), rel=1e-2)
    assert fit_profile(body.points, body.triangles).max_width == pytest.approx(2.0 * radius * np.sin(ANGLE), rel=1e-2)


def test_drops_that_do_not_reach_each_other_stay_two():
    edge = np.cbrt(0.5e-9)
    solder = solder_of(1.3e-4)
    flows = cubes_on_a_wall((edge, edge), (-1.2e-3, 1.2e-3), 7, solder)
    drops = run_drops(flows, stop_rule(flows[0].body.cloud, solder, ON), lambda body: start_on_wall(body.cloud, solder))
    assert [drop.origins for drop in drops] == [(0,), (1,)]
    exact = cap_radius(0.5e-9, ANGLE) * (1.0 - np.cos(ANGLE))
    for drop in drops:
        body = drop.flow.body
        assert np.ptp(body.points[:, 2]) == pytest.approx(exact, rel=1e-2)


def test_drops_that_overlap_at_the_start_are_an_error():
    edge = np.cbrt(0.5e-9)
    solder = solder_of(1.3e-4)
    flows = cubes_on_a_wall((edge, edge), (-0.3e-3, 0.3e-3), 7, solder)
    with pytest.raises(OverlappingDrops, match="drops 0 and 1 overlap"):
        run_drops(flows, stop_rule(flows[0].body.cloud, solder, ON), lambda body: start_on_wall(body.cloud, solder))
