"""Follower pressure: normal direction, equilibrium on closed surfaces and exact balance of its work."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.loads.follower_pressure import FollowerPressure
from reflowshock.fem.loads.load import NodalForces
from reflowshock.fem.loads.pulse import Constant
from reflowshock.fem.mesh.facet_areas import outward_areas, outward_facets
from reflowshock.fem.mesh.mesh import MeshData
from tests.support.fem_bodies import STEEL

PRESSURE = 1e6
SIDES = {f"{'xyz'[axis]}_{end}": on(axis, level) for axis in range(3) for end, level in (("min", 0.0), ("max", 1e-3))}


def cube() -> MeshData:
    """Return the mesh of a cube of 1 mm with facet sets on its sides."""
    ticks = np.linspace(0.0, 1e-3, 3)
    points, cells = grid(ticks, ticks, ticks)
    return mesh_of(points, cells, "board", SIDES)


def pressed(names) -> tuple[MeshData, ExplicitMotion, list[FollowerPressure]]:
    """Return mesh, motion and loads of a cube under pressure on some facet sets."""
    mesh = cube()
    body, critical = dns_body(mesh, STEEL)
    loads = [FollowerPressure.build(body, outward_facets(mesh, name), Constant(PRESSURE)) for name in names]
    return mesh, motion_of(body, 0.5 * critical, loads), loads


def force_of(load, motion: ExplicitMotion) -> np.ndarray:
    """Return the force that a load adds to a motion, shape (n, 3) [N]."""
    before = motion.force.copy()
    load.add(motion)
    return motion.force - before


def test_pressure_rotates_with_the_body():
    mesh, motion, (load,) = pressed(["x_max"])
    nodes, areas = outward_areas(mesh, "x_max")
    dead = force_of(NodalForces.build(motion.body, nodes, -areas, Constant(PRESSURE)), motion)
    angle = 1.1
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    points = motion.body.local.points
    motion.displacement[:] = points @ turn.T - points
    assert np.abs(force_of(load, motion) - dead @ turn.T).max() < 1e-12 * np.abs(dead).max()


def test_closed_surface_of_any_shape_is_in_equilibrium():
    _, motion, loads = pressed(SIDES)
    motion.displacement[:] = np.random.default_rng(4).uniform(-1e-4, 1e-4, motion.displacement.shape)
    force = sum(force_of(load, motion) for load in loads)
    position = motion.body.local.points + motion.displacement
    scale = PRESSURE * 1e-6
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    assert np.abs(np.cross(position, force).sum(axis=0)).max() < 1e-12 * scale * 1e-3


def test_work_of_the_pressure_equals_the_kinetic_energy():
    _, motion, _ = pressed(["x_max"])
    motion.velocity += np.cross([0.0, 0.0, 1e4], motion.body.local.points)
    start = motion.kinetic_energy() + motion.internal_energy().total
    for _ in range(200):
        motion.advance()
        motion.update_force()
    total = motion.kinetic_energy() + motion.internal_energy().total
    assert motion.external_work == pytest.approx(total - start, rel=1e-9)
