"""Liquid body in section: particles in the plane y = 0, of which the first are the vertices of the surface polyline.

Fields have three components with zero along y, so that steps, time integration and forces are those of bodies in space.
A meridian is the part x >= 0 that a plane of symmetry x = 0 leaves.
"""

from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import Cloud
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.section.polyline import Polyline

NO_TRIANGLES = np.zeros((0, 3), np.int32)
NARROW = 1e-3  # angle [rad] or distance [spacings] between the copies of a narrow body
LONG = 100.0  # depth over width or height of a plane body whose ends do not matter
MERIDIANS = 64  # copies around the axis in a triangulated body of revolution


@dataclass(slots=True)
class Section(Body):
    """State of a body in section; volumes are those of half a body of revolution, or of a plane drop of some depth.

    Attributes:
        polyline: Geometry of the surface.
    """

    polyline: Polyline

    @classmethod
    def filled(cls, cloud: Cloud, polyline: Polyline) -> "Section":
        """Return a body at rest made of the particles of a cloud."""
        count = len(cloud.points)
        still = (np.zeros((count, 3)), np.zeros(count), 0.0)
        return cls(cloud, cloud.points.copy(), *still, cloud.triangles, np.zeros(count), cloud.plates, polyline)

    @property
    def line(self) -> Floats:
        """Vertices of the surface, shape (s, 3) [m]."""
        return self.points[: self.cloud.surface_count]

    def on_particles(self, field: Floats) -> Floats:
        """Extend a field of the vertices, shape (s, 3), by zeros to all particles, shape (n, 3)."""
        result = np.zeros_like(self.points)
        result[: len(field)] = field
        return result

    def volume(self) -> tuple[float, Floats]:
        """Return the enclosed volume [m^3] and its gradient by the particles, shape (n, 3) [m^2]."""
        volume, gradient = self.polyline.integral(self.line, 0, 0)
        return volume, self.on_particles(gradient)

    def moments(self) -> tuple[float, Floats, Floats]:
        """Return integrals over the liquid of 1 [m^3], x, shape (3,) [m^4], and x x, shape (3, 3) [m^5], with y = 0."""

        def integral(p: int, q: int) -> float:
            return self.polyline.integral(self.line, p, q)[0]

        xz = integral(1, 1)
        second = np.array([[integral(2, 0), 0.0, xz], [0.0, 0.0, 0.0], [xz, 0.0, integral(0, 2)]])
        return integral(0, 0), np.array([integral(1, 0), 0.0, integral(0, 1)]), second

    def whole(self) -> Body:
        """Return a triangulated body: the meridian rotated about its axis, or the plane drop without its ends.

        Particles below the surface stay in the section.
        """
        if self.polyline.power:
            return self.swept(rotate_copies(2.0 * np.pi * np.arange(MERIDIANS) / MERIDIANS), is_closed=True)
        return self.swept(translate_copies(self.polyline.factor), is_closed=False)

    def enclosing(self) -> Body:
        """Return a triangulated body whose surface encloses the liquid; a plane drop gets a depth of 100 widths."""
        if self.polyline.power:
            return self.whole()
        return self.swept(translate_copies(LONG * float(np.ptp(self.line, axis=0).max())), is_closed=False)

    def narrow(self) -> Body:
        """Return the surface between two copies of the polyline so close that triangles are as accurate as segments."""
        copies = (
            rotate_copies(np.array([0.0, NARROW]))
            if self.polyline.power
            else translate_copies(NARROW * self.cloud.spacing)
        )
        return self.swept(copies, is_closed=False)

    def swept(self, copies: "Placements", is_closed: bool) -> Body:
        """Return the triangulated surface between copies of the polyline.

        Args:
            copies: Placements of the copies, ordered along +y.
            is_closed: Whether the last copy is joined to the first.
        """
        rotations, shifts = copies.rotations, copies.shifts
        polyline, count, number_of_copies = self.polyline, self.cloud.surface_count, len(rotations)
        single = (self.line[:, 0] == 0.0) & bool(polyline.power)
        number = (
            np.cumsum(np.where(single, 1, number_of_copies))[:, None] - np.where(single, 1, number_of_copies)[:, None]
        )
        number = number + np.where(single[:, None], 0, np.arange(number_of_copies))
        along = np.arange(count) if polyline.is_closed else np.arange(count - 1)
        around = np.arange(number_of_copies) if is_closed else np.arange(number_of_copies - 1)
        k, j = (grid.ravel() for grid in np.meshgrid(along, around, indexing="ij"))
        after, next_copy = (k + 1) % count, (j + 1) % number_of_copies
        a, b, c, d = number[k, j], number[k, next_copy], number[after, next_copy], number[after, j]
        triangles = np.concatenate((np.column_stack((a, b, c)), np.column_stack((a, c, d)))).astype(np.int32)
        triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]

        def copied(field: Floats, moves: Floats) -> Floats:
            turned = np.einsum("mcd,kd->kmc", rotations, field[:count]) + moves
            surface = np.zeros((int(number.max()) + 1, 3))
            surface[number] = turned
            return np.concatenate((surface, field[count:]))

        points = copied(self.points, shifts)
        pressure = np.concatenate((np.zeros(len(points) - len(self.points) + count), self.pressure[count:]))
        pressure[number] = self.pressure[:count, None]
        wall = np.full(len(points), -1, np.int8)
        wall[len(points) - len(self.points) + count :] = self.cloud.wall[count:]
        wetted = number[0] if polyline.power else np.concatenate((number[0], number[-1, ::-1]))
        rings = (wetted.astype(np.int32),) if self.plates else ()
        wall[np.concatenate([*rings, NO_TRIANGLES[:, 0]])] = 0
        first = int(number.max()) + 1
        cloud = Cloud(points, first, triangles, rings, self.plates, wall, self.cloud.spacing)
        velocity, volumes = copied(self.velocity, np.zeros_like(shifts)), np.zeros(len(points))
        return Body(cloud, points, velocity, pressure, self.surface_pressure, triangles, volumes, self.plates)


def as_section(body: Body) -> Section:
    """Return a body unchanged, typed as a two-dimensional body in section.

    Args:
        body: Liquid body, which must be a ``Section``: a drop whose free surface is a polyline in the plane y = 0.

    Raises:
        TypeError: The body is not a section.
    """
    if not isinstance(body, Section):
        raise TypeError("forces and steps in section require a body in section")
    return body


@dataclass(frozen=True, slots=True)
class Placements:
    """Placements of m copies of a section in space.

    Attributes:
        rotations: Rotation matrices, shape (m, 3, 3).
        shifts: Translations, shape (m, 3) [m].
    """

    rotations: Floats
    shifts: Floats


def rotate_copies(angles: Floats) -> Placements:
    """Return the placements of copies of a section rotated about the z axis.

    Args:
        angles: Angle of each copy, shape (m,) [rad].

    Returns:
        Rotation and translation of each copy; the translations are zero.
    """
    cosine, sine, none = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    rows = [[cosine, -sine, none], [sine, cosine, none], [none, none, none + 1.0]]
    return Placements(np.moveaxis(np.array(rows), 2, 0), np.zeros((len(angles), 3)))


def translate_copies(depth: float) -> Placements:
    """Return the placements of two copies of a plane section, half of ``depth`` [m] to either side of it along y."""
    shifts = depth * np.array([[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]])
    return Placements(np.broadcast_to(np.eye(3), (2, 3, 3)), shifts)


def fill_block(polyline: Polyline, width: float, height: float, count: int) -> Cloud:
    """Return the cloud of a rectangle: a lattice of particles in the plane y = 0 on the wall z = 0.

    The first particles below the surface are half a spacing off the axis: each has a pressure that keeps its volume,
    and on the axis only one velocity component, so that a column of them would lock.

    Args:
        polyline: Meridian, of which only the part x >= 0 is filled, or open section of a plane drop.
        width: Half width [m].
        height: Height [m].
        count: Number of particles along the height.

    Returns:
        Particles, with the vertices of the surface as polyline segments and the contact points on the wall.
    """
    last = count - 1
    across = max(3, round(width / height * last))
    columns = np.linspace(0.5, across - 1.0, across - 1) if polyline.power else np.arange(1.0 - across, across)
    x, z = (grid.ravel() for grid in np.meshgrid(columns, np.arange(last), indexing="ij"))
    up = [(across, level) for level in range(count)]
    over = [(column, last) for column in range(across - 1, (-1 if polyline.power else -across - 1), -1)]
    down = [] if polyline.power else [(-across, level) for level in range(last - 1, -1, -1)]
    surface = np.array(up + over + down)
    lattice = np.concatenate((surface, np.column_stack((x, z))))
    points = np.column_stack(
        (lattice[:, 0] * (width / across), np.zeros(len(lattice)), lattice[:, 1] * (height / last))
    )
    wall = np.where(lattice[:, 1] == 0, 0, -1).astype(np.int8)
    contact = np.array([0] if polyline.power else [0, len(surface) - 1], np.int32)
    axes = (0,) if polyline.power else ()
    walls = ((contact,), (Plate.horizontal(0.0),))
    return Cloud(points, len(surface), NO_TRIANGLES, *walls, wall, height / last, axes)


def fill_disc(polyline: Polyline, radius: float, rings: int) -> Cloud:
    """Return the cloud of a free disc: concentric circles of particles, half circles off the axis for a meridian.

    Args:
        polyline: Meridian, or closed section of a plane drop.
        radius: Radius of the outer circle [m].
        rings: Number of circles.

    Returns:
        Particles, with the vertices of the surface as polyline segments; without contact points.
    """
    shells = []
    for ring in range(rings, 0, -1):
        arcs = max(2, round(np.pi * ring))
        turn = np.pi * np.arange(2 * arcs) / arcs
        if polyline.power:
            turn = np.pi * ((np.arange(arcs + 1) if ring == rings else np.arange(arcs) + 0.5) / arcs - 0.5)
        circle = np.column_stack((np.cos(turn), np.zeros(len(turn)), np.sin(turn))) * (radius * ring / rings)
        shells.append(circle)
    if polyline.power:
        shells[0][[0, -1], 0] = 0.0
    else:
        shells.append(np.zeros((1, 3)))
    points = np.concatenate(shells)
    wall = np.full(len(points), -1, np.int8)
    axes = (0,) if polyline.power else ()
    return Cloud(points, len(shells[0]), NO_TRIANGLES, (), (), wall, radius / rings, axes)
