"""Forces of the surface across it only, for walls with friction.

A uniform tension pulls a surface along its normals, and its contact line across it. The gradient of the energy of
triangles has a part along the surface, too: it moves vertices back from where evening out has taken them. Evening out
feels no friction, the way back does: where triangles are not symmetric a drop crawled along its wall at 1e-3 spacings
a step for ever. Without friction its momentum forbids that, and forces are left the gradient of an energy.

Liquid that is stretched fast needs that part: without it triangles collapse when a cube of 11 an edge spreads to 60
degrees. As much of it is kept as the liquid strains within a period of the grid's waves, none at rest.

The net force stays what it was, zero: that of the part along the surface acts across it, like a pressure; its moment
acts as a swirl.
"""

from dataclasses import replace

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.rigid_motions import admitted_motions, rigid_momenta, rigid_motions
from reflowshock.particles.physics.physics import Physics

# Strain in the time of the grid's capillary waves, one over their frequency, at which all of the part along is kept.
FAST = 0.1


def has_friction(physics: Physics) -> bool:
    """Whether walls resist liquid that slides on them."""
    return bool(physics.frictions or physics.holds)


def tangential_share(gradient: Floats, frequency: float) -> float:
    """Share of the part along the surface that is kept.

    Args:
        gradient: of the velocity, `(n, 3, 3)` [1/s].
        frequency: of the grid's capillary waves [1/s].
    """
    if not frequency:  # without tension there is no such part
        return 1.0
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1)) / frequency
    return min(1.0, float(np.sqrt((strain**2).sum(axis=(1, 2)).mean())) / FAST)


def normal_pull(body: Body, physics: Physics, masses: Floats, kept: float = 0.0) -> Floats:
    """Forces of the surface and its walls `(n, 3)` [N], the part along it taken out but for a share.

    Net force and moment are those of the whole forces, along the rigid motions that the walls would admit without
    friction.

    Args:
        body: the liquid body.
        physics: what acts on it.
        masses: of the particles, `(n,)` [kg].
        kept: share of the part along the surface.
    """
    force = physics.force(body)
    slope = physics.admit(body, body.volume()[1])
    normal = slope / np.maximum(np.linalg.norm(slope, axis=1), np.finfo(float).tiny)[:, None]
    along = physics.admit(body, force)
    along = (1.0 - kept) * (along - (along * normal).sum(axis=1)[:, None] * normal)
    unheld = replace(physics, lines=(), holds=()).projections(body)
    shifts, turns = np.split(admitted_motions(body.points, unheld), 2)
    centre = masses @ body.points / masses.sum()
    motions = rigid_motions(body.points - centre)
    across = np.einsum("kid,id->ki", motions[:3][shifts], normal)[..., None] * slope
    along -= _with_net(along, motions[:3][shifts], across)
    swirls = motions[3:][turns]
    along -= _with_net(along, swirls, masses[:, None] * swirls)
    return force - along


def _with_net(force: Floats, motions: Floats, fields: Floats) -> Floats:
    """The sum of k force fields `(k, n, 3)` that has the power of a force `(n, 3)` in k rigid motions `(k, n, 3)`."""
    unit = np.ones(len(force))
    powers = np.array([rigid_momenta(motions, unit, field) for field in fields]).T
    shares = np.linalg.solve(powers, rigid_momenta(motions, unit, force)) if len(fields) else np.zeros(0)
    return np.tensordot(shares, fields, axes=1)
