"""Half and quarter bodies between planes of symmetry have the measures of the whole body."""

from math import inf

import numpy as np
import pytest

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.core.symmetry import cut, on_plane, share, whole_points
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.scenes.flow_setup import build_physics, contact_line, start_flow

SOLDER = Solder(volume=1e-9, pad_contact_angle=np.radians(60.0), numerics=SolderNumerics(spacing=1e-4))
ON = {"surface_tension": True, "gravity": True, "wall_adhesion": True, "viscosity": False, "inertia": False}
AXES = [(0,), (0, 1)]


def drop(axes=(), pad_radius=inf) -> tuple[Body, Physics]:
    """Return a cube deformed by the same smooth map, whole or cut."""
    cloud = cut(box_cloud(1e-3, 5), axes)
    physics = build_physics(SOLDER, ON, (contact_line(cloud, 0, pad_radius, SOLDER),))
    body = Body.at_rest(cloud)
    x, y, z = (body.points / 1e-3).T
    body.points[:, :2] *= (1.0 + 0.3 * z + 0.1 * x**2 * y**2)[:, None]
    body.points[:, 2] *= 1.0 - 0.2 * (x**2 + y**2)
    return body, physics


def in_whole(part, whole):
    """Return the index in the whole body of each particle of the part."""
    distance = np.linalg.norm(whole.cloud.points[None] - part.cloud.points[:, None], axis=2)
    assert distance.min(axis=1).max() < 1e-15
    return distance.argmin(axis=1)


@pytest.mark.parametrize("axes", AXES)
def test_volume_energy_and_particles_are_a_part_of_the_whole(axes):
    (whole, full), (part, physics) = drop(), drop(axes)
    parts = part.cloud.parts
    assert parts == 2 ** len(axes)
    assert parts * part.volume()[0] == pytest.approx(whole.volume()[0])
    assert parts * physics.energy(part) == pytest.approx(full.energy(whole), rel=2e-2)  # the cube's diagonals differ
    assert parts * part.volumes.sum() == pytest.approx(whole.volumes.sum())
    assert parts * share(part.cloud).sum() == pytest.approx(len(whole.points))
    assert part.volumes == pytest.approx(whole.volumes[in_whole(part, whole)] * share(part.cloud))


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("pad_radius", [inf, 0.45e-3])
def test_forces_are_minus_the_gradient_of_the_energy_along_the_planes(axes, pad_radius):
    body, physics = drop(axes, pad_radius)
    line = physics.lines[0]
    line.state[:] = 1 if pad_radius == inf else 2
    rng = np.random.default_rng(3)
    field = 1e-7 * physics.admit(body, rng.normal(size=body.points.shape))
    for axis in axes:
        assert np.all(field[on_plane(body.cloud, axis), axis] == 0.0)
    energies = []
    for sign in (1.0, -1.0):
        moved = Body.at_rest(body.cloud)
        moved.points = body.points + sign * field
        energies.append(physics.energy(moved))
    work = float((physics.force(body) * field).sum())
    assert work == pytest.approx(0.5 * (energies[1] - energies[0]), rel=1e-5)


@pytest.mark.parametrize("axes", AXES)
def test_a_contact_line_closes_around_the_whole_body(axes):
    (whole, full), (part, physics) = drop(), drop(axes)
    around, _ = whole_points(part.cloud, part.points, 0)
    ring = whole.points[whole.cloud.rings[0]]
    assert len(around) == len(ring)
    first = int(np.linalg.norm(ring - around[0], axis=1).argmin())
    assert around == pytest.approx(np.roll(ring, -first, axis=0), abs=1e-15)
    assert physics.lines[0].cosine_area(part) * part.cloud.parts == pytest.approx(full.lines[0].cosine_area(whole))


@pytest.mark.parametrize("axes", AXES)
def test_particles_stay_on_their_plane_and_before_it(axes):
    cloud = cut(box_cloud(1e-3, 5), axes)
    flow = start_flow(cloud, SOLDER, ON, (contact_line(cloud, 0, inf, SOLDER),))
    for _ in range(10):
        flow.step()
    for axis in axes:
        coordinate = flow.body.points[:, axis]
        assert np.all((coordinate == 0.0) == on_plane(cloud, axis))
        assert coordinate.min() == 0.0
    assert cloud.parts * flow.body.volume()[0] == pytest.approx(1e-9)
