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
from reflowshock.particles.section.chain import Chain

NO_TRIANGLES = np.zeros((0, 3), np.int32)


@dataclass(slots=True)
class Section(Body):
    """State of a body in section; volumes are those of half a body of revolution, or of a unit depth.

    Attributes:
        chain: what the surface stands for.
    """

    chain: Chain

    @classmethod
    def filled(cls, cloud: Cloud, chain: Chain) -> "Section":
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


def block(chain: Chain, height: float, count: int) -> Cloud:
    """A lattice on the wall z = 0, as high as it is wide from its middle.

    Args:
        chain: of a meridian, where only the part x >= 0 is filled, or of an open plane.
        height: [m].
        count: particles along the height.
    """
    last = count - 1
    columns = np.arange(0 if chain.power else -last, last + 1)
    x, z = (grid.ravel() for grid in np.meshgrid(columns, np.arange(count), indexing="ij"))
    up = [(last, level) for level in range(count)]
    over = [(column, last) for column in columns[-2::-1]]
    down = [] if chain.power else [(-last, level) for level in range(last - 1, -1, -1)]
    surface = np.array(up + over + down)
    inside = (z < last) & (x < last) & (x > (-1 if chain.power else -last))
    lattice = np.concatenate((surface, np.column_stack((x, z))[inside]))
    points = np.column_stack((lattice[:, 0], np.zeros(len(lattice)), lattice[:, 1])) * (height / last)
    wall = np.where(lattice[:, 1] == 0, 0, -1).astype(np.int8)
    axes = (0,) if chain.power else ()
    return Cloud(points, len(surface), NO_TRIANGLES, (), (Plate.horizontal(0.0),), wall, height / last, axes)


def disc(chain: Chain, radius: float, rings: int) -> Cloud:
    """Circles about a particle at the origin, half circles of a meridian; no wall touches it.

    Args:
        chain: of a meridian or of a closed plane.
        radius: of the polygon's vertices [m].
        rings: number of circles.
    """
    shells = []
    for ring in range(rings, 0, -1):
        arcs = max(2, round(np.pi * ring))
        turn = np.pi * (np.arange(arcs + 1) / arcs - 0.5) if chain.power else np.pi * np.arange(2 * arcs) / arcs
        circle = np.column_stack((np.cos(turn), np.zeros(len(turn)), np.sin(turn))) * (radius * ring / rings)
        if chain.power:
            circle[[0, -1], 0] = 0.0
        shells.append(circle)
    points = np.concatenate([*shells, np.zeros((1, 3))])
    wall = np.full(len(points), -1, np.int8)
    axes = (0,) if chain.power else ()
    return Cloud(points, len(shells[0]), NO_TRIANGLES, (), (), wall, radius / rings, axes)
