"""Each model of surface tension in an exact case, to separate bugs from weaknesses of the model."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchmarks.tension.free_pressure import FreeSurfacePressure, level_at
from benchmarks.tension.half_level import fill_lattice, level_points
from benchmarks.tension.pairwise import PAIRED, REACH, cohesion, strength
from benchmarks.tension.scenes import set_up_drop, unit_drop
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.smoothing import SUPPORT, slope

DROP = unit_drop(14, 0.2)


def pulls(model):
    """Points, masses and accelerations by the model of a sphere of particles."""
    simulation = set_up_drop(DROP, model)
    points = np.stack(simulation.fields[:3], axis=1)
    return points, simulation.fields.mass, simulation.surface.accelerations(points, simulation.fields)


@pytest.mark.long
@pytest.mark.parametrize(("model", "slack"), [("colour function", 0.1), ("free-surface pressure", 0.1)])
def test_forces_have_the_virial_of_the_tension_of_a_sphere(model, slack):
    """The sum of F . x is -2 gamma A, whatever the thickness of the layer in which the forces act."""
    points, mass, pull = pulls(model)
    assert (mass * (pull * points.T).sum(axis=0)).sum() == pytest.approx(-2.0 * np.pi, rel=slack)
    assert np.abs(pull @ mass).max() < 1e-10


def test_forces_between_pairs_have_the_tension_and_the_pressure_of_their_theory():
    """A film of particles placed with some disorder, periodic along x and y: gamma = integral of p_N - p_T."""
    law = set_up_drop(DROP, "pairwise").law
    count, high, spacing = 16, 14, law.spacing
    places = np.meshgrid(np.arange(count), np.arange(count), np.arange(high), indexing="ij")
    points = spacing * np.stack(places, axis=-1).reshape(-1, 3)
    points += 0.2 * spacing * np.random.default_rng(1).uniform(-1.0, 1.0, points.shape)
    side, reach = count * spacing, PAIRED * spacing
    box = np.array([side, side, 10.0 * high * spacing])
    pairs = cKDTree(points % box, boxsize=box).query_pairs(reach, output_type="ndarray")
    apart = points[pairs[:, 0]] - points[pairs[:, 1]]
    apart[:, :2] -= side * np.round(apart[:, :2] / side)
    distance = np.linalg.norm(apart, axis=1)
    over = strength(law, 1.0) * np.cos(REACH * distance / reach) / distance
    normal, along = (over * apart[:, 2] ** 2).sum(), 0.5 * (over * (apart[:, :2] ** 2).sum(axis=1)).sum()
    assert (normal - along) / (2.0 * side**2) == pytest.approx(1.0, rel=0.1)
    inside = np.abs(points[pairs].mean(axis=1)[:, 2] - 0.5 * high * spacing) < 3.0 * spacing
    pressure = (over * distance**2)[inside].sum() / (3.0 * 6.0 * spacing * side**2)
    assert pressure == pytest.approx(cohesion(law, 1.0), rel=0.1)


def test_the_force_of_a_wall_is_that_of_a_half_space_of_particles():
    simulation = set_up_drop(unit_drop(14, 0.2, contact_angle=np.radians(60.0)), "pairwise")
    law, fields, surface = simulation.law, simulation.fields, simulation.surface
    points = np.stack(fields[:3], axis=1)
    with_wall, surface.law = surface.accelerations(points, fields), law._replace(mirror=0)
    pull = (with_wall - surface.accelerations(points, fields))[2] * fields.mass
    fine, reach = law.spacing / 4.0, PAIRED * law.spacing
    across = fine * (np.arange(-12, 12) + 0.5)
    x, y, z = np.meshgrid(across, across, fine * (np.arange(-12, 0) + 0.5), indexing="ij")
    for height in (0.5, 1.5):
        near = np.argmin(np.abs(points[:, 2] - height * law.spacing))
        dz = points[near, 2] - z
        distance = np.sqrt(x * x + y * y + dz * dz)
        force = np.where(distance < reach, np.cos(REACH * distance / reach) * dz / distance, 0.0).sum() / 4.0**3
        assert pull[near] == pytest.approx(0.75 * strength(law, 1.0) * force, rel=0.05)


@pytest.mark.long
def test_under_a_uniform_pressure_of_the_surface_liquid_rests():
    """2 p G / rho completes the pair sums of a uniform pressure wherever |G| h exceeds the threshold."""
    simulation = set_up_drop(DROP, "free-surface pressure")
    fields, surface = simulation.fields, simulation.surface
    points = np.stack(fields[:3], axis=1)
    pull = surface.accelerations(points, fields)
    law, volume = simulation.law, fields.mass / fields.density
    pairs = cKDTree(points).query_pairs(SUPPORT * law.length, output_type="ndarray")
    apart = points[pairs[:, 0]] - points[pairs[:, 1]]
    steep = [slope(law.kernel, False, ratio) for ratio in np.linalg.norm(apart, axis=1) / law.length]
    rise, lack = law.norm / law.length**2 * np.array(steep)[:, None] * apart, np.zeros((3, simulation.fluids))
    np.add.at(lack.T, pairs[:, 0], volume[pairs[:, 1], None] * rise)
    np.add.at(lack.T, pairs[:, 1], -volume[pairs[:, 0], None] * rise)
    at_surface = np.linalg.norm(lack, axis=0) * law.length > 0.03
    factor = (pull * lack).sum(axis=0)[at_surface] / (lack**2).sum(axis=0)[at_surface]
    assert np.allclose(pull[:, at_surface], factor * lack[:, at_surface], rtol=0.0, atol=1e-9 * np.abs(pull).max())
    assert not pull[:, ~at_surface].any()


@pytest.mark.long
def test_the_level_of_a_ball_is_a_sphere_and_bends_as_one():
    """Finely filled; the level lies inside the ball by a share of the square of the kernel over the radius."""
    law = set_up_drop(DROP, "free-surface pressure").law
    points, volume = fill_lattice(lambda x: np.linalg.norm(x, axis=1) < 0.5, 0.5, law.spacing)
    fields = flow.make_fields(points.T, np.empty((3, 0)), np.zeros(len(points)), law)
    fields.mass[:] = volume
    radius = np.linalg.norm(level_points(points, volume, law.spacing, half=False), axis=1)
    assert radius.max() / radius.min() < 1.01  # its stairs are a third of a spacing high
    assert 0.5 - law.spacing**2 / 0.5 < radius.mean() < 0.5
    row = np.arange(len(points))
    level, *derivatives = level_at((radius.mean(), 0.0, 0.0), row, fields, 4.0 * law.spacing)
    rise, (across, along) = derivatives[0], derivatives[4:6]
    assert level == pytest.approx(0.5, abs=0.01)
    assert -(across + along) / abs(rise) == pytest.approx(2.0 / radius.mean(), rel=0.03)


@pytest.mark.long
def test_a_surface_without_tension_does_nothing():
    simulation = set_up_drop(DROP, "free-surface pressure")
    points = np.stack(simulation.fields[:3], axis=1)
    assert not FreeSurfacePressure(simulation.law, 0.0).accelerations(points, simulation.fields).any()
