"""The printed part: its surface, height map, roughness, voids, layers, and how many parts it consists of."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.surface_measure import volume_and_gradient
from reflowshock.particles.parameters.printing import Printing
from reflowshock.particles.printing.deposit import Deposit
from reflowshock.particles.sph.flow import Metrics
from reflowshock.particles.surface.closing import closed_level, groups
from reflowshock.particles.surface.level_set import LevelSet, extract_surface

# In spacings of the particles: gaps of the part that are none; particles whose drops touch are not farther apart.
GAP, LINK = 1.0, 2.0


@dataclass(frozen=True, slots=True)
class Part:
    """What was printed.

    Attributes:
        points: of its surface, closed by the plate, `(m, 3)` [m].
        triangles: `(t, 3)`, outward oriented.
        x, y: of the height map `(i,)`, `(j,)` [m].
        heights: `(i, j)` above the plate [m]; 0 where there is no ink.
        layers: a row each: number, drops, connected parts of its drops alone and of all that is printed with it, top
            of its drops on average, top of all up to it [m].
        voids: volume of each [m^3].
    """

    points: Floats
    triangles: Indices
    x: Floats
    y: Floats
    heights: Floats
    layers: Floats
    voids: Floats


def part_of(scene: Printing, deposit: Deposit) -> Part:
    """Return the part that solid bodies make."""
    spacing = deposit.law.spacing
    level = closed_level(deposit.ground, GAP * spacing)
    x, y, z = level.grid.axes()
    above = LevelSet(level.grid, np.maximum(level.values, -z))
    points, triangles = extract_surface(above)
    return Part(points, triangles, x, y, _heights(level), _layers(scene, deposit), _voids(level))


def _heights(level: LevelSet) -> Floats:
    """Height of the highest liquid above each node of the plate `(i, j)` [m]."""
    values, z = level.values, level.grid.axes()[2]
    inside = (values < 0.0) & (z > 0.0)
    top = len(z) - 1 - np.argmax(inside[:, :, ::-1], axis=2)
    top = np.minimum(top, len(z) - 2)
    below = np.take_along_axis(values, top[..., None], axis=2)[..., 0]
    over = np.take_along_axis(values, top[..., None] + 1, axis=2)[..., 0]
    reach = np.where(inside.any(axis=2), below / np.where(below != over, below - over, 1.0), 0.0)
    return np.where(inside.any(axis=2), z[top] + level.grid.spacing * reach, 0.0)


def _voids(level: LevelSet) -> Floats:
    """Volumes of what is enclosed and not filled `(k,)` [m^3]."""
    air = (level.values > 0.0) & (level.grid.axes()[2] > 0.0)
    numbers, count = label(air)
    sizes = np.bincount(numbers.ravel(), minlength=count + 1)[1:]
    return np.delete(sizes, np.unique(numbers[:, :, -1]) - 1) * level.grid.spacing**3


def _layers(scene: Printing, deposit: Deposit) -> Floats:
    """Rows of the table of layers."""
    rows, points, spacing = [], deposit.points, deposit.law.spacing
    layer = deposit.drop // scene.drops_of_layer
    highest = np.full(scene.drops, -np.inf)
    np.maximum.at(highest, deposit.drop, points[:, 2] + 0.5 * spacing)
    for number in range(scene.layers):
        drops = highest[number * scene.drops_of_layer : (number + 1) * scene.drops_of_layer]
        up_to = highest[: (number + 1) * scene.drops_of_layer].max()
        alone, so_far = (_parts(points[some], LINK * spacing) for some in (layer == number, layer <= number))
        rows.append((number + 1, len(drops), alone, so_far, drops.mean(), up_to))
    return np.array(rows)


def _parts(points: Floats, reach: float) -> int:
    """Number of groups of points `(n, 3)` that are no farther than a reach from each other [m]."""
    first, second = cKDTree(points).query_pairs(reach, output_type="ndarray").T
    return int(groups(first, second, len(points)).max()) + 1


def measure_part(scene: Printing, deposit: Deposit, part: Part) -> Metrics:
    """Return the numbers of a printed part."""
    printed = scene.drops * scene.drop_volume
    bodies = sum(volume_and_gradient(points, triangles, (), ())[0] for points, triangles in deposit.bodies)
    field = _field(scene, part)
    particles = float((deposit.fields.mass / deposit.fields.density).sum())
    return {
        "drops": (float(scene.drops), ""),
        "volume_error": (bodies / printed - 1.0, ""),
        "volume_drift": (particles / printed - 1.0, ""),
        "part_volume": (volume_and_gradient(part.points, part.triangles, (), ())[0], "m^3"),
        "connected_parts_max": (float(part.layers[:, 3].max()), ""),
        "roughness_sa": (float(np.abs(field - field.mean()).mean()), "m"),
        "roughness_sz": (float(np.ptp(field)), "m"),
        "height_mean": (float(field.mean()), "m"),
        "height_max": (float(part.heights.max()), "m"),
        "layer_rise_min": (float(np.diff(part.layers[:, 5], prepend=0.0).min()), "m"),
        "voids": (float(len(part.voids)), ""),
        "void_volume": (float(part.voids.sum()), "m^3"),
    }


def _field(scene: Printing, part: Part) -> Floats:
    """Heights within half a pitch of the places of drops `(k,)` [m]: where roughness is told."""
    half_x, half_y = 0.5 * scene.columns * scene.pitch, 0.5 * scene.rows * scene.pitch
    return part.heights[np.abs(part.x) <= half_x][:, np.abs(part.y) <= half_y].ravel()
