"""Body-fitted initial clouds: particles of which the first ones are the vertices of a triangulated free surface."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.geometry import JointGeometry, joint_counts
from reflowshock.particles.core.plate import Plate, joint_plates
from reflowshock.particles.core.surface_measure import enclosed_volume

Lengths = TypeVar("Lengths", float, Floats)
LARGEST_BULGE = 0.5 * np.sqrt(3.0)  # of a double cone beyond its discs, over the gap


class TooLittleSolder(ValueError):
    """No body of this volume reaches from one disc to the other."""


@dataclass(frozen=True, slots=True)
class Cloud:
    """Particles that fill a liquid body, its free surface and its contact lines.

    Attributes:
        points: `(n, 3)` [m]; the first `surface_count` are the vertices of the free surface.
        surface_count: number of surface particles, rings included.
        triangles: `(t, 3)` free surface, outward oriented, open at the walls.
        rings: one or two contact lines, each `(k,)` ordered counter-clockwise seen from +z.
        plates: the plate under each ring, at the start.
        wall: `(n,)` index of the wall that a particle slides on, -1 off the walls (rings are on their wall).
        spacing: mean distance of neighbours [m].
        symmetry: axes of the planes of symmetry through the origin, 0 for x = 0 and 1 for y = 0; the cloud is that part
            of the body where these coordinates are not negative, and contact lines are arcs from plane to plane.
    """

    points: Floats
    surface_count: int
    triangles: Indices
    rings: tuple[Indices, ...]
    plates: tuple[Plate, ...]
    wall: NDArray[np.int8]
    spacing: float
    symmetry: tuple[int, ...] = ()

    @property
    def parts(self) -> int:
        """Of how many such parts the body consists."""
        return 2 ** len(self.symmetry)


def equal_area_radius(radius: Lengths, corners: Lengths) -> Lengths:
    """Radius of the corners of a regular polygon that has the area of the disc [m]; of several, given arrays."""
    return radius / np.sqrt(np.sinc(2.0 / corners))


def joint_cloud(geometry: JointGeometry, volume: float, spacing: float) -> Cloud:
    """Fill a double cone of a given volume between two discs.

    The radius changes linearly from the board's disc to the middle and on to the package's disc: a shape that
    meets both contact lines and has the right volume, but is no equilibrium. It is not steeper than 60 degrees off the
    vertical, where its surface would pass through the plates as it rounds off: more solder starts on the mask.

    Args:
        geometry: gap and radii of the wetted discs.
        volume: volume of the polyhedron that the surface and the walls enclose [m^3].
        spacing: particle spacing [m].

    Raises:
        TooLittleSolder: the volume is too small for a double cone that does not rupture.
    """
    ring_count, layer_count = joint_counts(geometry, volume, spacing)
    steepest = LARGEST_BULGE * geometry.gap

    def place(bulge: float) -> Cloud:
        beyond = max(0.0, bulge - steepest)
        board, package = geometry.radius_board + beyond, geometry.radius_package + beyond
        wetted = replace(geometry, radius_board=board, radius_package=package)
        return _stack(wetted, (ring_count, layer_count), bulge - beyond, spacing)

    def excess(bulge: float) -> float:
        return _volume(place(bulge)) - volume

    lowest = -0.95 * min(geometry.radius_board, geometry.radius_package)
    if excess(lowest) > 0.0:
        raise TooLittleSolder(f"solder.volume = {volume:.4g} m^3 spans no gap of {geometry.gap:.4g} m: it ruptures")
    highest = np.sqrt(3.0 * volume / (np.pi * geometry.gap)) * 2.0
    from scipy.optimize import brentq  # drops start without it

    return place(brentq(excess, lowest, highest, rtol=1e-13))


def _volume(cloud: Cloud) -> float:
    return enclosed_volume(cloud.points, cloud.triangles, cloud.rings, cloud.plates)


def _stack(geometry: JointGeometry, counts: tuple[int, int], bulge: float, spacing: float) -> Cloud:
    """Stack layers of concentric rings; ring j of a layer has 6 j particles, odd layers are turned by half a step."""
    ring_count, layer_count = counts
    corners = 6 * ring_count
    height = np.linspace(0.0, geometry.gap, layer_count)
    fraction = height / geometry.gap
    rim = (1.0 - fraction) * geometry.radius_board + fraction * geometry.radius_package
    radius = equal_area_radius(1.0, corners) * rim + bulge * (1.0 - np.abs(2.0 * fraction - 1.0))
    shells: list[Floats] = []
    interior: list[Floats] = []
    for layer in range(layer_count):
        turn = np.pi / corners * (layer % 2)
        for ring in range(ring_count, -1, -1):
            points = _circle(radius[layer] * ring / ring_count, height[layer], 6 * ring, turn)
            (shells if ring == ring_count else interior).append(points)
    points = np.concatenate(shells + interior)
    surface_count = corners * layer_count
    wall = np.full(len(points), -1, np.int8)
    wall[points[:, 2] == height[0]] = 0
    wall[points[:, 2] == height[-1]] = 1
    first = np.arange(corners, dtype=np.int32)
    rings = (first, first + corners * (layer_count - 1))
    triangles = _band_triangles(corners, layer_count)
    plates = joint_plates(geometry)
    return Cloud(_lean(points, plates[1]), surface_count, triangles, rings, plates, wall, spacing)


def _lean(points: Floats, package: Plate) -> Floats:
    """Move upright layers, the more the higher, so that the uppermost lies on the package's plate."""
    flat = points * np.array([1.0, 1.0, 0.0])
    height = package.origin[2]
    upright = flat + np.array([0.0, 0.0, height])
    return points + points[:, 2:3] / height * (package.place(flat) - upright)


def _circle(radius: float, height: float, count: int, turn: float) -> Floats:
    angle = turn + 2.0 * np.pi * np.arange(max(count, 1)) / max(count, 1)
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle), np.full(len(angle), height)))


def _band_triangles(corners: int, layers: int) -> Indices:
    """Triangles between stacked rings, of which the odd ones are turned by half a step; outward oriented."""
    k = np.arange(corners)
    after = (k + 1) % corners
    triangles = []
    for layer in range(layers - 1):
        low, high = layer * corners, (layer + 1) * corners
        if layer % 2 == 0:
            triangles += [np.column_stack((low + k, low + after, high + k))]
            triangles += [np.column_stack((low + after, high + after, high + k))]
        else:
            triangles += [np.column_stack((low + k, high + after, high + k))]
            triangles += [np.column_stack((low + k, low + after, high + after))]
    return np.concatenate(triangles).astype(np.int32)


def box_cloud(edge: float, count: int) -> Cloud:
    """Fill a cube that stands on the wall z = 0 with a lattice (Hu et al., section 4.1).

    Args:
        edge: length of an edge [m].
        count: particles along an edge.
    """
    axis = np.arange(count)
    lattice = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    last = count - 1
    side = ((lattice[:, :2] == 0) | (lattice[:, :2] == last)).any(axis=1)
    surface = side | (lattice[:, 2] == last)
    lattice = np.concatenate((lattice[surface], lattice[~surface]))
    number = np.empty((count,) * 3, np.int64)
    number[tuple(lattice.T)] = np.arange(len(lattice))
    top = _grid_triangles(number[:, :, last])
    sheets = [number[:, 0, :], number[last, :, :], number[::-1, last, :], number[0, ::-1, :]]
    triangles = np.concatenate([top] + [_grid_triangles(sheet) for sheet in sheets]).astype(np.int32)
    ring = np.concatenate([sheet[:-1, 0] for sheet in sheets]).astype(np.int32)
    points = lattice * (edge / last) - np.array([0.5 * edge, 0.5 * edge, 0.0])
    wall = np.where(lattice[:, 2] == 0, 0, -1).astype(np.int8)
    return Cloud(points, int(surface.sum()), triangles, (ring,), (Plate.horizontal(0.0),), wall, edge / last)


def free_box_cloud(edge: float, count: int) -> Cloud:
    """Fill a cube about the origin with a lattice; no wall touches it.

    Args:
        edge: length of an edge [m].
        count: particles along an edge.
    """
    axis, last = np.arange(count), count - 1
    lattice = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    surface = ((lattice == 0) | (lattice == last)).any(axis=1)
    lattice = np.concatenate((lattice[surface], lattice[~surface]))
    number = np.empty((count,) * 3, np.int64)
    number[tuple(lattice.T)] = np.arange(len(lattice))
    ends = [number[:, :, last], number[:, ::-1, 0]]
    sheets = [*ends, number[:, 0, :], number[last, :, :], number[::-1, last, :], number[0, ::-1, :]]
    triangles = np.concatenate([_grid_triangles(sheet) for sheet in sheets]).astype(np.int32)
    wall = np.full(len(lattice), -1, np.int8)
    return Cloud((lattice / last - 0.5) * edge, int(surface.sum()), triangles, (), (), wall, edge / last)


def _grid_triangles(sheet: NDArray[np.int64]) -> NDArray[np.int64]:
    """Split the quadrilaterals of a sheet of vertex numbers, with alternating diagonals; normal = axis 0 x axis 1."""
    a, b = sheet[:-1, :-1], sheet[1:, :-1]
    c, d = sheet[1:, 1:], sheet[:-1, 1:]
    even = (np.add.outer(np.arange(a.shape[0]), np.arange(a.shape[1])) % 2 == 0)[..., None]
    first = np.where(even, np.stack((a, b, c), -1), np.stack((a, b, d), -1))
    second = np.where(even, np.stack((a, c, d), -1), np.stack((b, c, d), -1))
    return np.concatenate((first.reshape(-1, 3), second.reshape(-1, 3)))


def sphere_cloud(volume: float, shells: int) -> Cloud:
    """Fill a ball with geodesic spheres about a particle at the centre.

    Shell k has 10 k^2 + 2 particles: the k-fold subdivision of the icosahedron's faces. The second mode has the same
    frequency about every axis of this symmetry.

    Args:
        volume: of the polyhedron of the surface [m^3].
        shells: number of spheres, at least 2.
    """
    layers = [geodesic_sphere(k) * (k / shells) for k in range(shells, 0, -1)]
    points = np.concatenate([*layers, np.zeros((1, 3))])
    surface_count = len(layers[0])
    triangles = _outward(layers[0], ConvexHull(layers[0]).simplices.astype(np.int32))
    points *= np.cbrt(volume / enclosed_volume(points, triangles, (), ()))
    return Cloud(
        points=points,
        surface_count=surface_count,
        triangles=triangles,
        rings=(),
        plates=(),
        wall=np.full(len(points), -1, np.int8),
        spacing=float(np.cbrt(volume / len(points))),
    )


def geodesic_sphere(frequency: int) -> Floats:
    """Vertices of the subdivided icosahedron on the unit sphere, `(10 frequency^2 + 2, 3)`."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    corner = np.array([[0.0, one, two * golden] for one in (1, -1) for two in (1, -1)])
    corners = np.concatenate([np.roll(corner, shift, axis=1) for shift in range(3)]) / np.hypot(1.0, golden)
    faces = corners[ConvexHull(corners).simplices]
    arc = np.arctan(2.0)
    weights = np.array(
        [(i, j, frequency - i - j) for i in range(frequency + 1) for j in range(frequency + 1 - i)], dtype=float
    )
    points = (np.sin(arc * weights / frequency) @ faces).reshape(-1, 3)
    points /= np.linalg.norm(points, axis=1)[:, None]
    _, first = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True)
    return points[np.sort(first)]


def _outward(points: Floats, triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """Turn the triangles of a convex surface about the origin outward."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles
