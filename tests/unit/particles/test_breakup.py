"""Break-up of liquids: contact lines that meet in a point, holes in films, parts too small for particles."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.sph.surface_coupling import find_near_vertices, find_weights
from reflowshock.particles.sph_flows.droplet import droplet
from reflowshock.particles.surface import remeshing
from reflowshock.particles.surface.breakup import are_outside, find_largest_part, find_small_parts, split_fans
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, area_within, boundary_loops
from reflowshock.particles.surface.morphological_closing import count_parts
from reflowshock.particles.surface.remeshing import FEWEST, GAPS
from reflowshock.particles.surface.surface_mesh import SurfaceLost

INK = {"diameter": 1.0, "density": 1.0, "surface_tension": 1.0, "viscosity": 0.2, "duration": 0.02}
COARSE = DropletNumerics(particles_per_diameter=8)
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def a_film(thickness):
    """Return a film on a wall with a thickness [spacings], and its particles."""
    flat = droplet(Droplet(**INK, numerics=COARSE, contact_angle=np.pi / 2.0))
    scale = thickness * flat.law.spacing / flat.surface.points[:, 2].max()
    for body in (flat.surface.points.T, flat.fields[:3]):
        for axis in range(3):
            body[axis][:] *= scale if axis == 2 else scale**-0.5
    return flat


def add_octahedron(surface, radius, x):
    """Add an octahedron about a point on the x axis."""
    octahedron = ConvexHull(np.concatenate((np.eye(3), -np.eye(3))))
    corners, faces = octahedron.points, octahedron.simplices.astype(np.int32)
    inward = np.linalg.det(corners[faces]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    surface.add(corners * radius + [x, 0.0, 0.0], faces)


def test_fans_of_triangles_that_share_a_vertex_part():
    bow_tie = np.array([[0, 1, 2], [0, 3, 4]], np.int32)
    with pytest.raises(CannotRebuild):
        boundary_loops(bow_tie)
    old, triangles = split_fans(bow_tie)
    assert np.array_equal(old[triangles], bow_tie)
    assert sorted(old.tolist()) == [0, 0, 1, 2, 3, 4]
    assert len(boundary_loops(triangles)) == 2
    whole, same = split_fans(TETRAHEDRON)
    assert np.array_equal(whole[same], TETRAHEDRON) and len(whole) == 4


def test_dry_spots_that_meet_in_a_point_become_one():
    """Two pairs of triangles are missing from a plate and share a vertex."""
    corner = np.array([i + 6 * j for j in range(5) for i in range(5)], np.int32)
    triangles = np.concatenate((corner[:, None] + [0, 1, 7], corner[:, None] + [0, 7, 6])).astype(np.int32)
    torn = np.delete(triangles, [6, 31, 12, 37], axis=0)
    with pytest.raises(CannotRebuild):
        boundary_loops(torn)
    old, parted = split_fans(torn)
    assert np.array_equal(old[parted], torn) and len(boundary_loops(parted)) == 2


def test_parts_that_are_too_small_are_found_and_the_largest_never_is_one():
    points = np.concatenate((CORNERS, 0.5 * CORNERS + 3.0))
    triangles = np.concatenate((TETRAHEDRON, TETRAHEDRON + 4))
    is_small, volume = find_small_parts(points, triangles, 1.0)
    assert np.array_equal(is_small, np.arange(8) >= 4) and volume == pytest.approx(1.0 / 48.0)
    assert not find_small_parts(points, triangles, 1e-3)[0].any()
    assert np.array_equal(find_largest_part(points, triangles), CORNERS)


def test_a_cavity_is_no_part_that_is_too_small():
    points = np.concatenate((CORNERS, 0.5 * CORNERS + 0.1))
    triangles = np.concatenate((TETRAHEDRON, TETRAHEDRON[:, ::-1] + 4))
    is_small, volume = find_small_parts(points, triangles, 1.0)
    assert not is_small.any() and volume == 0.0


def test_sheets_that_meet_in_an_edge_end_the_run_in_words():
    surface = droplet(Droplet(**INK, numerics=COARSE)).surface
    with pytest.raises(SurfaceLost, match="more than two sheets of the liquid's surface meet in an edge"):
        surface.mesh.replace(surface.points, np.array([[0, 1, 2], [1, 0, 3], [1, 0, 4]], np.int32))


def test_liquid_that_has_left_more_than_a_tenth_of_its_surface_ends_the_run():
    simulation = droplet(Droplet(**INK, numerics=COARSE))
    surface = simulation.surface
    add_octahedron(surface, 0.1, 3.0)
    count = len(surface.points)
    assert 6 < 0.1 * count < 24
    surface.add_to(simulation.rates, simulation.fields, simulation.fluids)
    for x in (4.0, 5.0, 6.0):
        add_octahedron(surface, 0.1, x)
    with pytest.raises(SurfaceLost, match=f"left its surface, {24 / (count + 18):.0%} of it"):
        surface.add_to(simulation.rates, simulation.fields, simulation.fluids)


def test_a_reason_to_make_the_surface_anew_that_failed_holds_up_no_other(monkeypatch):
    simulation, tried = droplet(Droplet(**INK, numerics=COARSE)), []
    surface = simulation.surface
    monkeypatch.setattr(remeshing, "rebuild_from_distance", lambda *arguments: tried.append(arguments[-1]))
    monkeypatch.setattr(remeshing, "is_worn", lambda *arguments: True)
    has_gap = False
    monkeypatch.setattr(remeshing, "has_narrow_gap", lambda mesh: has_gap)

    def remesh():
        surface.remeshing.remesh(surface.mesh, False, surface.capillarity.energy)

    for surface.remeshing.steps in range(10, 100, 10):
        remesh()
    assert tried == [GAPS["worn"]] * 3  # after 10, 30 and 70 steps
    has_gap = True
    remesh()
    assert tried[3:] == [GAPS["meets"]]
    again = droplet(Droplet(**INK, numerics=COARSE)).surface
    again.restore(surface.saved())
    assert again.remeshing.waits == surface.remeshing.waits == {"worn": (110, 4), "meets": (110, 2)}


def test_a_hole_opens_in_a_film_on_a_wall_and_its_volume_stays():
    simulation = a_film(0.8)
    surface, spacing = simulation.surface, simulation.law.spacing
    volume = surface.volume
    thin = np.linalg.norm(surface.points[:, :2], axis=1) < 6.0 * spacing
    surface.points[thin, 2] = 0.05 * spacing
    surface.remeshing.steps = 9
    surface.move(np.zeros((3, simulation.fluids)), 0.0, volume)
    areas = sorted(area_within(surface.points[ring]) for ring in surface.mesh.rings)
    assert len(areas) == 2 and areas[0] < -(spacing**2) and areas[1] > 10.0 * spacing**2
    assert surface.wetted_area == pytest.approx(sum(areas))
    assert surface.volume == pytest.approx(volume, rel=0.01)
    assert not surface.points[surface.mesh.rings[0], 2].any() and count_parts(surface.triangles) == 1
    assert np.isfinite(surface.forces()).all()


def test_a_part_smaller_than_its_particles_flies_on_without_a_surface():
    simulation = droplet(Droplet(**INK, numerics=COARSE))
    surface, spacing, volume = simulation.surface, simulation.law.spacing, simulation.surface.volume
    small = 0.25 * FEWEST * spacing**3  # an octahedron, 4 / 3 R^3
    add_octahedron(surface, np.cbrt(0.75 * small), 2.0)
    assert surface.volume == pytest.approx(volume + small)
    surface.remeshing.steps = 9
    surface.coupling.update(surface.mesh, simulation.fields[:3])
    surface.coupling.shares = np.zeros((2, len(surface.coupling.lists[1])))
    surface.move(np.zeros((3, simulation.fluids)), 0.0, volume + small)
    assert count_parts(surface.triangles) == 1 and surface.detachments == 1
    assert surface.spray == pytest.approx(small, rel=1e-3)
    assert surface.volume == pytest.approx(volume, rel=1e-3)
    assert not surface.topology_changes  # nothing merged
    liquid = np.append(simulation.fields[:3], [[2.0], [0.0], [0.0]], axis=1)
    surface.find_spray(liquid, np.full(simulation.fluids + 1, spacing**3))
    assert surface.spray == pytest.approx(spacing**3)


def test_what_is_outside_is_found_by_the_nearest_vertex():
    surface = droplet(Droplet(**INK, numerics=COARSE)).surface
    places = np.array([[0.0, 0.0, 0.0], [0.45, 0.0, 0.0], [0.0, 0.55, 0.0], [0.0, 0.0, -0.7], [3.0, 0.0, 0.0]])
    outside = are_outside(places, surface.points, surface.triangles, surface.mesh.normals(), 0.1)
    assert outside.tolist() == [False, False, False, True, True]


def test_a_vertex_without_particles_follows_the_nearest_one():
    simulation = droplet(Droplet(**INK, numerics=COARSE))
    particles = np.ascontiguousarray(np.array(simulation.fields[:3]).T)
    vertices = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 3.0], [3.0, 0.0, 0.0]])
    lists = find_near_vertices(vertices, particles, 0.3)
    weights = np.empty((2, 2, len(lists[1])))
    levels = find_weights(vertices, lists, simulation.fields, simulation.law, weights)
    assert levels[0] > 0.0 and not levels[1:].any()
    assert lists[0][2] - lists[0][1] == lists[0][3] - lists[0][2] == 1
    nearest = lists[1][lists[0][1] : lists[0][3]]
    assert (particles[nearest] == [particles[particles[:, 2].argmax()], particles[particles[:, 0].argmax()]]).any()
    assert weights[0, :, : lists[0][1]].sum(axis=1)[0] == pytest.approx(1.0)
    assert (weights[0, :, lists[0][1] :] == 1.0).all()
