"""Rigid motions of a body, and its momenta along them: what walls admit of them must not change without a force."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Pad, Plate
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.physics import Physics

# Of the largest velocity of a rigid motion: more than this across a wall is none that it admits.
ROUNDING = 1e-9
TURN = 5  # about the z axis, of the rigid motions


def admitted_motions(points: Floats, projections: Floats) -> NDArray[np.bool_]:
    """Which rigid motions of points `(n, 3)` [m] walls admit, `(6,)`, by the projections of velocities `(n, 3, 3)`."""
    motions = rigid_motions(points)
    changes = [np.abs(projected(projections, motion) - motion).max() for motion in motions]
    return np.array(changes) <= ROUNDING * np.abs(motions).max(axis=(1, 2))


def edges_are_coaxial(body: Body, physics: Physics) -> bool:
    """Whether edges hold vertices that are circles about the z axis, about which they have no moment.

    A vertex that an edge holds does not slide along it, either. What momentum that gives the body about the axis is
    none that it has when the edges let it go.
    """
    unheld = admitted_motions(body.points, replace(physics, lines=()).projections(body))[TURN]
    return bool(unheld and all(_about_axis(line.pads, body.plates[line.wall]) for line in physics.lines))


def _about_axis(pads: Sequence[Pad], plate: Plate) -> bool:
    """Whether a plate has one pad with an edge, a circle about the z axis."""
    centres = plate.place(np.array([[*pad.centre, 0.0] for pad in pads]))[:, :2]
    reach = max(pad.radius for pad in pads)
    return len(pads) == 1 and bool(np.isfinite(reach)) and np.abs(centres).max() <= ROUNDING * reach


def rigid_motions(points: Floats) -> Floats:
    """Translations along and rotations about the axes through the origin at points `(n, 3)` [m], `(6, n, 3)`."""
    motions = np.zeros((6, *points.shape))
    for axis in range(3):
        motions[axis, :, axis] = 1.0
        motions[3 + axis, :, axis - 2], motions[3 + axis, :, axis - 1] = -points[:, axis - 1], points[:, axis - 2]
    return motions


def wall_velocities(body: Body, twists: Mapping[int, Floats]) -> Floats:
    """Velocities of plates at the particles on them `(n, 3)` [m/s], zero elsewhere; twists `(6,)` by the plate."""
    field = np.zeros_like(body.points)
    for wall, twist in twists.items():
        on_plate = body.cloud.wall == wall
        field[on_plate] = body.plates[wall].rigid_velocity(twist, body.points[on_plate])
    return field


def held(projections: Floats, field: Floats) -> Floats:
    """The part of a field `(n, 3)` that walls do not admit, by their projections `(n, 3, 3)`."""
    return field - projected(projections, field)


def rigid_momenta(motions: Floats, masses: Floats, velocity: Floats) -> Floats:
    """Momenta `(k,)` of a velocity `(n, 3)` [m/s] along rigid motions `(k, n, 3)`; masses `(n,)` [kg]."""
    return motions.reshape(len(motions), velocity.size) @ (masses[:, None] * velocity).ravel()


def orthonormal(motions: Floats, masses: Floats) -> Floats:
    """A basis of rigid motions `(k, n, 3)`, orthonormal by the masses `(n,)` [kg]."""
    flat = motions.reshape(len(motions), 3 * len(masses))
    basis = np.linalg.inv(np.linalg.cholesky(flat @ (np.repeat(masses, 3) * flat).T)) @ flat
    return basis.reshape(motions.shape)


def rigid_part(basis: Floats, masses: Floats, velocity: Floats) -> Floats:
    """The part of a velocity `(n, 3)` [m/s] that is a sum of rigid motions, a basis as `orthonormal` gives it."""
    return np.tensordot(rigid_momenta(basis, masses, velocity), basis, axes=1)


def with_momenta(motions: Floats, masses: Floats, basis: Floats, velocity: Floats, momenta: Floats) -> Floats:
    """A velocity `(n, 3)` [m/s] with momenta `(k,)` along k rigid motions, corrected by a basis of as many others."""
    moved = np.array([rigid_momenta(motions, masses, motion) for motion in basis]).T  # by columns
    missing = momenta - rigid_momenta(motions, masses, velocity)
    return velocity + np.tensordot(np.linalg.solve(moved, missing), basis, axes=1)
