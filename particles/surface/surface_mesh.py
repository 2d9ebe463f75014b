"""Triangulated free surface of a liquid, closed by the wall z = 0 or lying on solid ground.

Where triangles end, on the wall, they have contact lines. On solid ground (``ground.py``), the surface stays closed:
its vertices have a wetness between 0 (free) and 1 (on the ground).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.surface_measure import volume_and_gradient
from reflowshock.particles.surface import ground as solid_ground
from reflowshock.particles.surface.breakup import with_contact_lines
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, area_within, boundary_loops
from reflowshock.particles.surface.level_set import LevelSet
from reflowshock.particles.surface.surface_quality import vertex_normals

# In particle spacings: triangles that face the wall wet it below the first height; a film thinner than the second,
# whose triangles face away from the wall, has opened.
TOUCH, DRY = 0.3, 0.1


class SurfaceLost(ArithmeticError):
    """The liquid has left its surface, or the triangles no longer form a surface."""


@dataclass(slots=True)
class SurfaceMesh:
    """Triangulated surface of a liquid.

    Attributes:
        points: Vertices, shape (m, 3) [m].
        triangles: Vertices of the triangles, outward oriented, shape (t, 3).
        spacing: Particle spacing [m].
        has_wall: Whether z = 0 is a wall.
        ground: Distance to solid bodies, negative inside them; None without solid bodies.
        rings: Contact lines as vertices, shape (k,) each, counter-clockwise around liquid seen from +z.
        wetness: Wetness of each vertex by the ground, shape (m,), 0 to 1.
        ground_normals: Unit normals of the ground at the vertices, shape (m, 3).
        revision: Number of times the vertices were renumbered.
    """

    points: Floats
    triangles: Indices
    spacing: float
    has_wall: bool
    ground: LevelSet | None = None
    rings: tuple[Indices, ...] = field(init=False)
    wetness: Floats = field(default_factory=lambda: np.empty(0))
    ground_normals: Floats = field(default_factory=lambda: np.empty((0, 3)))
    revision: int = 0

    def __post_init__(self) -> None:
        self.rings = boundary_loops(self.triangles)

    def saved(self) -> dict[str, Any]:
        """Return vertices, triangles and contact lines, for a checkpoint."""
        return {"points": self.points, "triangles": self.triangles, "rings": list(self.rings)}

    def restore(self, saved: dict[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.points, self.triangles, self.rings = saved["points"], saved["triangles"], tuple(saved["rings"])
        self.settle_on_ground()

    @property
    def volume(self) -> float:
        """Volume enclosed with the wall [m^3]."""
        return volume_and_gradient(self.points, self.triangles, (), ())[0]

    @property
    def wetted_area(self) -> float:
        """Area of the wall within the contact lines [m^2]."""
        return sum(area_within(self.points[ring]) for ring in self.rings)

    def triangle_wetness(self) -> Floats:
        """Return the wetness of each triangle by the ground, the least of its vertices, shape (t,)."""
        return self.wetness[self.triangles].min(axis=1)

    def outward_areas(self) -> Floats:
        """Return the area about each vertex times its outward normal, shape (m, 3) [m^2].

        Contact lines have no component across the wall, vertices on the ground none across the ground.
        """
        area = volume_and_gradient(self.points, self.triangles, (), ())[1]
        for ring in self.rings:
            area[ring, 2] = 0.0
        return area if self.ground is None else solid_ground.remove_normal_part(area, self.wetness, self.ground_normals)

    def normals(self) -> Floats:
        """Return outward unit normals, shape (m, 3): along the wall on contact lines, zero on the ground."""
        outward = self.outward_areas() * (1.0 if self.ground is None else (self.wetness < 1.0)[:, None])
        return outward / np.maximum(np.linalg.norm(outward, axis=1), 1e-300)[:, None]

    def ground_lines(self) -> tuple[Indices, ...]:
        """Return the contact lines on the ground, where the surface has an edge that smoothing would round off.

        Raises:
            CannotRebuild: Contact lines meet in a point.
        """
        if self.ground is None:
            return ()
        return boundary_loops(self.triangles[self.triangle_wetness() > 0.5])

    def replace(self, points: Floats, triangles: Indices) -> None:
        """Replace the triangles; vertices without triangles are dropped, contact lines that meet in a point separate.

        Raises:
            SurfaceLost: More than two triangles meet in an edge.
        """
        try:
            used, triangles, rings = with_contact_lines(triangles)
        except CannotRebuild as error:
            raise SurfaceLost("more than two sheets of the liquid's surface meet in an edge") from error
        self.points, self.triangles, self.rings = points[used], triangles, rings
        for ring in self.rings:
            self.points[ring, 2] = 0.0
        self.revision += 1
        self.settle_on_ground()

    def add(self, points: Floats, triangles: Indices) -> None:
        """Add a separate surface with vertices (k, 3) [m] and triangles (t, 3)."""
        triangles = np.concatenate((self.triangles, triangles + len(self.points)))
        self.replace(np.concatenate((self.points, points)), triangles)

    def take_out(self, vertices: NDArray[np.bool_]) -> tuple[Floats, Indices]:
        """Remove the connected parts of the selected vertices, shape (m,), and return their vertices and triangles."""
        is_removed = vertices[self.triangles[:, 0]]
        used, numbers = np.unique(self.triangles[is_removed], return_inverse=True)
        removed = self.points[used], numbers.reshape(-1, 3).astype(np.int32)
        self.replace(self.points, self.triangles[~is_removed])
        return removed

    def lie_on(self, ground: LevelSet | None) -> None:
        """Set the ground on which the surface may lie."""
        self.ground = ground
        self.replace(self.points, self.triangles)

    def settle_on_ground(self) -> None:
        """Move vertices that have reached the ground onto it and update the wetness of all vertices."""
        if self.ground is None or not len(self.points):
            return
        normals = vertex_normals(self.points, self.triangles, len(self.points))
        self.wetness, self.ground_normals = solid_ground.settle_on_ground(
            self.ground, self.points, normals, TOUCH * self.spacing
        )

    def settle_on_wall(self) -> None:
        """Keep vertices above the wall and contact lines on it; remove triangles that have reached it."""
        for ring in self.rings:
            self.points[ring, 2] = 0.0
        np.maximum(self.points[:, 2], 0.0, out=self.points[:, 2])
        flat = np.flatnonzero(have_reached_wall(self.points, self.triangles, self.spacing))
        if len(flat):
            self.replace(self.points, np.delete(self.triangles, flat, axis=0))

    def enclose(self, volume: float) -> None:
        """Move all vertices along their normals by one distance, so that the surface encloses a volume [m^3]."""
        self.points += self._volume_correction(volume)
        np.maximum(self.points[:, 2], 0.0 if self.has_wall else -np.inf, out=self.points[:, 2])

    def _volume_correction(self, volume: float) -> Floats:
        """Return the displacements of ``enclose``, shape (m, 3) [m]; contact lines move along the wall."""
        enclosed, gradient = volume_and_gradient(self.points, self.triangles, (), ())
        for ring in self.rings:
            gradient[ring, 2] = 0.0
        size = np.linalg.norm(gradient, axis=1)
        return (volume - enclosed) / size.sum() * gradient / np.maximum(size, 1e-300)[:, None]


def have_reached_wall(points: Floats, triangles: Indices, spacing: float) -> NDArray[np.bool_]:
    """Return whether each triangle has reached the wall z = 0, shape (t,).

    Triangles that face the wall wet it at a height of ``TOUCH`` spacings; a film, whose triangles face away from the
    wall, opens only at ``DRY`` spacings.

    Args:
        points: Vertices, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        spacing: Particle spacing [m].
    """
    corner = points[triangles]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    faces_wall = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    return corner[:, :, 2].max(axis=1) <= np.where(faces_wall, TOUCH, DRY) * spacing
