"""The printed part: surface, height map, roughness, voids, layers and number of connected parts."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.surface_measure import volume_and_gradient
from reflowshock.particles.flows.printing import Printing
from reflowshock.particles.flows.result import Metrics
from reflowshock.particles.printing.deposit import Deposit, add_to_ground, empty_ground
from reflowshock.particles.surface.level_set import LevelSet, extract_surface
from reflowshock.particles.surface.morphological_closing import close_gaps, connected_groups

# In particle spacings: width below which gaps between solid bodies are filled, and largest distance of two particles
# whose drops touch.
GAP, LINK = 1.0, 2.0


class Layer(NamedTuple):
    """One layer, and the print up to and including it.

    Attributes:
        number: Number of the layer, from 1.
        drops: Number of drops in the layer.
        parts: Number of connected parts of the layer's drops alone.
        parts_so_far: Number of connected parts of the print so far.
        mean_top: Mean height of the tops of the layer's drops [m].
        height: Largest height of the print so far [m].
        roughness_sa: Mean deviation Sa of the height of the print so far [m].
        roughness_sz: Range Sz of the height of the print so far [m].
        volume: Volume of the bodies that became solid in the layer [m^3].
        voids: Number of voids in the print so far.
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
    """A printed part.

    Attributes:
        points: Vertices of the surface, closed by the plate, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        x: Coordinates of the rows of the height map, shape (i,) [m].
        y: Coordinates of its columns, shape (j,) [m].
        heights: Height map above the plate, shape (i, j) [m]; 0 where the plate is bare.
        layers: Layers from the plate upwards.
        voids: Volume of each void, shape (k,) [m^3].
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
        """Whether adjacent drops merged: "merged", "partly merged", "separate", or "voids" if there are any."""
        parts, drops = self.layers[-1].parts_so_far, self.layers[0].drops
        if len(self.voids):
            return "voids"
        if parts >= drops:
            return "separate"
        return "merged" if parts == 1 else "partly merged"


def part_of(scene: Printing, deposit: Deposit) -> Part:
    """Assemble the printed part from the solid bodies of a deposit.

    Args:
        scene: Parameters of the print: drops, their positions and order, ink, curing and numerics.
        deposit: State of the print after its last drop: solid bodies, ink and particles.

    Returns:
        Surface, height map, layers and voids; gaps narrower than the resolution are closed.
    """
    level = close_gaps(deposit.ground, GAP * deposit.law.spacing)
    x, y, z = level.grid.axes()
    above = LevelSet(level.grid, np.maximum(level.values, -z))
    points, triangles = extract_surface(above)
    return Part(points, triangles, x, y, _heights(level), _layers(scene, deposit), _voids(level))


def _heights(level: LevelSet) -> Floats:
    """Return the height of the highest zero of a level set above each node of the plate, shape (i, j) [m]."""
    values, z = level.values, level.grid.axes()[2]
    inside = (values < 0.0) & (z > 0.0)
    top = len(z) - 1 - np.argmax(inside[:, :, ::-1], axis=2)
    top = np.minimum(top, len(z) - 2)
    below = np.take_along_axis(values, top[..., None], axis=2)[..., 0]
    over = np.take_along_axis(values, top[..., None] + 1, axis=2)[..., 0]
    reach = np.where(inside.any(axis=2), below / np.where(below != over, below - over, 1.0), 0.0)
    return np.where(inside.any(axis=2), z[top] + level.grid.spacing * reach, 0.0)


def _voids(level: LevelSet) -> Floats:
    """Return the volumes of enclosed voids, shape (k,) [m^3]."""
    air = (level.values > 0.0) & (level.grid.axes()[2] > 0.0)
    numbers, count = label(air)
    sizes = np.bincount(numbers.ravel(), minlength=count + 1)[1:]
    return np.delete(sizes, np.unique(numbers[:, :, -1]) - 1) * level.grid.spacing**3


def _layers(scene: Printing, deposit: Deposit) -> list[Layer]:
    """Measure the layers; a body that several layers share belongs to the last of them."""
    rows, points, spacing = [], deposit.points, deposit.law.spacing
    layer = deposit.drop // scene.drops_of_layer
    highest = np.full(scene.drops, -np.inf)
    np.maximum.at(highest, deposit.drop, points[:, 2] + 0.5 * spacing)
    ground = empty_ground(scene, spacing)
    for number in range(scene.layers):
        bodies = [body for body in deposit.bodies if body.drop // scene.drops_of_layer == number]
        for body in bodies:
            add_to_ground(ground, body)
        level = close_gaps(ground, GAP * spacing)
        field = _printed_heights(scene, level.grid.axes(), _heights(level))
        drops = highest[number * scene.drops_of_layer : (number + 1) * scene.drops_of_layer]
        alone, so_far = (_count_groups(points[chosen], LINK * spacing) for chosen in (layer == number, layer <= number))
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


def _count_groups(points: Floats, reach: float) -> int:
    """Return the number of groups of points (n, 3) connected by distances up to a reach [m]."""
    first, second = cKDTree(points).query_pairs(reach, output_type="ndarray").T
    return int(connected_groups(first, second, len(points)).max()) + 1


def measure_part(scene: Printing, deposit: Deposit, part: Part) -> Metrics:
    """Return the metrics of a printed part: name -> (value, unit).

    Args:
        scene: Parameters of the print: drops, their positions and order, ink, curing and numerics.
        deposit: State of the print after its last drop, with its particles.
        part: Printed part that ``part_of`` returned.

    Returns:
        ``drops``, ``volume_error``, ``volume_drift``, ``part_volume`` [m^3], ``connected_parts_max`` (largest number of
        separate bodies), ``roughness_sa``, ``roughness_sz``, ``height_mean``, ``height_max``, ``layer_rise_min`` [m],
        ``footprint`` [m^2], ``voids`` (their number) and ``void_volume`` [m^3], among others.
    """
    printed = scene.drops * scene.drop_volume
    bodies = sum(layer.volume for layer in part.layers)
    field = _printed_heights(scene, (part.x, part.y), part.heights)
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
    """Return the volume enclosed by a surface and the plate [m^3]."""
    return volume_and_gradient(points, triangles, (), ())[0]


def _sa(field: Floats) -> float:
    """Return the mean absolute deviation of heights from their mean [m]."""
    return float(np.abs(field - field.mean()).mean())


def _printed_heights(scene: Printing, axes: Sequence[Floats], heights: Floats) -> Floats:
    """Return the heights within half a pitch of the drops, over which roughness is measured, shape (k,) [m].

    Args:
        scene: Printing parameters.
        axes: Coordinates x (i,) and y (j,) of the height map [m].
        heights: Height map, shape (i, j) [m].
    """
    half_x, half_y = 0.5 * scene.columns * scene.pitch, 0.5 * scene.rows * scene.pitch
    return heights[np.abs(axes[0]) <= half_x][:, np.abs(axes[1]) <= half_y].ravel()
