"""Tracked free surface of a liquid: triangles that the particles carry, and the forces of its energy on the particles.

The vertices of the surface (``surface/surface_mesh.py``) move with the particles near them and hand their forces over
to them by the same weights (``surface_coupling.py``). The surface loses the work that the particles gain, so a drop
comes to rest. The forces are those of surface tension and wetting (``capillary_forces.py``).

The pressure that balances the tension of the whole surface does nothing else in a body of liquid, so it is removed from
both: vertices have the forces of E - p V, and particles only the rest of their pressure, which vanishes at rest. Hence
neither the incomplete sums of particles at a free surface, which carry too little of a pressure, nor the stiffness of a
lattice of particles under pressure matters; no parameter is fitted. Where that pressure is negative particles would
cluster; they are shifted towards lower concentration (``simulation.py``), and the surface stands for the neighbours
that they lack.

Triangles are remeshed every few steps (``surface/remeshing.py``). Liquids whose surfaces are closer than a particle
spacing merge; volume is restored, and particles and their momentum are not changed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.sph.capillary_forces import Capillarity
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.smoothing import SUPPORT
from reflowshock.particles.sph.surface_coupling import OWN, SurfaceCoupling, distribute
from reflowshock.particles.sph.thin_films import add_wall_friction, sum_film_surface
from reflowshock.particles.surface import ground as solid_ground
from reflowshock.particles.surface.breakup import are_outside
from reflowshock.particles.surface.level_set import LevelSet
from reflowshock.particles.surface.morphological_closing import TopologyChange
from reflowshock.particles.surface.remeshing import SurfaceRemeshing
from reflowshock.particles.surface.surface_mesh import SurfaceLost, SurfaceMesh

# Largest share of vertices without a particle within the kernel support; these follow the nearest particle. In an
# impact at a Weber number of 1000 whose rim breaks up, the share is at most 0.003.
MOST_ALONE = 0.1


@dataclass(slots=True)
class LiquidSurface:
    """Free surface of a liquid, closed by the wall z = 0 if there is one.

    Attributes:
        mesh: Triangles of the surface.
        capillarity: Surface tension and contact angles.
        coupling: Particles near each vertex.
        remeshing: What was changed in the triangles.
        pressure: Uniform pressure of the liquid in addition to the particle pressures [Pa].
        spray: Volume of the particles outside the surface [m^3].
    """

    mesh: SurfaceMesh
    capillarity: Capillarity
    coupling: SurfaceCoupling = field(init=False)
    remeshing: SurfaceRemeshing = field(default_factory=SurfaceRemeshing)
    pressure: float = 0.0
    spray: float = 0.0

    def __post_init__(self) -> None:
        self.coupling = SurfaceCoupling(self.law)

    def saved(self) -> dict[str, Any]:
        """Return the state, for a checkpoint."""
        return {
            "mesh": self.mesh.saved(), "remeshing": self.remeshing.saved(), "built_at": self.coupling.built_at,
            "shares": self.coupling.shares, "pressure": self.pressure, "spray": self.spray,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.mesh.restore(saved["mesh"])
        self.remeshing.restore(saved["remeshing"])
        self.pressure, self.spray = saved["pressure"], saved["spray"]
        self.coupling.restore(self.mesh, saved["built_at"], saved["shares"])

    @property
    def law(self) -> Law:
        """Parameters of the pair interactions."""
        return self.capillarity.law

    @property
    def points(self) -> Floats:
        """Vertices, shape (m, 3) [m]."""
        return self.mesh.points

    @property
    def triangles(self) -> Indices:
        """Outward oriented triangles, shape (t, 3)."""
        return self.mesh.triangles

    @property
    def tension(self) -> float:
        """Surface tension [N/m]."""
        return self.capillarity.tension

    @property
    def volume(self) -> float:
        """Volume enclosed with the wall [m^3]."""
        return self.mesh.volume

    @property
    def wetted_area(self) -> float:
        """Area of the wall within the contact lines [m^2]."""
        return self.mesh.wetted_area

    @property
    def energy(self) -> float:
        """Surface energy [J]."""
        return self.capillarity.energy(self.mesh)

    @property
    def needs_volume(self) -> bool:
        """Whether the next ``move`` remeshes, and so needs the volume of the liquid."""
        return self.remeshing.is_due_next

    @property
    def topology_changes(self) -> list[TopologyChange]:
        """Merged and separated liquids."""
        return self.remeshing.topology_changes

    @property
    def detachments(self) -> int:
        """Number of events in which parts too small for particles lost their surface."""
        return self.remeshing.detachments

    def add(self, points: Floats, triangles: Indices) -> None:
        """Add the surface of separate liquid, with vertices (k, 3) [m] and triangles (t, 3)."""
        self.mesh.add(points, triangles)

    def take_out(self, vertices: NDArray[np.bool_]) -> tuple[Floats, Indices]:
        """Remove the connected parts of the selected vertices, shape (m,), and return their vertices and triangles."""
        return self.mesh.take_out(vertices)

    def lie_on(self, ground: LevelSet | None) -> None:
        """Set the ground on which the surface may lie; the particles that carry the surface may change, too."""
        self.spray = 0.0
        self.mesh.lie_on(ground)

    def enclose(self, volume: float) -> None:
        """Move all vertices along their normals by one distance, so that the surface encloses a volume [m^3]."""
        self.mesh.enclose(volume)

    def forces(self, drift: Floats | None = None) -> Floats:
        """Compute the forces on the vertices, shape (m, 3) [N], and store the pressure that balances them.

        Args:
            drift: As for ``Capillarity.forces``.
        """
        forces, self.pressure = self.capillarity.forces(self.mesh, drift)
        return forces

    def add_to(self, rates: Floats, fields: Fields, carriers: int) -> None:
        """Add the effects of the surface to the rates of the liquid.

        Accelerations are added to rows 1 to 3 of the rates. The surface is added to the concentration gradients in rows
        7 to 9, which vanish near it, too, where particles are evenly spaced. On solid ground the image of the surface
        is added, since wall particles stand for the image of the liquid.

        Args:
            rates: Rates of the liquid, shape (10, n).
            fields: Fields of all particles.
            carriers: Number of particles that carry the surface, the liquid's first.

        Raises:
            SurfaceLost: Much of the surface has no particles near it.
        """
        self.coupling.update(self.mesh, [coordinate[:carriers] for coordinate in fields[:3]])
        self._cover(fields)
        weights, levels = self.coupling.weights(self.mesh.points, fields)
        if (alone := float((levels == 0.0).mean())) > MOST_ALONE:
            raise SurfaceLost(f"the liquid has left its surface, {alone:.0%} of it")
        self.coupling.shares, lists = weights[0], self.coupling.lists
        outward = self.mesh.outward_areas()
        sums = np.zeros((2, 3, carriers))
        drift = self.capillarity.relative_drift(self.coupling.velocities(fields)) if self.capillarity.bounds else None
        distribute(lists, weights, np.array((self.forces(drift), outward)), sums)
        if self.law.mirror and self.law.no_slip:
            films = sum_film_surface(self.mesh.points, self.mesh.normals(), lists, weights[1, 0], len(fields.x))
            add_wall_friction(films, fields, self.law, rates)
        if self.mesh.ground is not None:
            reach = SUPPORT * self.law.length
            images, outward = solid_ground.reflect_at_ground(self.mesh.ground, self.mesh.points, outward, reach)
            weights, _ = self.coupling.weights(images, fields)
            distribute(lists, weights[1:], outward[None], sums[1:])
        fluids = rates.shape[1]
        rates[1:4] += sums[0, :, :fluids] / fields.mass[:fluids]
        rates[7:10] += sums[1, :, :fluids]

    def _cover(self, fields: Fields) -> None:
        """Move vertices that particles pass or leave behind, at the rim of a film; the volume is kept."""
        normals = self.mesh.normals()
        distances = self.coupling.distances_to_cover(self.mesh.points, normals, fields)
        if self.mesh.ground is not None:
            distances[self.mesh.wetness > 0.0] = 0.0
        if distances.any():
            volume = self.volume
            self.mesh.points += distances[:, None] * normals
            self.enclose(volume)
            self.mesh.settle_on_ground()

    def move(self, velocity: Floats, time_step: float, volume: float) -> None:
        """Move with the particles over a time step, and remesh every few steps.

        Args:
            velocity: Velocities of the particles that carry the surface, shape (3, n) [m/s].
            time_step: Time step [s].
            volume: Volume of the liquid within the surface before the step [m^3], restored after remeshing.
        """
        self.coupling.carry(self.mesh, velocity, time_step)
        self.remeshing.steps += 1
        if self.law.mirror:
            self.mesh.settle_on_wall()
        if self.remeshing.is_due:
            self.remeshing.remesh(self.mesh, bool(velocity[2].mean() > 0.0), self.capillarity.energy)
            detached = self.remeshing.detach_small_parts(self.mesh)
            self.spray += detached
            self.enclose(volume - detached)
        self.mesh.settle_on_ground()

    def find_spray(self, positions: Sequence[Floats], volumes: Floats) -> None:
        """Find the volume of the particles outside the surface.

        Args:
            positions: Rows x, y, z of the particles, shape (3, n) [m].
            volumes: Volumes of the particles, shape (n,) [m^3].
        """
        distance = OWN * self.law.spacing
        is_outside = are_outside(
            np.stack(positions, 1), self.mesh.points, self.mesh.triangles, self.mesh.normals(), distance
        )
        self.spray = float(volumes[is_outside].sum())
