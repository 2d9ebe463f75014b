"""Square lattice of particles in a plane."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats


def lattice(columns: NDArray[np.integer], rows: NDArray[np.integer], spacing: float) -> Floats:
    """Return the points of a square lattice in the plane y = 0, shape (3, n) [m].

    Args:
        columns: Indices along x, shape (c,); index i gives x = (i + 1/2) spacing.
        rows: Indices along z, shape (r,), which vary fastest in the result.
        spacing: Distance between neighbouring points [m].
    """
    x, z = np.meshgrid(columns + 0.5, rows + 0.5, indexing="ij")
    return spacing * np.stack((x.ravel(), np.zeros(x.size), z.ravel()))
