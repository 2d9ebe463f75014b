"""Strain gauges in input numbers: strain from the distance of two points on a face, without derivatives.

The strain is the mean over the length of a gauge, as a foil gauge measures it. Displacements are interpolated by the
shape functions; the errors of both ends cancel if the length is a whole number of elements.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class GaugeTable:
    """Strain gauges in input numbers.

    Attributes:
        names: Names of the gauges.
        direction: Unit vectors along the gauges, shape (g, 3).
        length: Distances between the ends, shape (g,) [m].
        nodes: Nodes around the ends, shape (k,).
        gauge: Gauge of each node, shape (k,).
        weight: Weights of the node's displacement in the relative elongation of its gauge, shape (k, 3) [1/m].
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
        """Return the part of one model in its own numbers.

        Args:
            node: Node number in the model of each input node, -1 if it counts in another model, shape (n,).
        """
        here = node[self.nodes] >= 0
        return replace(self, nodes=node[self.nodes][here], gauge=self.gauge[here], weight=self.weight[here])

    def strains(self, stretches: NDArray[np.float64], turning: bool) -> NDArray[np.float64]:
        """Return the strains of the gauges, shape (g,).

        Args:
            stretches: Relative displacement of the ends over the length, shape (g, 3).
            turning: Whether rotations are finite; small rotations do not change distances.
        """
        if turning:
            return np.asarray(np.linalg.norm(self.direction + stretches, axis=1) - 1.0)
        return np.einsum("gi,gi->g", self.direction, stretches)
