"""Result of a reflow: the shape of one joint with its history, as plain data."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices


def concatenate_shapes(arrays: Sequence[NDArray], counts: Sequence[int]) -> NDArray:
    """Concatenate particle arrays of several bodies, the surface particles of all bodies first.

    Args:
        arrays: Array of each body, shape (n_i, ...), its surface particles first.
        counts: Number of surface particles of each body.
    """
    pairs = list(zip(arrays, counts, strict=True))
    return np.concatenate([array[:count] for array, count in pairs] + [array[count:] for array, count in pairs])


def shifted_indices(indices: Sequence[Indices], counts: Sequence[int]) -> list[Indices]:
    """Shift indices into several arrays to indices into their concatenation.

    Args:
        indices: Indices into each array, of any shape.
        counts: Length of each array; the indices of the first one are not shifted.

    Returns:
        Shifted indices of each array, of equal shapes.
    """
    firsts = np.cumsum([0, *counts[:-1]])
    return [(part + first).astype(np.int32) for part, first in zip(indices, firsts, strict=True)]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Particles and surface at one time.

    Attributes:
        time: Time [s].
        points: Particle positions, shape (n, 3) [m].
        triangles: Triangles of the free surface, shape (t, 3).
    """

    time: float
    points: Floats
    triangles: Indices


@dataclass(frozen=True, slots=True)
class JointShape:
    """Joint or drop at the end of its reflow, in its own frame: origin at the centre of the board pad, z up.

    Attributes:
        points: Particle positions, the s vertices of the free surface first, shape (n, 3) [m].
        velocity: Velocity, shape (n, 3) [m/s].
        pressure: Pressure above ambient, shape (n,) [Pa].
        surface_points: Vertices of the tracked free surface, shape (s, 3) [m].
        triangles: Triangles of the free surface, outward oriented, open at the walls, shape (t, 3).
        rings: Contact lines, the board's first: vertices counter-clockwise seen from +z, shape (k,) each.
        history: Columns step, time, time_step, binding, height, width, volume, energy, capillary_number, displacement
            and iterations.
        snapshots: First, last and intermediate snapshots.
        metrics: Value and unit of each metric.
        verdict: "ok", "overflow" (solder on the mask), "dewetted" (off the pad's edge), "open" (neck ruptured, or the
            drop does not reach the package), "bridged" (one body on the pads of several joints).
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
        """Contact line on the board, shape (k,)."""
        return self.rings[0]

    @property
    def ring_package(self) -> Indices:
        """Contact line on the package, shape (k,)."""
        return self.rings[1]
