"""Clouds built from a level set: where liquids merge, the surface and the particles below it are made anew."""

import numpy as np
from numpy.typing import NDArray

from particles.cloud import Cloud
from particles.level_set import LevelSet
from particles.plate import Plate
from particles.surface_measure import volume_and_gradient
from particles.surface_nets import extract_surface, relax

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

DEPTH = 0.75
VOLUME_PASSES = 4


def cloud_from_level_set(level: LevelSet, volume: float, on_wall: bool) -> Cloud:
    """Fill a level set with particles a node spacing apart.

    Args:
        level: negative in the liquid; with a wall it is symmetric about z = 0 and only z >= 0 is filled. Where the
            liquid wets the wall in several places, or leaves dry spots, each of their contact lines has a plate.
        volume: volume of the liquid, kept exactly [m^3].
        on_wall: whether the liquid stands on the wall z = 0.
    """
    points, triangles = extract_surface(level)
    rings: tuple[Indices, ...] = ()
    if on_wall:
        points, triangles, rings = _above(points, triangles, 1e-6 * level.grid.spacing)
    points, triangles = relax(level, points, triangles, rings)
    plates = (Plate.horizontal(0.0),) * len(rings)
    points = _with_volume(points, triangles, (rings, plates), volume)
    below = _interior(level, on_wall)
    wall = np.full(len(points) + len(below), -1, np.int8)
    wall[len(points) :][below[:, 2] == 0.0] = 0
    for number, ring in enumerate(rings):
        wall[ring] = number
    everything = np.concatenate((points, below))
    return Cloud(everything, len(points), triangles, rings, plates, wall, level.grid.spacing)


def _above(points: Floats, triangles: Indices, tolerance: float) -> tuple[Floats, Indices, tuple[Indices, ...]]:
    """Keep the upper half of a surface that is symmetric about z = 0, and the loops along which it ends there."""
    kept = triangles[(points[triangles, 2] > -tolerance).all(axis=1)]
    used, renumbered = np.unique(kept, return_inverse=True)
    points, kept = points[used], renumbered.reshape(-1, 3).astype(np.int32)
    rings = boundary_loops(kept)
    for ring in rings:
        points[ring, 2] = 0.0
    return points, kept, rings


def boundary_loops(triangles: Indices) -> tuple[Indices, ...]:
    """Loops of the edges that belong to one triangle, in the sense of these triangles' edges, `(k,)` each."""
    edges = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    known = set(map(tuple, edges.tolist()))
    after = {i: j for i, j in known if (j, i) not in known}
    loops = []
    while after:
        loop = [next(iter(sorted(after)))]
        while (following := after.pop(loop[-1])) != loop[0]:
            loop.append(following)
        loops.append(np.array(loop, np.int32))
    return tuple(loops)


def _with_volume(
    points: Floats, triangles: Indices, walls: tuple[tuple[Indices, ...], tuple[Plate, ...]], volume: float
) -> Floats:
    """Move the surface along its normals by one distance until it encloses the volume."""
    for _ in range(VOLUME_PASSES):
        enclosed, gradient = volume_and_gradient(points, triangles, *walls)
        for ring in walls[0]:
            gradient[ring, 2] = 0.0
        normal = gradient / np.linalg.norm(gradient, axis=1)[:, None]
        points = points + (volume - enclosed) / (gradient * normal).sum() * normal
    return points


def _interior(level: LevelSet, on_wall: bool) -> Floats:
    """Points of a cubic lattice deeper than three quarters of a spacing, `(m, 3)` [m]; with a wall, some are on it."""
    axes = level.grid.axes()
    if on_wall:
        axes[2] = level.grid.spacing * np.arange(level.grid.counts[2] // 2)
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return lattice[level.at(lattice) < -DEPTH * level.grid.spacing]
