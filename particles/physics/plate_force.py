"""Force and moment of the solder on a plate, by virtual work."""

from collections.abc import Sequence

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.physics.physics import Force


def plate_wrench(body: Body, others: Sequence[Force], wall: int) -> Floats:
    """Force `(3,)` [N] and moment about the plate's origin `(3,)` [N m] of the solder on a plate, `(6,)`.

    A plate that moves takes its contact line along, and the energy E - p V changes by the forces on the line: the
    pull of the free surface, and the pressure on the wetted area and on the line's share of the free surface.

    Args:
        body: a body at rest.
        others: forces on the surface but wetting (the wetted area does not change).
        wall: index of the plate.
    """
    ring = body.cloud.rings[wall]
    pressure = body.surface_pressure * body.volume()[1]
    load = sum((force.force(body) for force in others), pressure)[ring]
    lever = body.points[ring] - body.plates[wall].origin
    return np.concatenate((load.sum(axis=0), np.cross(lever, load).sum(axis=0)))
