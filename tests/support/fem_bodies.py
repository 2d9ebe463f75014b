"""Stiffness of models on one rank from meshes in memory."""

import numpy as np

from reflowshock.fem.model.body import Body
from reflowshock.materials.parameters import Isotropic

STEEL = Isotropic(density=8000.0, young_modulus=200e9, poisson_ratio=0.0)


def dense_stiffness(body: Body) -> np.ndarray:
    """Return the stiffness of a body as a dense matrix, shape (3 n, 3 n) [N/m], ordered by node.

    Each column is a force of the body's own force terms at a unit displacement, with its tie.
    """
    count = len(body.mass)
    columns = np.empty((3 * count, 3 * count))
    for k in range(3 * count):
        displacement, force = np.zeros((count, 3)), np.zeros((count, 3))
        displacement.flat[k] = 1.0
        body.tie.spread(displacement)
        for term in body.terms:
            term.add(displacement, force)
        body.tie.gather(force)
        columns[:, k] = -force.ravel()
    return columns
