"""Body-fitted initial particle clouds, in which the first particles are the vertices of a triangulated free surface."""

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
# Largest bulge of a double cone beyond its discs, over the gap.
LARGEST_BULGE = 0.5 * np.sqrt(3.0)


class TooLittleSolder(ValueError):
    """The solder volume is too small for a body that reaches from one disc to the other."""


@dataclass(frozen=True, slots=True)
class Cloud:
    """Particles that fill a liquid body, its free surface and its contact lines.

    Attributes:
        points: Positions, shape (n, 3) [m]; the first ``surface_count`` are the vertices of the free surface.
        surface_count: Number of surface particles, rings included.
        triangles: Triangles of the free surface, outward oriented, open at the walls, shape (t, 3).
        rings: Contact lines, each of shape (k,), counter-clockwise seen from +z.
        plates: Plate under each ring at the start.
        wall: Index of the wall on which a particle slides, -1 off the walls, shape (n,); rings are on their wall.
        spacing: Mean distance of neighbours [m].
        symmetry: Axes of the planes of symmetry through the origin, 0 for x = 0 and 1 for y = 0. The cloud is the part
            of
            the body where these coordinates are not negative; contact lines are arcs from plane to plane.
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
        """Number of such parts in the whole body."""
        return 2 ** len(self.symmetry)


def equal_area_radius(radius: Lengths, corners: Lengths) -> Lengths:
    """Return the circumradius of a regular polygon with the area of a disc, elementwise [m].

    Args:
        radius: Radius of the disc [m].
        corners: Number of corners of the polygon.
    """
    return radius / np.sqrt(np.sinc(2.0 / corners))


def joint_cloud(geometry: JointGeometry, volume: float, spacing: float) -> Cloud:
    """Fill a double cone of a given volume between two discs with particles.

    The radius changes linearly from the board's disc to the middle and on to the package's disc. The shape meets both
    contact lines and has the right volume but is not in equilibrium. It is at most 60 degrees off the vertical, since
    its surface would pass through the plates while it becomes round; the rest of the solder starts on the mask.

    Args:
        geometry: Gap and radii of the wetted discs.
        volume: Volume of the polyhedron enclosed by the surface and the walls [m^3].
        spacing: Particle spacing [m].

    Returns:
        Particles, with the triangles of the free surface and the contact lines on both plates (board's first).

    Raises:
        TooLittleSolder: The volume is too small for a double cone without rupture.
    """
    ring_count, layer_count = joint_counts(geometry, volume, spacing)
    steepest = LARGEST_BULGE * geometry.gap

    def place(bulge: float) -> Cloud:
        beyond = max(0.0, bulge - steepest)
        board, package = geometry.radius_board + beyond, geometry.radius_package + beyond
        wetted = replace(geometry, radius_board=board, radius_package=package)
        return _stack(wetted, ring_count, layer_count, bulge - beyond, spacing)

    def excess(bulge: float) -> float:
        return _volume(place(bulge)) - volume

    lowest = -0.95 * min(geometry.radius_board, geometry.radius_package)
    if excess(lowest) > 0.0:
        raise TooLittleSolder(
            f"solder.volume = {volume:.4g} m^3 ruptures in a gap of {geometry.gap:.4g} m; use more solder"
        )
    highest = np.sqrt(3.0 * volume / (np.pi * geometry.gap)) * 2.0
    from scipy.optimize import brentq  # drops start without it

    return place(brentq(excess, lowest, highest, rtol=1e-13))


def _volume(cloud: Cloud) -> float:
    return enclosed_volume(cloud.points, cloud.triangles, cloud.rings, cloud.plates)


def _stack(geometry: JointGeometry, ring_count: int, layer_count: int, bulge: float, spacing: float) -> Cloud:
    """Stack layers of concentric rings; ring j has 6 j particles, and odd layers are rotated by half a step."""
    corners = 6 * ring_count
    height = np.linspace(0.0, geometry.gap, layer_count)
    fraction = height / geometry.gap
    rim = (1.0 - fraction) * geometry.radius_board + fraction * geometry.radius_package
    radius = equal_area_radius(1.0, corners) * rim + bulge * (1.0 - np.abs(2.0 * fraction - 1.0))
    shells: list[Floats] = []
    interior: list[Floats] = []
    for layer in range(layer_count):
        rotation = np.pi / corners * (layer % 2)
        for ring in range(ring_count, -1, -1):
            points = _circle(radius[layer] * ring / ring_count, height[layer], 6 * ring, rotation)
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
    """Move layers in proportion to their height, so that the uppermost lies on the package's plate."""
    flat = points * np.array([1.0, 1.0, 0.0])
    height = package.origin[2]
    upright = flat + np.array([0.0, 0.0, height])
    return points + points[:, 2:3] / height * (package.place(flat) - upright)


def _circle(radius: float, height: float, count: int, rotation: float) -> Floats:
    """Return points on a horizontal circle, shape (max(count, 1), 3) [m]."""
    angle = rotation + 2.0 * np.pi * np.arange(max(count, 1)) / max(count, 1)
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle), np.full(len(angle), height)))


def _band_triangles(corners: int, layers: int) -> Indices:
    """Return outward oriented triangles between stacked rings, of which the odd ones are rotated by half a step."""
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
    """Fill a cube that stands on the wall z = 0 with a lattice of particles (Hu et al., section 4.1).

    Args:
        edge: Length of an edge [m].
        count: Number of particles along an edge.

    Returns:
        Particles, with the triangles of the free surface and the contact line around the base.
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
    """Fill a cube about the origin with a lattice of particles; it touches no wall.

    Args:
        edge: Length of an edge [m].
        count: Number of particles along an edge.

    Returns:
        Particles, with the triangles of the closed surface; without contact lines.
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
    """Split the quadrilaterals of a sheet of vertices with alternating diagonals; the normal is axis 0 x axis 1."""
    a, b = sheet[:-1, :-1], sheet[1:, :-1]
    c, d = sheet[1:, 1:], sheet[:-1, 1:]
    even = (np.add.outer(np.arange(a.shape[0]), np.arange(a.shape[1])) % 2 == 0)[..., None]
    first = np.where(even, np.stack((a, b, c), -1), np.stack((a, b, d), -1))
    second = np.where(even, np.stack((a, c, d), -1), np.stack((b, c, d), -1))
    return np.concatenate((first.reshape(-1, 3), second.reshape(-1, 3)))


def sphere_cloud(volume: float, shells: int) -> Cloud:
    """Fill a ball about the origin with geodesic spheres of particles around one at the centre.

    Shell k has 10 k^2 + 2 particles, the k-fold subdivision of the faces of an icosahedron. With this symmetry the
    second mode has the same frequency about every axis.

    Args:
        volume: Volume of the polyhedron of the surface [m^3].
        shells: Number of spheres, at least 2.

    Returns:
        Particles, with the triangles of the closed surface; without contact lines.
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
    """Return the vertices of a subdivided icosahedron on the unit sphere, shape (10 frequency^2 + 2, 3).

    Args:
        frequency: Number of parts into which each edge of the icosahedron is divided, at least 1.
    """
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    corner = np.array([[0.0, first, second * golden] for first in (1, -1) for second in (1, -1)])
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
    """Orient the triangles of a convex surface about the origin outward, in place, and return them."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles
