"""The result of a reflow: one joint's shape and how it came about. Plain data."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices


def together(arrays: Sequence[NDArray], counts: Sequence[int]) -> NDArray:
    """Values of the particles of several bodies as of one: those on the surfaces first, `counts` of them."""
    pairs = list(zip(arrays, counts, strict=True))
    return np.concatenate([array[:count] for array, count in pairs] + [array[count:] for array, count in pairs])


def numbered_on(indices: Sequence[Indices], counts: Sequence[int]) -> list[Indices]:
    """Indices into each of several arrays, as they are when the arrays, `counts` long, follow each other."""
    firsts = np.cumsum([0, *counts[:-1]])
    return [(own + first).astype(np.int32) for own, first in zip(indices, firsts, strict=True)]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Particles and surface at one time.

    Attributes:
        time: [s].
        points: `(n, 3)` [m].
        triangles: `(t, 3)` of the free surface, indices of `points`.
    """

    time: float
    points: Floats
    triangles: Indices


@dataclass(frozen=True, slots=True)
class JointShape:
    """A joint or drop at the end of its reflow, in its own frame: origin at the centre of the board's disc, z up.

    Attributes:
        points: `(n, 3)` particles [m], the first `s` are the vertices of the free surface.
        velocity: `(n, 3)` [m/s].
        pressure: `(n,)` above ambient [Pa].
        surface_points: `(s, 3)` vertices of the tracked free surface [m].
        triangles: `(t, 3)` of the free surface, outward oriented, open at the walls.
        rings: contact lines, the board's first, each `(k,)` vertices of the surface, counter-clockwise seen from +z.
        history: arrays of equal length: step, time, time_step, binding, height, width, volume, energy,
            capillary_number, displacement, iterations.
        snapshots: the first, the last and some states between.
        metrics: name to value and unit.
        verdict: "ok", "overflow" (solder on the mask), "dewetted" (left the pad's edge), "open" (neck ruptured, or a
            drop on the board that does not reach the package), "bridged" (one body on the pads of several joints).
    """

    points: Floats
    velocity: Floats
    pressure: Floats
    surface_points: Floats
    triangles: Indices
    rings: tuple[Indices, ...]
    history: dict[str, NDArray]
    snapshots: list[Snapshot]
    metrics: dict[str, tuple[float, str]]
    verdict: str

    @property
    def ring_board(self) -> Indices:
        """Contact line on the board `(k,)`."""
        return self.rings[0]

    @property
    def ring_package(self) -> Indices:
        """Contact line on the package `(k,)`; a joint has one."""
        return self.rings[1]
