"""A body in section: particles in the plane y = 0, of which the first are the vertices of a chain.

Fields have three components, the one along y is zero, so that steps, time integration and forces are those of bodies.
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
NARROW = 1e-3  # [rad], or spacings
LONG = 100.0  # times the width or height
MERIDIANS = 64  # around the axis, of the triangles that a body is shown with


@dataclass(slots=True)
class Section(Body):
    """State of a body in section; volumes are those of half a body of revolution, or of a piece in a plane.

    Attributes:
        chain: what the surface stands for.
    """

    chain: Polyline

    @classmethod
    def filled(cls, cloud: Cloud, chain: Polyline) -> "Section":
        """Start at rest from a cloud."""
        count = len(cloud.points)
        still = (np.zeros((count, 3)), np.zeros(count), 0.0)
        return cls(cloud, cloud.points.copy(), *still, cloud.triangles, np.zeros(count), cloud.plates, chain)

    @property
    def line(self) -> Floats:
        """The surface `(s, 3)` [m]."""
        return self.points[: self.cloud.surface_count]

    def on_particles(self, field: Floats) -> Floats:
        """A field of the surface `(s, 3)`, zero below it, `(n, 3)`."""
        result = np.zeros_like(self.points)
        result[: len(field)] = field
        return result

    def volume(self) -> tuple[float, Floats]:
        """Enclosed volume [m^3] and its gradient `(n, 3)` [m^2]."""
        volume, gradient = self.chain.integral(self.line, 0, 0)
        return volume, self.on_particles(gradient)

    def moments(self) -> tuple[float, Floats, Floats]:
        """Integrals of 1, x `(3,)` and x x `(3, 3)` over the part of the liquid that the section stands for, y = 0."""

        def integral(p: int, q: int) -> float:
            return self.chain.integral(self.line, p, q)[0]

        xz = integral(1, 1)
        second = np.array([[integral(2, 0), 0.0, xz], [0.0, 0.0, 0.0], [xz, 0.0, integral(0, 2)]])
        return integral(0, 0), np.array([integral(1, 0), 0.0, integral(0, 1)]), second

    def whole(self) -> Body:
        """The body with triangles: a meridian turned about its axis, a plane as deep as its piece and without ends.

        The particles below the surface stay in the section.
        """
        if self.chain.power:
            return self.swept(turns(2.0 * np.pi * np.arange(MERIDIANS) / MERIDIANS), is_closed=True)
        return self.swept(sheets(self.chain.factor), is_closed=False)

    def enclosing(self) -> Body:
        """The body with triangles around all of it; a plane so long that its ends are out of sight."""
        if self.chain.power:
            return self.whole()
        return self.swept(sheets(LONG * float(np.ptp(self.line, axis=0).max())), is_closed=False)

    def narrow(self) -> Body:
        """The surface between two copies of the chain so close that triangles are as exact as it is."""
        copies = turns(np.array([0.0, NARROW])) if self.chain.power else sheets(NARROW * self.cloud.spacing)
        return self.swept(copies, is_closed=False)

    def swept(self, places: tuple[Floats, Floats], is_closed: bool) -> Body:
        """The surface between copies of the chain, one after the other in the sense of y.

        Args:
            places: rotation `(m, 3, 3)` and translation `(m, 3)` [m] of each copy.
            is_closed: whether the first copy follows the last.
        """
        rotations, shifts = places
        chain, count, copies = self.chain, self.cloud.surface_count, len(rotations)
        single = (self.line[:, 0] == 0.0) & bool(chain.power)
        number = np.cumsum(np.where(single, 1, copies))[:, None] - np.where(single, 1, copies)[:, None]
        number = number + np.where(single[:, None], 0, np.arange(copies))
        along = np.arange(count) if chain.is_closed else np.arange(count - 1)
        around = np.arange(copies) if is_closed else np.arange(copies - 1)
        k, j = (grid.ravel() for grid in np.meshgrid(along, around, indexing="ij"))
        after, beside = (k + 1) % count, (j + 1) % copies
        a, b, c, d = number[k, j], number[k, beside], number[after, beside], number[after, j]
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
        wetted = number[0] if chain.power else np.concatenate((number[0], number[-1, ::-1]))
        rings = (wetted.astype(np.int32),) if self.plates else ()
        wall[np.concatenate([*rings, NO_TRIANGLES[:, 0]])] = 0
        first = int(number.max()) + 1
        cloud = Cloud(points, first, triangles, rings, self.plates, wall, self.cloud.spacing)
        velocity, volumes = copied(self.velocity, np.zeros_like(shifts)), np.zeros(len(points))
        return Body(cloud, points, velocity, pressure, self.surface_pressure, triangles, volumes, self.plates)


def as_section(body: Body) -> Section:
    """The same body, for what acts on sections alone.

    Raises:
        TypeError: it is none.
    """
    if not isinstance(body, Section):
        raise TypeError("the forces and steps of a section act on no other body")
    return body


def turns(angles: Floats) -> tuple[Floats, Floats]:
    """Rotations about the z axis by angles `(m,)` [rad], and no translations."""
    cosine, sine, none = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    rows = [[cosine, -sine, none], [sine, cosine, none], [none, none, none + 1.0]]
    return np.moveaxis(np.array(rows), 2, 0), np.zeros((len(angles), 3))


def sheets(depth: float) -> tuple[Floats, Floats]:
    """Two places a depth apart along y [m], about the plane of the section."""
    return np.broadcast_to(np.eye(3), (2, 3, 3)), depth * np.array([[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]])


def block(chain: Polyline, width: float, height: float, count: int) -> Cloud:
    """A lattice on the wall z = 0.

    Below the surface none lie on the axis, the first are half a spacing away: each particle has a pressure that keeps
    its volume, and on the axis one velocity only, so that a column of them locks.

    Args:
        chain: of a meridian, where only the part x >= 0 is filled, or of an open plane.
        width: from the middle to the sides [m].
        height: [m].
        count: particles along the height.
    """
    last = count - 1
    across = max(3, round(width / height * last))
    columns = np.linspace(0.5, across - 1.0, across - 1) if chain.power else np.arange(1.0 - across, across)
    x, z = (grid.ravel() for grid in np.meshgrid(columns, np.arange(last), indexing="ij"))
    up = [(across, level) for level in range(count)]
    over = [(column, last) for column in range(across - 1, (-1 if chain.power else -across - 1), -1)]
    down = [] if chain.power else [(-across, level) for level in range(last - 1, -1, -1)]
    surface = np.array(up + over + down)
    lattice = np.concatenate((surface, np.column_stack((x, z))))
    points = np.column_stack(
        (lattice[:, 0] * (width / across), np.zeros(len(lattice)), lattice[:, 1] * (height / last))
    )
    wall = np.where(lattice[:, 1] == 0, 0, -1).astype(np.int8)
    contact = np.array([0] if chain.power else [0, len(surface) - 1], np.int32)
    axes = (0,) if chain.power else ()
    walls = ((contact,), (Plate.horizontal(0.0),))
    return Cloud(points, len(surface), NO_TRIANGLES, *walls, wall, height / last, axes)


def disc(chain: Polyline, radius: float, rings: int) -> Cloud:
    """Circles about a particle at the origin, half circles of a meridian, as in `block`; no wall touches it.

    Args:
        chain: of a meridian or of a closed plane.
        radius: of the polygon's vertices [m].
        rings: number of circles.
    """
    shells = []
    for ring in range(rings, 0, -1):
        arcs = max(2, round(np.pi * ring))
        turn = np.pi * np.arange(2 * arcs) / arcs
        if chain.power:
            turn = np.pi * ((np.arange(arcs + 1) if ring == rings else np.arange(arcs) + 0.5) / arcs - 0.5)
        circle = np.column_stack((np.cos(turn), np.zeros(len(turn)), np.sin(turn))) * (radius * ring / rings)
        shells.append(circle)
    if chain.power:
        shells[0][[0, -1], 0] = 0.0
    else:
        shells.append(np.zeros((1, 3)))
    points = np.concatenate(shells)
    wall = np.full(len(points), -1, np.int8)
    axes = (0,) if chain.power else ()
    return Cloud(points, len(shells[0]), NO_TRIANGLES, (), (), wall, radius / rings, axes)
