"""Incompressibility of each particle below the surface by moving least squares, and of the body by one global row.

For motion that relaxes towards rest: its transpose scatters the surface force into grid noise, which inertia keeps.
"""

import numpy as np
from scipy import sparse

from particles.body import Body
from particles.discretisation import Discretisation
from particles.mls import derivatives
from particles.neighbours import NeighbourList


def particle_discretisation(body: Body, neighbours: NeighbourList, basis: str) -> Discretisation:
    """Fit the stencils at the current positions.

    Args:
        body: the liquid body.
        neighbours: a valid list with the support radius of the basis.
        basis: "linear" or "quadratic".

    Raises:
        DegenerateStencil: the divergence of a particle cannot be fitted.
    """
    gradient = derivatives(body.points, body.interior, neighbours, basis).gradient
    weights = body.volumes[body.interior]
    divergence = sparse.hstack([sparse.diags(weights) @ component for component in gradient])
    volume, slope = body.volume()
    whole = sparse.csr_matrix(slope.T.ravel())
    return Discretisation(
        gradient=gradient,
        weights=weights,
        mass=sparse.diags(body.volumes, format="csr"),
        constraint=sparse.vstack((divergence, whole), format="csr"),
        volume_share=np.append(weights / volume, 1.0),
    )
