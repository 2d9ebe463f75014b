"""The liquid body while it flows: positions, velocities, pressures and the current triangles."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core import symmetry
from reflowshock.particles.core.cloud import Cloud
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.core.surface_measure import volume_and_gradient


@dataclass(slots=True)
class Body:
    """State of a liquid body.

    Attributes:
        cloud: the initial cloud; its rings, walls and counts hold throughout.
        points: `(n, 3)` [m].
        velocity: `(n, 3)` [m/s].
        pressure: `(n,)` above the ambient pressure [Pa].
        surface_pressure: pressure that carries the volume constraint [Pa].
        triangles: `(t, 3)` current free surface.
        volumes: `(n,)` share of each particle in the volume [m^3].
        plates: the plates under the contact lines, where they are now.
    """

    cloud: Cloud
    points: Floats
    velocity: Floats
    pressure: Floats
    surface_pressure: float
    triangles: Indices
    volumes: Floats
    plates: tuple[Plate, ...]

    @classmethod
    def at_rest(cls, cloud: Cloud) -> "Body":
        """Start a body at rest from its initial cloud."""
        count = len(cloud.points)
        body = cls(
            cloud=cloud,
            points=cloud.points.copy(),
            velocity=np.zeros((count, 3)),
            pressure=np.zeros(count),
            surface_pressure=0.0,
            triangles=cloud.triangles,
            volumes=np.zeros(count),
            plates=cloud.plates,
        )
        body.volumes = particle_volumes(cloud, body.volume()[0])
        return body

    @property
    def interior(self) -> Indices:
        """The particles below the free surface, those on the walls included, `(m,)`."""
        return np.arange(self.cloud.surface_count, len(self.points), dtype=np.int32)

    def move(self, time_step: float, velocity: Floats, twists: dict[int, Floats]) -> None:
        """Displace particles by a velocity `(n, 3)` [m/s], plates by their twists `(6,)` with what they carry."""
        ways = {wall: time_step * twist for wall, twist in twists.items()}
        placed = self.placed(self.points + time_step * velocity, ways)
        self.points, self.plates = placed.points, placed.plates

    def placed(self, points: Floats, ways: Mapping[int, Floats]) -> "Body":
        """The body with its particles at points `(n, 3)` [m], those on plates that have moved on their planes.

        Args:
            points: where the particles have gone.
            ways: `(6,)` displacement and rotation of plates, by their index [m, rad].
        """
        points, plates = points.copy(), list(self.plates)
        for wall, way in ways.items():
            plate, plates[wall] = plates[wall], plates[wall].moved(way)
            on_plate = self.cloud.wall == wall
            local = plate.local(points[on_plate] - plate.rigid_velocity(way, self.points[on_plate]))
            points[on_plate] = plates[wall].place(local * np.array([1.0, 1.0, 0.0]))
        return replace(self, points=points, plates=tuple(plates))

    def surface(self) -> "Body":
        """The free surface alone: a body without the particles below it."""
        count = self.cloud.surface_count
        cloud = replace(self.cloud, points=self.cloud.points[:count], wall=self.cloud.wall[:count])
        parts = (self.points[:count], self.velocity[:count], self.pressure[:count])
        return Body(cloud, *parts, self.surface_pressure, self.triangles, self.volumes[:count], self.plates)

    def moments(self) -> tuple[float, Floats, Floats] | None:
        """Integrals of 1, x `(3,)` and x x `(3, 3)` over the liquid, where triangles do not tell them."""
        return None

    def whole(self) -> "Body":
        """The body with its triangles, as products have it: itself, where it is not a section of one."""
        return self

    def enclosing(self) -> "Body":
        """The body with triangles around all of it, walls and planes of symmetry besides."""
        return self

    def span(self) -> tuple[float, float]:
        """Heights [m] between which horizontal sections cut the surface, but no plate, tilted ones neither."""
        z, rings = self.points[: self.cloud.surface_count, 2], self.cloud.rings
        sides = [(plate.side, z[ring]) for plate, ring in zip(self.plates, rings, strict=True)]
        low = max((float(line.max()) for side, line in sides if side < 0.0), default=float(z.min()))
        high = min((float(line.min()) for side, line in sides if side > 0.0), default=float(z.max()))
        return low, high

    def volume(self) -> tuple[float, Floats]:
        """Enclosed volume [m^3] and its gradient `(n, 3)` [m^2]."""
        return volume_and_gradient(self.points, self.triangles, self.cloud.rings, self.plates)


def particle_volumes(cloud: Cloud, volume: float) -> Floats:
    """Shares of the volume: a whole cell inside, half a cell on a surface or wall, a quarter on a contact line."""
    on_surface = np.arange(len(cloud.points)) < cloud.surface_count
    part = symmetry.share(cloud) * np.where(on_surface, 0.5, 1.0) * np.where(cloud.wall >= 0, 0.5, 1.0)
    return part * (volume / part.sum())
