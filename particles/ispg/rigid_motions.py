"""Rigid-body motions of a body and its momenta; those that walls admit change only by forces."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Pad, Plate
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.physics import Physics

# A wall admits a rigid-body motion whose velocity across it is at most this share of its largest velocity.
ROUNDING = 1e-9
TURN = 5  # index of the rotation about the z axis


def admitted_motions(points: Floats, projections: Floats) -> NDArray[np.bool_]:
    """Return whether walls admit each rigid-body motion, translations along x, y, z, then rotations, shape (6,).

    Args:
        points: Particle positions, shape (n, 3) [m].
        projections: Projections onto the velocities that walls admit, shape (n, 3, 3).
    """
    motions = rigid_motions(points)
    changes = [np.abs(projected(projections, motion) - motion).max() for motion in motions]
    return np.array(changes) <= ROUNDING * np.abs(motions).max(axis=(1, 2))


def edges_are_coaxial(body: Body, physics: Physics) -> bool:
    """Return whether walls admit rotation about the z axis and all pad edges are circles about it.

    Such edges exert no moment about the axis.

    A vertex pinned at an edge does not slide along it either. The spurious angular momentum that this gives the body
    must vanish when the edges release it.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        physics: Effects that act on the body: forces, friction, contact lines and motions of plates.
    """
    unpinned = admitted_motions(body.points, replace(physics, lines=()).projections(body))[TURN]
    return bool(unpinned and all(_about_axis(line.pads, body.plates[line.wall]) for line in physics.lines))


def _about_axis(pads: Sequence[Pad], plate: Plate) -> bool:
    """Return whether a plate has a single circular pad about the z axis."""
    centres = plate.place(np.array([[*pad.centre, 0.0] for pad in pads]))[:, :2]
    reach = max(pad.radius for pad in pads)
    return len(pads) == 1 and bool(np.isfinite(reach)) and np.abs(centres).max() <= ROUNDING * reach


def rigid_motions(points: Floats) -> Floats:
    """Return the velocity fields of unit translations along x, y, z and of unit rotations about these axes.

    Args:
        points: Particle positions, shape (n, 3) [m].

    Returns:
        Velocities of the particles, three translations first [1], then three rotations [m], shape (6, n, 3).
    """
    motions = np.zeros((6, *points.shape))
    for axis in range(3):
        motions[axis, :, axis] = 1.0
        motions[3 + axis, :, axis - 2], motions[3 + axis, :, axis - 1] = -points[:, axis - 1], points[:, axis - 2]
    return motions


def wall_velocities(body: Body, twists: Mapping[int, Floats]) -> Floats:
    """Return the velocity of the plates at the particles on them, zero elsewhere.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        twists: Twist of each moving plate by its index, shape (6,) [m/s, rad/s].

    Returns:
        Velocity, shape (n, 3) [m/s].
    """
    field = np.zeros_like(body.points)
    for wall, twist in twists.items():
        on_plate = body.cloud.wall == wall
        field[on_plate] = body.plates[wall].rigid_velocity(twist, body.points[on_plate])
    return field


def constrained_part(projections: Floats, field: Floats) -> Floats:
    """Return the part of a velocity field that the walls do not admit, shape (n, 3) [m/s].

    Args:
        projections: Projections onto the velocities that walls admit, shape (n, 3, 3).
        field: Velocity field, shape (n, 3) [m/s].
    """
    return field - projected(projections, field)


def rigid_momenta(motions: Floats, masses: Floats, velocity: Floats) -> Floats:
    """Return the momenta of a velocity field along rigid-body motions.

    Args:
        motions: Velocity fields of k rigid-body motions, shape (k, n, 3).
        masses: Particle masses, shape (n,) [kg].
        velocity: Velocity, shape (n, 3) [m/s].

    Returns:
        Momenta, shape (k,): [kg m/s] for translations, [kg m^2/s] for rotations.
    """
    return motions.reshape(len(motions), velocity.size) @ (masses[:, None] * velocity).ravel()


def orthonormalise(motions: Floats, masses: Floats) -> Floats:
    """Return a basis of rigid-body motions that is orthonormal by mass, shape (k, n, 3) [1/sqrt(kg)].

    The product of two fields is the sum of m u . v over the particles.

    Args:
        motions: Velocity fields of k independent rigid-body motions, shape (k, n, 3).
        masses: Particle masses, shape (n,) [kg].
    """
    flat = motions.reshape(len(motions), 3 * len(masses))
    basis = np.linalg.inv(np.linalg.cholesky(flat @ (np.repeat(masses, 3) * flat).T)) @ flat
    return basis.reshape(motions.shape)


def rigid_part(basis: Floats, masses: Floats, velocity: Floats) -> Floats:
    """Return the rigid-body part of a velocity field, its mass-weighted projection onto a basis, shape (n, 3) [m/s].

    Args:
        basis: Mass-orthonormal rigid-body motions, shape (k, n, 3) [1/sqrt(kg)].
        masses: Particle masses, shape (n,) [kg].
        velocity: Velocity, shape (n, 3) [m/s].
    """
    return np.tensordot(rigid_momenta(basis, masses, velocity), basis, axes=1)


def with_momenta(motions: Floats, masses: Floats, basis: Floats, velocity: Floats, momenta: Floats) -> Floats:
    """Return a velocity field, shape (n, 3) [m/s], to which rigid-body motions are added so that it has given momenta.

    Args:
        motions: Rigid-body motions along which the momenta are prescribed, shape (k, n, 3).
        masses: Particle masses, shape (n,) [kg].
        basis: Rigid-body motions whose combination is added, shape (k, n, 3).
        velocity: Velocity before the correction, shape (n, 3) [m/s].
        momenta: Required sums over the particles of mass times motion times velocity, shape (k,): [kg m/s] for
            translations, [kg m^2/s] for rotations.
    """
    moved = np.array([rigid_momenta(motions, masses, motion) for motion in basis]).T  # by columns
    missing = momenta - rigid_momenta(motions, masses, velocity)
    return velocity + np.tensordot(np.linalg.solve(moved, missing), basis, axes=1)
