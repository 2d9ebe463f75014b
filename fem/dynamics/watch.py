"""What is watched during a run: the contract between histories and watch points."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.motion import Motion


class Watch(Protocol):
    """Watch points of one rank: parts of sums and maxima that the ranks of all models combine.

    Attributes:
        labels: Name -> what belongs to a history but does not change with time.
    """

    labels: dict[str, NDArray]

    def sample(self, motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return this rank's parts of the sums and of the maxima, of equal lengths in all models of a run."""

    def row(self, sums: NDArray[np.float64], maxima: NDArray[np.float64]) -> dict[str, NDArray[np.float64] | float]:
        """Return the values of a sample by name, from the combined parts."""
