"""The liquid body while it flows: positions, velocities, pressures and the current triangles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from particles.cloud import Cloud
from particles.surface_measure import volume_and_gradient

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]


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
    """

    cloud: Cloud
    points: Floats
    velocity: Floats
    pressure: Floats
    surface_pressure: float
    triangles: Indices
    volumes: Floats

    @classmethod
    def at_rest(cls, cloud: Cloud) -> "Body":
        """Start a body at rest from its initial cloud."""
        count = len(cloud.points)
        body = cls(
            cloud, cloud.points.copy(), np.zeros((count, 3)), np.zeros(count), 0.0, cloud.triangles, np.zeros(count)
        )
        body.volumes = particle_volumes(cloud, body.volume()[0])
        return body

    @property
    def interior(self) -> Indices:
        """The particles below the free surface, those on the walls included, `(m,)`."""
        return np.arange(self.cloud.surface_count, len(self.points), dtype=np.int32)

    def volume(self) -> tuple[float, Floats]:
        """Enclosed volume [m^3] and its gradient `(n, 3)` [m^2]."""
        return volume_and_gradient(self.points, self.triangles, self.cloud.rings, self.cloud.ring_heights)


def particle_volumes(cloud: Cloud, volume: float) -> Floats:
    """Shares of the volume: a whole cell inside, half a cell on a surface or wall, a quarter on a contact line."""
    on_surface = np.arange(len(cloud.points)) < cloud.surface_count
    share = np.where(on_surface, 0.5, 1.0) * np.where(cloud.wall >= 0, 0.5, 1.0)
    return share * (volume / share.sum())
