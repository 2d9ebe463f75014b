"""Ink deposited on a plate: liquid, held and solid particles, and the surface of the bodies that have liquid.

A body is a connected part of the liquid's surface. A cured or frozen particle never moves again. It is held while some
of its body is liquid: it is fixed like a wall particle but still carries the surface. A body without liquid is solid:
it is removed from the simulation except for particles that liquid can reach, which act as walls.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import cos
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.flows.droplet_shape import start_shape
from reflowshock.particles.flows.printing import WITHIN_REACH, Printing
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.capillary_forces import Capillarity
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.heat import Heat, enthalpy_at
from reflowshock.particles.sph.liquid_surface import LiquidSurface
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.smoothing import SUPPORT, share_beyond_plane
from reflowshock.particles.sph_flows.droplet import liquid_of
from reflowshock.particles.surface.cloud_level_set import with_mirror_image
from reflowshock.particles.surface.level_set import LevelSet, signed_distance_in_band
from reflowshock.particles.surface.morphological_closing import part_of_vertex
from reflowshock.particles.surface.remeshing import EDGE
from reflowshock.particles.surface.surface_mesh import SurfaceMesh

LIQUID, HELD, SOLID = 0, 1, 2
# Distance between the surface of a new drop and particles below it, in spacings.
CLEARANCE = 1.1
# Relative tolerance of the dose that cures.
ROUNDING = 1e-9
# Node spacing of the level set of the ground, in particle spacings, and width of its band in nodes.
NODES, MARGIN = 0.75, 4


class CuredBody(NamedTuple):
    """A solid body.

    Attributes:
        points: Vertices of its surface, which ends on the plate, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        drop: Number of its last drop.
    """

    points: Floats
    triangles: Indices
    drop: int


@dataclass(slots=True)
class Deposit:
    """Ink on a plate.

    Attributes:
        scene: Printing parameters.
        fields: Fields of all particles, in the order of landing.
        state: State of each particle, ``LIQUID``, ``HELD`` or ``SOLID``, shape (n,).
        dose: Light dose of each particle, shape (n,) [J/m^2].
        enthalpy: Specific enthalpy of each particle, zero in the solid at the melting point, shape (n,) [J/kg].
        drop: Number of each particle's drop, shape (n,).
        bodies: Solid bodies, in the order in which they became solid.
        ground: Distance to the solid bodies, on a grid around the whole print.
        surface: Surface of the bodies that have liquid; empty if all ink is solid.
        simulation: Simulation of liquid and held particles; None if all ink is solid.
        order: Number of each particle of the simulation.
        heat: Heat of the particles of the simulation; None without freezing.
        time: Time [s].
        spray: Largest share of the liquid and held particles that was outside the surface at any time.
        law: Parameters of the pair interactions.
        start: Particles of a drop, its surface, and the spacing, before it is moved to its position.
    """

    scene: Printing
    fields: Fields = field(init=False)
    state: Indices = field(default_factory=lambda: np.empty(0, np.int32))
    dose: Floats = field(default_factory=lambda: np.empty(0))
    enthalpy: Floats = field(default_factory=lambda: np.empty(0))
    drop: Indices = field(default_factory=lambda: np.empty(0, np.int32))
    bodies: list[CuredBody] = field(default_factory=list)
    ground: LevelSet = field(init=False)
    surface: LiquidSurface = field(init=False)
    simulation: Simulation | None = None
    order: Indices = field(default_factory=lambda: np.empty(0, np.int64))
    heat: Heat | None = None
    time: float = 0.0
    spray: float = 0.0
    law: Law = field(init=False)
    start: tuple[Floats, tuple[Floats, Indices], float] = field(init=False)

    def __post_init__(self) -> None:
        drop = self.scene.drop
        points, surface, spacing = start_shape(drop, EDGE)
        self.start = points, surface, spacing
        self.law, tension = liquid_of(drop, spacing)
        self.ground = empty_ground(self.scene, spacing)
        self.fields = flow.make_fields(np.empty((3, 0)), np.empty((3, 0)), np.empty(0), self.law)
        mesh = SurfaceMesh(np.empty((0, 3)), np.empty((0, 3), np.int32), self.law.spacing, bool(self.law.mirror))
        self.surface = LiquidSurface(mesh, Capillarity(tension, cos(drop.angle), self.law))

    def saved(self) -> dict[str, Any]:
        """Return the state, for a checkpoint."""
        self.update()
        return {
            "fields": self.fields._asdict(), "state": self.state, "dose": self.dose, "drop": self.drop,
            "enthalpy": self.enthalpy, "heat_listed_at": self.heat.rows.built_at if self.heat else None,
            "bodies": [body._asdict() for body in self.bodies],
            "surface": self.surface.saved(), "order": self.order, "time": self.time, "spray": self.spray,
            "simulation": self.simulation.saved() if self.simulation else None,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.fields, self.state, self.order = Fields(**saved["fields"]), saved["state"], saved["order"]
        self.dose, self.drop, self.time = saved["dose"], saved["drop"], saved["time"]
        self.enthalpy, self.spray = saved["enthalpy"], saved["spray"]
        for body in saved["bodies"]:
            self._add_body(CuredBody(**body))
        self.surface.restore(saved["surface"])
        if saved["simulation"]:
            self._begin()
            assert self.simulation is not None
            self.simulation.restore(saved["simulation"])
            if self.heat and saved["heat_listed_at"].size:
                self.heat.rows.update(saved["heat_listed_at"])

    @property
    def liquid(self) -> Indices:
        """Numbers of the liquid particles, shape (k,)."""
        return np.flatnonzero(self.state == LIQUID)

    @property
    def moving(self) -> int:
        """Number of particles that move at present."""
        return self.simulation.fluids if self.simulation else 0

    @property
    def points(self) -> Floats:
        """Positions of all particles at the last ``update``, shape (n, 3) [m]."""
        return np.stack(self.fields[:3], axis=1)

    @property
    def pressures(self) -> Floats:
        """Pressure of all particles including the surface pressure, shape (n,) [Pa]; zero if held or solid."""
        return np.where(self.state == LIQUID, self.fields.pressure + self.surface.pressure, 0.0)

    def add_drop(self, position: tuple[float, float]) -> None:
        """Add a drop at x, y [m], a sphere that almost touches the plate or the particles below it."""
        self.update()
        (start, (corners, triangles), _), drop = self.start, self.scene.drop
        shift = np.array([*position, self._height(position) - 0.5 * drop.diameter - 0.5 * EDGE * drop.spacing])
        still = np.zeros(start.shape[1])
        new = flow.make_fields(start + shift[:, None], np.empty((3, 0)), still, self.law)
        for speed, value in zip(new[3:6], self.scene.velocity, strict=True):
            speed[:] = value
        self.fields = Fields(*(np.concatenate(pair) for pair in zip(self.fields, new, strict=True)))
        self.state = np.append(self.state, np.full(start.shape[1], LIQUID, np.int32))
        self.drop = np.append(self.drop, np.full(start.shape[1], 1 + self.drop.max(initial=-1), np.int32))
        self.dose = np.append(self.dose, np.zeros(start.shape[1]))
        self._add_heat(start.shape[1])
        self.surface.add(corners + shift, triangles)
        self._begin()

    def _add_heat(self, count: int) -> None:
        """Add the enthalpy of a new drop; solid particles have cooled down to the temperature of the plate."""
        freezing, warm = self.scene.freezing, 0.0
        if freezing is not None:
            self.enthalpy[self.state[: len(self.enthalpy)] == SOLID] = enthalpy_at(
                freezing, freezing.substrate_temperature
            )
            warm = enthalpy_at(freezing, freezing.temperature)
        self.enthalpy = np.append(self.enthalpy, np.full(count, warm))

    def _height(self, position: tuple[float, float]) -> float:
        """Return the height of the centre of a drop that lands at x, y [m]."""
        drop = self.scene.drop
        radius = 0.5 * drop.diameter
        near = radius + CLEARANCE * drop.spacing
        aside2 = (self.fields.x - position[0]) ** 2 + (self.fields.y - position[1]) ** 2
        below = aside2 < near**2
        heights = self.fields.z[below] + np.sqrt(near**2 - aside2[below])
        return float(heights.max(initial=radius + 0.5 * EDGE * drop.spacing))

    def _begin(self) -> None:
        """Start a simulation of the liquid and held particles, with the solid ones that liquid can reach as walls."""
        liquid, held = self.liquid, np.flatnonzero(self.state == HELD)
        near = self._within_reach(np.concatenate((liquid, held)))
        self.order = np.concatenate((liquid, held, near))
        walls, viscosity = np.zeros((5, len(held) + len(near))), np.zeros(len(self.order))
        fields = Fields(*[*(values[self.order] for values in self.fields[:12]), *walls, viscosity])
        depth = -self.ground.at(self.points[near], 1) / self.law.length
        fields.wall_room[len(held) :] = share_beyond_plane(self.law.kernel, np.maximum(depth, 0.0))
        self.surface.lie_on(self.ground if self.bodies else None)
        self.simulation = Simulation(
            fields, len(liquid), self.law, self.surface, flow.device_of(self.scene), len(held)
        )  # fmt: skip
        if self.scene.freezes and self.scene.freezing is not None:
            self.heat = Heat(self.scene.freezing, self.law, self.enthalpy[self.order])

    def _add_body(self, body: CuredBody) -> None:
        """Add a solid body to the bodies and to the ground."""
        self.bodies.append(body)
        add_to_ground(self.ground, body)

    def _within_reach(self, carriers: Indices) -> Indices:
        """Return the solid particles that may come within reach of liquid."""
        points, solid = self.points, np.flatnonzero(self.state == SOLID)
        reach = WITHIN_REACH * self.scene.length + SUPPORT * self.law.length
        low, high = points[carriers].min(axis=0) - reach, points[carriers].max(axis=0) + reach
        near = ((points[solid, :2] > low[:2]) & (points[solid, :2] < high[:2])).all(axis=1)
        return solid[near]

    def step(self, longest: float) -> float:
        """Advance the liquid by a stable time step, at most ``longest`` [s]; return the time step [s]."""
        assert self.simulation is not None
        time_step = min(self.simulation.time_step(), longest, self.heat.longest_step if self.heat else longest)
        self.simulation.step(time_step)
        if self.heat:
            self.heat.conduct(self.simulation.fields, time_step)
        self.time += time_step
        carriers = self.simulation.fluids + self.simulation.held
        self.spray = max(self.spray, self.surface.spray / (carriers * self.law.spacing**3))
        return time_step

    def update(self) -> None:
        """Copy the results of the simulation to the fields, except the values that walls extrapolate."""
        if self.simulation is None:
            return
        moving = self.simulation.fluids
        for values, simulated in zip(self.fields[:12], self.simulation.fields[:12], strict=True):
            values[self.order[:moving]] = simulated[:moving]
        if self.heat:
            self.enthalpy[self.order] = self.heat.enthalpy

    def expose(self, duration: float) -> None:
        """Add the light of a duration [s] to the dose of all particles that are not solid, unless drops freeze."""
        self.update()
        if self.scene.freezes:
            return
        exposed = np.flatnonzero(self.state != SOLID)
        self.dose[exposed] += duration * self._intensity(exposed)

    def cures_in(self) -> float:
        """Return the time until the next liquid particle is cured if nothing moves [s]."""
        liquid = self.liquid
        return float(((self.scene.light.dose - self.dose[liquid]) / self._intensity(liquid)).min())

    def _intensity(self, particles: Indices) -> Floats:
        """Return the light intensity at particles, shape (k,) [W/m^2].

        It decays exponentially with the depth below the highest particle within a spacing of the vertical.
        """
        cure = self.scene.light
        if cure.depth is None:
            return np.full(len(particles), cure.intensity)
        points = self.points
        columns = cKDTree(points[:, :2]).query_ball_point(points[particles, :2], self.law.spacing)
        top = np.array([points[column, 2].max() for column in columns])
        return cure.intensity * np.exp(-(top - points[particles, 2]) / cure.depth)

    def cure(self) -> bool:
        """Fix cured or frozen particles, and solidify bodies without liquid; return whether any particle changed."""
        self.update()
        cured = self.state == LIQUID
        if self.heat:
            cured[self.order] &= self.heat.is_frozen
        else:
            cured &= self.dose >= self.scene.light.dose * (1.0 - ROUNDING)
        if not cured.any():
            return False
        self.state[cured] = HELD
        for speed in self.fields[3:6]:
            speed[cured] = 0.0
        unsolid = np.flatnonzero(self.state != SOLID)
        part = part_of_vertex(self.surface.triangles, len(self.surface.points))
        body = part[cKDTree(self.surface.points).query(self.points[unsolid])[1]]
        is_liquid = np.bincount(body[self.state[unsolid] == LIQUID], minlength=part.max() + 1) > 0
        self.state[unsolid[~is_liquid[body]]] = SOLID
        if not is_liquid.all():
            last = int(self.drop[unsolid[~is_liquid[body]]].max(initial=0))
            self._add_body(CuredBody(*self.surface.take_out(~is_liquid[part]), last))
        self.simulation = self.heat = None
        if is_liquid.any():
            self._begin()
        return True


def add_to_ground(ground: LevelSet, body: CuredBody) -> None:
    """Add a solid body and its mirror image behind the plate to the level set of the ground.

    Args:
        ground: Level set: distance to the solid bodies at the nodes of a grid [m], negative in them; changed in place
            near the body.
        body: Solid body (vertices and triangles), which ends on the plate z = 0.
    """
    points, triangles = with_mirror_image(body.points, body.triangles)
    part, nodes = ground.grid.part_around(points, MARGIN)
    distance = signed_distance_in_band(points, triangles, part, MARGIN * part.spacing)
    ground.values[nodes] = np.minimum(ground.values[nodes], distance.values)


def empty_ground(scene: Printing, spacing: float) -> LevelSet:
    """Return the level set of a ground without solid bodies: large distances [m] on a grid around the whole print.

    Args:
        scene: Parameters of the print: drops, their positions and order, ink, curing and numerics.
        spacing: Particle spacing [m].
    """
    places = np.array(scene.places())
    aside = scene.length * (1.0 + WITHIN_REACH)
    top = (scene.layers + 1.0) * scene.length
    corners = np.array([[*(places.min(axis=0) - aside), 0.0], [*(places.max(axis=0) + aside), top]])
    grid = Grid.around(corners, NODES * spacing)
    return LevelSet(grid, np.full(grid.shape, MARGIN * NODES * spacing))
