"""Thin films and rims of droplets: wall friction, surface tracking and triangle quality."""

import numpy as np
import pytest

from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.surface_coupling import find_weights
from reflowshock.particles.sph.thin_films import add_wall_friction, sum_film_surface
from reflowshock.particles.sph_flows.droplet import droplet, liquid_of
from reflowshock.particles.surface.cloud_level_set import boundary_loops
from reflowshock.particles.surface.morphological_closing import narrowest_gap
from reflowshock.particles.surface.remeshing import cover_dry_spots, smooth_surface
from reflowshock.particles.surface.surface_mesh import have_reached_wall
from reflowshock.particles.surface.surface_quality import vertex_normals

INK = {"diameter": 1.0, "density": 1.0, "surface_tension": 1.0, "viscosity": 0.2, "duration": 1.0}
COARSE = DropletNumerics(particles_per_diameter=8)
ACROSS = 6
UP = np.array([0.0, 0.0, 1.0])


def film(layers, height):
    """Return a periodic film on a no-slip wall with unit spacing or a given height, and unit viscosity."""
    law, _ = liquid_of(Droplet(**INK | {"viscosity": 1.0, "speed": 1.0}, numerics=COARSE), 1.0)
    wide = ACROSS / np.sqrt(height / layers)
    law = law._replace(period_x=wide, period_y=wide, sound=1e3, diffusion=0.0, gravity_z=0.0, shifting=0.0)
    along, up = (np.arange(ACROSS) + 0.5) * wide / ACROSS, (np.arange(layers) + 0.5) * height / layers
    points = np.stack(np.meshgrid(along, along, up, indexing="ij")).reshape(3, -1)
    fields = flow.make_fields(points, np.empty((3, 0)), np.zeros(points.shape[1]), law)
    return Simulation(fields, points.shape[1], law)


def mean_speed(layers):
    """Return the mean speed under a tangential force over Nusselt's H^2 / 3; layers move uniformly."""
    simulation = film(layers, layers)
    fields, drag = simulation.fields, np.empty((layers, layers))
    layer = np.round(fields.z - 0.5).astype(int)
    for moving in range(layers):
        fields.u[:] = layer == moving
        simulation._find_rates()
        drag[:, moving] = [-simulation.rates[1][layer == k].mean() for k in range(layers)]
    return np.linalg.solve(drag, np.ones(layers)).mean() / (layers**2 / 3.0)


def test_a_wall_holds_a_film_as_in_nusselts_solution():
    """With pairwise radial viscosity, films of 2 and 4 particles were too fast by factors of 1.28 and 1.16."""
    assert mean_speed(2) == pytest.approx(1.0, abs=0.2)
    assert mean_speed(4) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("height", [0.6, 0.8, 1.0])
def test_a_film_of_one_particle_feels_the_friction_of_lubrication(height):
    """The friction is 3 mu u / H per area; sums over images alone give a ninth to a half of it."""
    simulation = film(1, height)
    fields, law = simulation.fields, simulation.law
    fields.u[:] = 1.0
    simulation._find_rates()
    by_images = -simulation.rates[1].mean() * height**2 / 3.0
    points = np.stack((fields.x, fields.y, np.full(simulation.fluids, height)), axis=1)
    count = simulation.fluids
    lists = np.arange(0, count * count + 1, count, dtype=np.int32), np.tile(np.arange(count, dtype=np.int32), count)
    weights = np.empty((2, 2, count * count))
    find_weights(points, lists, fields, law, weights)
    sums = sum_film_surface(points, UP * np.ones_like(points), lists, weights[1, 0], count)
    add_wall_friction(sums, fields, law, simulation.rates)
    assert by_images < 0.6 * height**2
    assert -simulation.rates[1].mean() * height**2 / 3.0 == pytest.approx(1.0, abs=0.05)


def test_a_film_of_two_particles_is_left_to_the_sums_over_pairs():
    simulation = film(2, 2.0)
    fields = simulation.fields
    fields.u[:] = 1.0
    before = simulation.rates.copy()
    points = np.array([[0.5, 0.5, 2.0]])
    lists = np.array([0, simulation.fluids], np.int32), np.arange(simulation.fluids, dtype=np.int32)
    weights = np.empty((2, 2, simulation.fluids))
    find_weights(points, lists, fields, simulation.law, weights)
    sums = sum_film_surface(points, UP * np.ones_like(points), lists, weights[1, 0], simulation.fluids)
    add_wall_friction(sums, fields, simulation.law, simulation.rates)
    assert np.array_equal(simulation.rates, before)


def test_vertices_that_particles_pass_or_leave_behind_follow_them():
    simulation = droplet(Droplet(**INK, numerics=COARSE))
    surface, spacing = simulation.surface, simulation.law.spacing
    normals, coupling = surface.mesh.normals(), surface.coupling
    assert not coupling.distances_to_cover(surface.points, normals, simulation.fields).any()
    for shift, sign in ((-0.8, 1.0), (1.8, -1.0)):
        moved = surface.points + shift * spacing * normals
        stray = coupling.distances_to_cover(moved, normals, simulation.fields)
        assert (sign * stray >= 0.0).all() and (stray != 0.0).mean() > 0.3
        depth = (
            np.linalg.norm(moved + stray[:, None] * normals, axis=1)
            - np.linalg.norm(np.array(simulation.fields[:3]), axis=0).max()
        )
        assert depth.min() > -spacing and depth.max() < 2.0 * spacing


def test_what_faces_the_wall_wets_it_and_a_film_is_not_yet_dry():
    points = np.array([[0.0, 0.0, 0.2], [1.0, 0.0, 0.2], [0.0, 1.0, 0.2]])
    up, down = np.array([[0, 1, 2]], np.int32), np.array([[0, 2, 1]], np.int32)
    assert have_reached_wall(points, down, 1.0).all() and not have_reached_wall(points, up, 1.0).any()
    assert have_reached_wall(points - [0.0, 0.0, 0.15], up, 1.0).all()


def test_sharp_bends_of_contact_lines_are_blunted_and_round_ones_stay():
    """A fan of twelve triangles has one spike on its circle."""
    angles = 2.0 * np.pi * np.arange(12) / 12
    points = np.concatenate(([[0.0, 0.0, 1.0]], np.stack((np.cos(angles), np.sin(angles), 0.0 * angles), axis=1)))
    ring = np.arange(1, 13, dtype=np.int32)
    triangles = np.stack((np.zeros(12, np.int32), ring, np.roll(ring, -1)), axis=1).astype(np.int32)
    round_one, _ = smooth_surface(points, triangles, (ring,), (ring,))
    assert np.linalg.norm(round_one[ring], axis=1) == pytest.approx(1.0, abs=1e-12)
    points[3] *= 2.0
    blunt, _ = smooth_surface(points, triangles, (ring,), (ring,))
    assert 1.2 < np.linalg.norm(blunt[3]) < 1.8


def test_a_notch_is_no_gap():
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    points = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.0], [0.1, 0.0, -0.5]])
    apart, joined = np.empty((0, 3), np.int32), np.array([[0, 2, 1]], np.int32)
    assert narrowest_gap(points, apart, normals, 0.5, 0.5) == pytest.approx(0.3)
    assert narrowest_gap(points, joined, normals, 0.5, 0.5) == np.inf


def test_a_dry_spot_smaller_than_a_particle_is_closed():
    """One triangle is missing in the middle of a triangulated plate on a wall."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    points = np.stack((x.ravel(), y.ravel(), np.full(25, 0.5)), axis=1)
    corner = np.array([i + 5 * j for j in range(4) for i in range(4)], np.int32)
    triangles = np.concatenate((corner[:, None] + [0, 1, 6], corner[:, None] + [0, 6, 5])).astype(np.int32)
    whole = boundary_loops(triangles)
    assert cover_dry_spots(points, triangles, whole, 1.0) is None
    torn = np.delete(triangles, 10, axis=0)
    closed = cover_dry_spots(points, torn, boundary_loops(torn), 1.0)
    assert closed is not None
    assert len(boundary_loops(closed[1])) == 1
    assert vertex_normals(*closed, len(closed[0]))[:, 2].min() > 0.5
    assert len(closed[0]) == 26 and len(closed[1]) == len(triangles) + 2
    assert cover_dry_spots(points, torn, boundary_loops(torn), 0.5) is None
