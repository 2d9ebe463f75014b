"""The printed part: its surface, height map, roughness, voids, layers, and how many parts it consists of."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.surface_measure import volume_and_gradient
from reflowshock.particles.parameters.printing import Printing
from reflowshock.particles.printing.deposit import Deposit, join, nothing_of
from reflowshock.particles.sph.flow import Metrics
from reflowshock.particles.surface.level_set import LevelSet, extract_surface
from reflowshock.particles.surface.morphological_closing import close_gaps, connected_groups

# In spacings of the particles: gaps of the part that are none; particles whose drops touch are not farther apart.
GAP, LINK = 1.0, 2.0


class Layer(NamedTuple):
    """What a layer added, and what all that is printed up to it looks like.

    Attributes:
        number: from 1.
        drops: printed in it.
        parts: connected parts of its drops alone.
        parts_so_far: of all up to it.
        mean_top: top of its drops on average [m].
        height: top of all up to it [m].
        roughness_sa, roughness_sz: of all up to it [m].
        volume: of what cured in it [m^3].
        voids: in all up to it.
    """

    number: int
    drops: int
    parts: int
    parts_so_far: int
    mean_top: float
    height: float
    roughness_sa: float
    roughness_sz: float
    volume: float
    voids: int


@dataclass(frozen=True, slots=True)
class Part:
    """What was printed.

    Attributes:
        points: of its surface, closed by the plate, `(m, 3)` [m].
        triangles: `(t, 3)`, outward oriented.
        x, y: of the height map `(i,)`, `(j,)` [m].
        heights: `(i, j)` above the plate [m]; 0 where there is no ink.
        layers: in their order.
        voids: volume of each [m^3].
    """

    points: Floats
    triangles: Indices
    x: Floats
    y: Floats
    heights: Floats
    layers: list[Layer]
    voids: Floats

    @property
    def outcome(self) -> str:
        """What became of the drops beside each other: merged, with voids or not, partly so, or separate."""
        parts, drops = self.layers[-1].parts_so_far, self.layers[0].drops
        if len(self.voids):
            return "voids"
        if parts >= drops:
            return "separate"
        return "merged" if parts == 1 else "partly merged"


def part_of(scene: Printing, deposit: Deposit) -> Part:
    """Return the part that solid bodies make."""
    level = close_gaps(deposit.ground, GAP * deposit.law.spacing)
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


def _layers(scene: Printing, deposit: Deposit) -> list[Layer]:
    """Return the layers; a body that several of them share counts to the last."""
    rows, points, spacing = [], deposit.points, deposit.law.spacing
    layer = deposit.drop // scene.drops_of_layer
    highest = np.full(scene.drops, -np.inf)
    np.maximum.at(highest, deposit.drop, points[:, 2] + 0.5 * spacing)
    ground = nothing_of(scene, spacing)
    for number in range(scene.layers):
        bodies = [body for body in deposit.bodies if body.drop // scene.drops_of_layer == number]
        for body in bodies:
            join(ground, body)
        level = close_gaps(ground, GAP * spacing)
        field = _field(scene, level.grid.axes(), _heights(level))
        drops = highest[number * scene.drops_of_layer : (number + 1) * scene.drops_of_layer]
        alone, so_far = (_parts(points[some], LINK * spacing) for some in (layer == number, layer <= number))
        rows.append(
            Layer(
                number + 1,
                len(drops),
                alone,
                so_far,
                float(drops.mean()),
                float(highest[: (number + 1) * scene.drops_of_layer].max()),
                _sa(field),
                float(np.ptp(field)),
                sum(_volume(body.points, body.triangles) for body in bodies),
                len(_voids(level)),
            )
        )
    return rows


def _parts(points: Floats, reach: float) -> int:
    """Number of groups of points `(n, 3)` that are no farther than a reach from each other [m]."""
    first, second = cKDTree(points).query_pairs(reach, output_type="ndarray").T
    return int(connected_groups(first, second, len(points)).max()) + 1


def measure_part(scene: Printing, deposit: Deposit, part: Part) -> Metrics:
    """Return the numbers of a printed part."""
    printed = scene.drops * scene.drop_volume
    bodies = sum(layer.volume for layer in part.layers)
    field = _field(scene, (part.x, part.y), part.heights)
    particles = float((deposit.fields.mass / deposit.fields.density).sum())
    return {
        "drops": (float(scene.drops), ""),
        "volume_error": (bodies / printed - 1.0, ""),
        "volume_drift": (particles / printed - 1.0, ""),
        "part_volume": (_volume(part.points, part.triangles), "m^3"),
        "connected_parts_max": (float(max(layer.parts_so_far for layer in part.layers)), ""),
        "roughness_sa": (_sa(field), "m"),
        "roughness_sz": (float(np.ptp(field)), "m"),
        "height_mean": (float(field.mean()), "m"),
        "height_max": (float(part.heights.max()), "m"),
        "layer_rise_min": (float(np.diff([layer.height for layer in part.layers], prepend=0.0).min()), "m"),
        "footprint": (float((part.heights > 0.0).mean() * np.ptp(part.x) * np.ptp(part.y)), "m^2"),
        "voids": (float(len(part.voids)), ""),
        "void_volume": (float(part.voids.sum()), "m^3"),
    }


def _volume(points: Floats, triangles: Indices) -> float:
    return volume_and_gradient(points, triangles, (), ())[0]


def _sa(field: Floats) -> float:
    """Mean distance from the mean."""
    return float(np.abs(field - field.mean()).mean())


def _field(scene: Printing, places: Sequence[Floats], heights: Floats) -> Floats:
    """Heights `(i, j)` at x, y within half a pitch of the places of drops `(k,)` [m]: where roughness is told."""
    half_x, half_y = 0.5 * scene.columns * scene.pitch, 0.5 * scene.rows * scene.pitch
    return heights[np.abs(places[0]) <= half_x][:, np.abs(places[1]) <= half_y].ravel()
