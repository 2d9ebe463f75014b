"""Merging drops in delta-SPH: surface gaps, gap-free level set and merged drops."""

import numba
import numpy as np
import pytest

from reflowshock.particles.core.grid import Grid
from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph_flows.droplet import droplet
from reflowshock.particles.surface.level_set import LevelSet, extract_surface
from reflowshock.particles.surface.morphological_closing import (
    TopologyChange,
    close_gaps,
    count_parts,
    narrowest_gap,
    part_of_vertex,
)
from reflowshock.particles.surface.remeshing import EDGE

INK = {"diameter": 1.0, "density": 1.0, "surface_tension": 1.0, "duration": 1.0, "gravity": 0.0}


def two_drops(viscosity=0.5, **changes):
    """Return two drops that collide along x or land next to each other on a wall."""
    numerics = DropletNumerics(particles_per_diameter=8)
    scene = Droplet(**INK | {"viscosity": viscosity, "numerics": numerics} | changes)
    drop = droplet(scene)
    points, aside = np.array(drop.fields[:3]), np.array([0.5 + 0.5 * EDGE * drop.law.spacing, 0.0, 0.0])
    both = np.concatenate((points - aside[:, None], points + aside[:, None]), axis=1)
    fields = flow.make_fields(both, np.empty((3, 0)), np.zeros(both.shape[1]), drop.law)
    fields.u[:] = 0.3 * np.sign(-both[0])
    fields.w[:] = -scene.impact_speed
    surface = drop.surface
    corners, triangles = surface.points.copy(), surface.triangles.copy()
    surface.mesh.points = corners - aside
    surface.add(corners + aside, triangles)
    return Simulation(fields, both.shape[1], drop.law, surface), 2.0 * scene.volume


def go(simulation, until):
    """Run a simulation to a time, in place, and return it."""
    while simulation.time < until:
        simulation.step(simulation.time_step())
    return simulation


def test_a_gap_between_faces_is_found_and_a_film_is_not():
    normals, none = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), np.empty((0, 3), np.int32)
    points = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.0]])
    assert narrowest_gap(points, none, normals, 0.5, 0.5) == pytest.approx(0.3)
    assert narrowest_gap(points, none, normals, 0.2, 0.5) == np.inf
    assert narrowest_gap(points, none, normals, 0.5, 0.05) == np.inf
    assert narrowest_gap(points, none, -normals, 0.5, 0.5) == np.inf  # liquid is between them
    assert narrowest_gap(points, none, np.abs(normals), 0.5, 0.5) == np.inf


def test_narrow_gaps_close_and_wide_ones_stay():
    for distance, parts in ((2.1, 1), (2.6, 2)):
        grid = Grid.around(np.array([[-2.5, -1.0, -1.0], [2.5, 1.0, 1.0]]), 0.15)
        x, y, z = np.meshgrid(*grid.axes(), indexing="ij")
        values = np.hypot(np.hypot(np.abs(x) - 0.5 * distance, y), z) - 1.0
        points, triangles = extract_surface(close_gaps(LevelSet(grid, values), 0.3))
        assert count_parts(triangles) == parts
        assert len(np.unique(part_of_vertex(triangles, len(points)))) == parts
        far = points[np.abs(points[:, 0]) > 0.5 * distance]
        off = np.hypot(np.hypot(np.abs(far[:, 0]) - 0.5 * distance, far[:, 1]), far[:, 2]) - 1.0
        assert np.abs(off).max() < 0.1 * 0.15


def test_drops_that_meet_become_one_and_keep_volume_and_momentum():
    simulation, volume = two_drops()
    surface = simulation.surface
    assert count_parts(surface.triangles) == 2
    before = surface.energy
    go(simulation, 0.1)
    (meeting,) = surface.topology_changes
    assert (meeting.before, meeting.after) == (2, 1)
    assert -0.05 * before < meeting.energy < 0.0
    assert surface.volume == pytest.approx(volume, rel=0.005)
    fields = simulation.fields
    speeds = np.array(fields[3:6])
    assert np.abs(speeds @ fields.mass).max() < 1e-12 * (np.abs(speeds) @ fields.mass).max()


@pytest.mark.long
def test_drops_that_have_merged_end_with_the_pressure_of_one_sphere():
    simulation, volume = two_drops()
    points = go(simulation, 4.0).surface.points
    radius = np.cbrt(0.75 * volume / np.pi)
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    assert distance.mean() == pytest.approx(radius, rel=0.01)
    assert simulation.pressures.mean() == pytest.approx(2.0 / radius, rel=0.02)
    assert np.std(distance) < 0.03 * radius  # a dimple remains at the contact


def test_neighbouring_drops_on_a_wall_merge():
    simulation, volume = two_drops(viscosity=0.2, speed=1.0, contact_angle=np.pi / 3.0)
    surface = go(simulation, 0.3).surface
    assert any((meeting.before, meeting.after) == (2, 1) for meeting in surface.topology_changes)
    assert len(surface.mesh.rings) == 1
    assert surface.volume == pytest.approx(volume, rel=0.01)


@pytest.mark.long
def test_threads_and_a_restart_change_no_merging(every_thread):
    results = []
    for threads in (1, every_thread):
        numba.set_num_threads(threads)
        simulation, _ = two_drops()
        go(simulation, 0.08)
        results.append(np.concatenate((np.array(simulation.fields[:8]).ravel(), simulation.surface.points.ravel())))
    simulation, _ = two_drops()
    saved = go(simulation, 0.05).saved()
    again, _ = two_drops()
    again.restore(saved)
    go(again, 0.08)
    assert again.surface.topology_changes and isinstance(again.surface.topology_changes[0], TopologyChange)
    results.append(np.concatenate((np.array(again.fields[:8]).ravel(), again.surface.points.ravel())))
    assert np.array_equal(results[0], results[1]) and np.array_equal(results[0], results[2])
