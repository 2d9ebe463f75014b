"""Strain gauges in input numbers: the distance of two points of a face, which displacements give without a derivative.

The strain is the mean over a gauge's length, as a foil gauge measures it. Between nodes displacements are as the shape
functions have them; the errors of both ends cancel where the length is a whole number of elements.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class GaugeTable:
    """Strain gauges in input numbers.

    Attributes:
        names: Of the gauges.
        direction: ``(g, 3)`` unit vectors.
        length: ``(g,)`` [m] between the ends.
        nodes: ``(k,)`` nodes around the ends.
        gauge: ``(k,)`` the gauge that each belongs to.
        weight: ``(k, 3)`` [1/m] of its displacement's components in how much longer the gauge is, over its length.
    """

    names: tuple[str, ...]
    direction: NDArray[np.float64]
    length: NDArray[np.float64]
    nodes: NDArray[np.integer]
    gauge: NDArray[np.int64]
    weight: NDArray[np.float64]

    @classmethod
    def none(cls) -> "GaugeTable":
        """Return the table of a mesh without gauges."""
        vectors, numbers = np.empty((0, 3)), np.empty(0, np.int64)
        return cls((), vectors, np.empty(0), numbers, numbers, vectors)

    def within(self, node: NDArray[np.integer]) -> "GaugeTable":
        """Return the part of a model with its numbers ``node (n,)`` of nodes, -1 for those that count in another."""
        here = node[self.nodes] >= 0
        return replace(self, nodes=node[self.nodes][here], gauge=self.gauge[here], weight=self.weight[here])

    def strains(self, stretches: NDArray[np.float64], turning: bool) -> NDArray[np.float64]:
        """Return the strains ``(g,)``.

        Args:
            stretches: ``(g, 3)`` displacement of one end relative to the other, over the length.
            turning: Whether rotations are finite; small ones change no distance.
        """
        if turning:
            return np.asarray(np.linalg.norm(self.direction + stretches, axis=1) - 1.0)
        return np.einsum("gi,gi->g", self.direction, stretches)
