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
        cloud: Initial cloud; its rings, walls and counts stay valid.
        points: Positions, shape (n, 3) [m].
        velocity: Velocities, shape (n, 3) [m/s].
        pressure: Pressure above the ambient pressure, shape (n,) [Pa].
        surface_pressure: Lagrange multiplier of the volume constraint [Pa].
        triangles: Current triangles of the free surface, shape (t, 3).
        volumes: Share of each particle in the volume, shape (n,) [m^3].
        plates: Plates under the contact lines at their current positions.
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
        """Create a body at rest from its initial cloud."""
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
        """Particles below the free surface, those on walls included, shape (m,)."""
        return np.arange(self.cloud.surface_count, len(self.points), dtype=np.int32)

    def move(self, time_step: float, velocity: Floats, twists: dict[int, Floats]) -> None:
        """Move particles and plates over a time step.

        Args:
            time_step: Time step [s].
            velocity: Velocities of the particles, shape (n, 3) [m/s].
            twists: Velocity and angular velocity of plates by their index, shape (6,) [m/s, rad/s].
        """
        displacements = {wall: time_step * twist for wall, twist in twists.items()}
        placed = self.placed(self.points + time_step * velocity, displacements)
        self.points, self.plates = placed.points, placed.plates

    def placed(self, points: Floats, displacements: Mapping[int, Floats]) -> "Body":
        """Return the body with its particles at new positions and its plates moved.

        Particles on moved plates are projected onto the planes of these plates.

        Args:
            points: New positions of the particles, shape (n, 3) [m].
            displacements: Displacement and rotation vector of plates by their index, shape (6,) [m, rad].
        """
        points, plates = points.copy(), list(self.plates)
        for wall, displacement in displacements.items():
            plate, plates[wall] = plates[wall], plates[wall].moved(displacement)
            on_plate = self.cloud.wall == wall
            local = plate.local(points[on_plate] - plate.rigid_velocity(displacement, self.points[on_plate]))
            points[on_plate] = plates[wall].place(local * np.array([1.0, 1.0, 0.0]))
        return replace(self, points=points, plates=tuple(plates))

    def surface(self) -> "Body":
        """Return the free surface as a body without the particles below it."""
        count = self.cloud.surface_count
        cloud = replace(self.cloud, points=self.cloud.points[:count], wall=self.cloud.wall[:count])
        parts = (self.points[:count], self.velocity[:count], self.pressure[:count])
        return Body(cloud, *parts, self.surface_pressure, self.triangles, self.volumes[:count], self.plates)

    def moments(self) -> tuple[float, Floats, Floats] | None:
        """Return the integrals of 1, x (3,) and x x (3, 3) over the liquid, or None if the triangles determine them."""
        return None

    def whole(self) -> "Body":
        """Return the body with all its triangles; a section returns the body of which it is a part."""
        return self

    def enclosing(self) -> "Body":
        """Return the body with triangles around all of it except walls and planes of symmetry."""
        return self

    def span(self) -> tuple[float, float]:
        """Return the lowest and highest height of horizontal sections that cut the surface but no plate [m]."""
        z, rings = self.points[: self.cloud.surface_count, 2], self.cloud.rings
        sides = [(plate.side, z[ring]) for plate, ring in zip(self.plates, rings, strict=True)]
        low = max((float(line.max()) for side, line in sides if side < 0.0), default=float(z.min()))
        high = min((float(line.min()) for side, line in sides if side > 0.0), default=float(z.max()))
        return low, high

    def volume(self) -> tuple[float, Floats]:
        """Return the enclosed volume [m^3] and its gradient, shape (n, 3) [m^2]."""
        return volume_and_gradient(self.points, self.triangles, self.cloud.rings, self.plates)


def particle_volumes(cloud: Cloud, volume: float) -> Floats:
    """Return each particle's share of a volume, shape (n,) [m^3]; the shares sum to the volume.

    A particle inside has a whole cell, one on the surface or a wall half a cell, one on a contact line a quarter;
    planes of symmetry halve it, too.

    Args:
        cloud: Particles of the body, with the numbers of surface particles, walls and contact lines.
        volume: Volume of the computed part of the body [m^3].
    """
    on_surface = np.arange(len(cloud.points)) < cloud.surface_count
    part = symmetry.share(cloud) * np.where(on_surface, 0.5, 1.0) * np.where(cloud.wall >= 0, 0.5, 1.0)
    return part * (volume / part.sum())
