"""Normal forces of the surface, for walls with friction.

Uniform tension pulls a surface along its normals and its contact line across it. The energy gradient of a triangulated
surface also has a tangential part, which reverses the displacements of mesh smoothing. Wall friction acts on this
reverse motion but not on mesh smoothing, so that with asymmetric triangles a drop creeps along its wall at 1e-3
spacings per step. Without friction, conservation of momentum forbids this, and the forces stay an energy gradient.

Fast stretching needs the tangential part: without it triangles collapse when a cube of 11 particles per edge spreads to
60 degrees. Its share grows with the strain of the liquid within a period of the grid's waves and vanishes at rest.

The net force and moment are unchanged: a pressure-like normal force and a swirl compensate the removed part.
"""

from dataclasses import replace

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.rigid_motions import admitted_motions, rigid_momenta, rigid_motions
from reflowshock.particles.physics.physics import Physics

# Strain within the inverse frequency of the grid's capillary waves from which the whole tangential part acts.
FAST = 0.1


def has_friction(physics: Physics) -> bool:
    """Return whether walls resist liquid that slides on them (Navier slip or no slip).

    Args:
        physics: Effects that act on a body, of which the frictions and constraints at plates are examined.
    """
    return bool(physics.frictions or physics.holds)


def tangential_share(gradient: Floats, frequency: float) -> float:
    """Return the share of the tangential surface force that acts, 0 to 1; it grows with the rate of deformation.

    Args:
        gradient: Velocity gradient, shape (n, 3, 3) [1/s].
        frequency: Frequency of the grid's capillary waves [1/s]; 0 without surface tension, which gives 1.
    """
    if not frequency:  # no tension, no tangential part
        return 1.0
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1)) / frequency
    return min(1.0, float(np.sqrt((strain**2).sum(axis=(1, 2)).mean())) / FAST)


def normal_surface_force(body: Body, physics: Physics, masses: Floats, share: float = 0.0) -> Floats:
    """Return the forces of the surface and its walls with a reduced tangential part, shape (n, 3) [N].

    The surface tension of a discrete surface has a spurious tangential part. Net force and moment are unchanged along
    the rigid-body motions that frictionless walls would admit.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        physics: Effects that act on the body: forces, friction, contact lines and motions of plates.
        masses: Particle masses, shape (n,) [kg].
        share: Share of the tangential part that acts, 0 to 1.
    """
    force = physics.force(body)
    slope = physics.admit(body, body.volume()[1])
    normal = slope / np.maximum(np.linalg.norm(slope, axis=1), np.finfo(float).tiny)[:, None]
    tangential = physics.admit(body, force)
    tangential = (1.0 - share) * (tangential - (tangential * normal).sum(axis=1)[:, None] * normal)
    frictionless = replace(physics, lines=(), holds=()).projections(body)
    shifts, turns = np.split(admitted_motions(body.points, frictionless), 2)
    centre = masses @ body.points / masses.sum()
    motions = rigid_motions(body.points - centre)
    normal_forces = np.einsum("kid,id->ki", motions[:3][shifts], normal)[..., None] * slope
    tangential -= _with_same_power(tangential, motions[:3][shifts], normal_forces)
    swirls = motions[3:][turns]
    tangential -= _with_same_power(tangential, swirls, masses[:, None] * swirls)
    return force - tangential


def _with_same_power(force: Floats, motions: Floats, fields: Floats) -> Floats:
    """Return the combination of k force fields (k, n, 3) that has the power of a force in k motions (k, n, 3)."""
    unit = np.ones(len(force))
    powers = np.array([rigid_momenta(motions, unit, field) for field in fields]).T
    shares = np.linalg.solve(powers, rigid_momenta(motions, unit, force)) if len(fields) else np.zeros(0)
    return np.tensordot(shares, fields, axes=1)
