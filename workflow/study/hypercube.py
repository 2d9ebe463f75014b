"""Latin hypercubes that grow: twice as many samples keep the earlier ones."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Hypercube:
    """A random Latin hypercube: in each dimension one sample in each of as many equal parts of the unit interval.

    It is grown from the odd factor of its size by doubling: of the halves of each part one has a sample already, the
    new samples take the others, in random order. So 2 n samples begin with the same n; any other size begins anew.
    """

    samples: int
    seed: int

    def shares(self, dimensions: int) -> np.ndarray:
        """Return the samples (samples, dimensions), each in [0, 1)."""
        from scipy.stats import qmc

        size = self.samples // (self.samples & -self.samples)
        found = qmc.LatinHypercube(dimensions, seed=np.random.default_rng((self.seed, size))).random(size)
        while size < self.samples:
            random = np.random.default_rng((self.seed, 2 * size))
            free = [np.setdiff1d(np.arange(2 * size), (2 * size * column).astype(int)) for column in found.T]
            parts = np.stack([random.permutation(column) for column in free], axis=1)
            found = np.concatenate([found, (parts + random.random((size, dimensions))) / (2 * size)])
            size *= 2
        return found
