"""Ink on a plate: particles that are liquid, held or solid, and the surface of what is liquid.

A particle that is cured or frozen never moves again. As long as some of its body, a connected part of the liquid's
surface, is liquid, it is held: it stands still as walls do, but carries the surface. A body without liquid is solid: it
leaves the loops, but for particles that liquid can reach, which are its walls.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import cos
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.parameters.printing import WITHIN_REACH, Printing
from reflowshock.particles.scenes.droplet import liquid_of, start_shape
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.capillary_forces import Capillarity
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.heat import Heat, enthalpy_at
from reflowshock.particles.sph.liquid_surface import LiquidSurface
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.smoothing import SUPPORT, beyond_plane
from reflowshock.particles.surface.cloud_level_set import with_mirror_image
from reflowshock.particles.surface.level_set import LevelSet, signed_distance_in_band
from reflowshock.particles.surface.morphological_closing import part_of_vertex
from reflowshock.particles.surface.remeshing import EDGE
from reflowshock.particles.surface.surface_mesh import SurfaceMesh

LIQUID, HELD, SOLID = 0, 1, 2
# In spacings: how far the surface of a new drop is from particles below it.
CLEARANCE = 1.1
ROUNDING = 1e-9
# In spacings of the particles: nodes of the level set of the ground; in these, how far about its face it is told.
NODES, MARGIN = 0.75, 4


class CuredBody(NamedTuple):
    """A solid body: surface of points `(m, 3)` [m] and triangles, which ends on the plate; the last of its drops."""

    points: Floats
    triangles: Indices
    drop: int


@dataclass(slots=True)
class Deposit:
    """Ink on a plate.

    Attributes:
        scene: what is printed.
        fields: quantities of all particles, in the order in which they have landed.
        state: `(n,)` `LIQUID`, `HELD` or `SOLID`.
        dose: `(n,)` of light that each has got [J/m^2].
        enthalpy: `(n,)` of each where drops freeze, over that of solid at the melting point [J/kg].
        drop: `(n,)` number of each one's drop.
        bodies: what is solid, in the order in which it cured.
        ground: distance to the bodies, on a grid about all that will be printed.
        surface: of what is liquid, and held with it; empty where all is solid.
        simulation: of what is liquid; None where nothing is.
        order: which particles those of the simulation are.
        heat: of these particles; None where nothing freezes.
        time: [s].
        spray: largest share of the liquid, with what is held with it, that was outside its surface at a time.
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
        points, surface, spacing = start_shape(drop)
        self.start = points, surface, spacing
        self.law, tension = liquid_of(drop, spacing)
        self.ground = nothing_of(self.scene, spacing)
        self.fields = flow.liquid_and_walls(np.empty((3, 0)), np.empty((3, 0)), np.empty(0), self.law)
        mesh = SurfaceMesh(np.empty((0, 3)), np.empty((0, 3), np.int32), self.law.spacing, bool(self.law.mirror))
        self.surface = LiquidSurface(mesh, Capillarity(tension, cos(drop.angle), self.law))

    def saved(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        self.update()
        return {
            "fields": self.fields._asdict(), "state": self.state, "dose": self.dose, "drop": self.drop,
            "enthalpy": self.enthalpy, "heat_listed_at": self.heat.rows.built_at if self.heat else None,
            "bodies": [body._asdict() for body in self.bodies],
            "surface": self.surface.saved(), "order": self.order, "time": self.time, "spray": self.spray,
            "simulation": self.simulation.saved() if self.simulation else None,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from what `saved` returned."""
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
        """Particles that are liquid."""
        return np.flatnonzero(self.state == LIQUID)

    @property
    def moving(self) -> int:
        """Number of particles that move now."""
        return self.simulation.fluids if self.simulation else 0

    @property
    def points(self) -> Floats:
        """Of all particles `(n, 3)` [m], up to the present where none moves now."""
        return np.stack(self.fields[:3], axis=1)

    @property
    def pressures(self) -> Floats:
        """Of all particles [Pa], with that of the surface; none in what is cured."""
        return np.where(self.state == LIQUID, self.fields.pressure + self.surface.pressure, 0.0)

    def add_drop(self, place: tuple[float, float]) -> None:
        """Let a drop land at x, y [m]: it starts as a sphere that all but touches what is below it."""
        self.update()
        (start, (corners, triangles), _), drop = self.start, self.scene.drop
        shift = np.array([*place, self._lift(place) - 0.5 * drop.diameter - 0.5 * EDGE * drop.spacing])
        still = np.zeros(start.shape[1])
        new = flow.liquid_and_walls(start + shift[:, None], np.empty((3, 0)), still, self.law)
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
        """Add particles of a new drop, warm; what is solid has cooled down to the plate."""
        freezing, warm = self.scene.freezing, 0.0
        if freezing is not None:
            self.enthalpy[self.state[: len(self.enthalpy)] == SOLID] = enthalpy_at(
                freezing, freezing.substrate_temperature
            )
            warm = enthalpy_at(freezing, freezing.temperature)
        self.enthalpy = np.append(self.enthalpy, np.full(count, warm))

    def _lift(self, place: tuple[float, float]) -> float:
        """Height of the centre of a drop that lands at x, y [m]."""
        drop = self.scene.drop
        radius = 0.5 * drop.diameter
        near = radius + CLEARANCE * drop.spacing
        aside2 = (self.fields.x - place[0]) ** 2 + (self.fields.y - place[1]) ** 2
        below = aside2 < near**2
        heights = self.fields.z[below] + np.sqrt(near**2 - aside2[below])
        return float(heights.max(initial=radius + 0.5 * EDGE * drop.spacing))

    def _begin(self) -> None:
        """Start a simulation of what is liquid, with what of the solid it can reach."""
        liquid, held = self.liquid, np.flatnonzero(self.state == HELD)
        near = self._within_reach(np.concatenate((liquid, held)))
        self.order = np.concatenate((liquid, held, near))
        walls, viscosity = np.zeros((5, len(held) + len(near))), np.zeros(len(self.order))
        fields = Fields(*[*(one[self.order] for one in self.fields[:12]), *walls, viscosity])
        depth = -self.ground.at(self.points[near], 1) / self.law.length
        fields.wall_room[len(held) :] = beyond_plane(self.law.kernel, np.maximum(depth, 0.0))
        self.surface.lie_on(self.ground if self.bodies else None)
        self.simulation = Simulation(
            fields, len(liquid), self.law, self.surface, flow.device_of(self.scene), len(held)
        )  # fmt: skip
        if self.scene.freezes and self.scene.freezing is not None:
            self.heat = Heat(self.scene.freezing, self.law, self.enthalpy[self.order])

    def _add_body(self, body: CuredBody) -> None:
        """Add a solid body to the ground."""
        self.bodies.append(body)
        join(self.ground, body)

    def _within_reach(self, carriers: Indices) -> Indices:
        """Solid particles that liquid may come to touch."""
        points, solid = self.points, np.flatnonzero(self.state == SOLID)
        reach = WITHIN_REACH * self.scene.length + SUPPORT * self.law.length
        low, high = points[carriers].min(axis=0) - reach, points[carriers].max(axis=0) + reach
        near = ((points[solid, :2] > low[:2]) & (points[solid, :2] < high[:2])).all(axis=1)
        return solid[near]

    def step(self, longest: float) -> float:
        """Let the liquid flow for a time step, or less [s]; return it."""
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
        """Take over what the simulation has computed; what walls are given to act on liquid is not theirs."""
        if self.simulation is None:
            return
        moving = self.simulation.fluids
        for everything, some in zip(self.fields[:12], self.simulation.fields[:12], strict=True):
            everything[self.order[:moving]] = some[:moving]
        if self.heat:
            self.enthalpy[self.order] = self.heat.enthalpy

    def expose(self, duration: float) -> None:
        """Give all particles that are not solid the light of a duration [s], where it is light that cures."""
        self.update()
        if self.scene.freezes:
            return
        open_ = np.flatnonzero(self.state != SOLID)
        self.dose[open_] += duration * self._intensity(open_)

    def cures_in(self) -> float:
        """Duration until the next liquid particle is cured if nothing moves [s]."""
        liquid = self.liquid
        return float(((self.scene.light.dose - self.dose[liquid]) / self._intensity(liquid)).min())

    def _intensity(self, particles: Indices) -> Floats:
        """Light at particles [W/m^2]: it dies out below the highest particle about the vertical through them."""
        cure = self.scene.light
        if cure.depth is None:
            return np.full(len(particles), cure.intensity)
        points = self.points
        beside = cKDTree(points[:, :2]).query_ball_point(points[particles, :2], self.law.spacing)
        top = np.array([points[column, 2].max() for column in beside])
        return cure.intensity * np.exp(-(top - points[particles, 2]) / cure.depth)

    def cure(self) -> bool:
        """Hold liquid particles that are cured or frozen; bodies without liquid are solid. Return whether any were."""
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


def join(ground: LevelSet, body: CuredBody) -> None:
    """Add a solid body to a level set, with its image behind the plate."""
    points, triangles = with_mirror_image(body.points, body.triangles)
    part, nodes = ground.grid.part_around(points, MARGIN)
    distance = signed_distance_in_band(points, triangles, part, MARGIN * part.spacing)
    ground.values[nodes] = np.minimum(ground.values[nodes], distance.values)


def nothing_of(scene: Printing, spacing: float) -> LevelSet:
    """Return the level set of nothing about all that will be printed, for particles a spacing apart [m]."""
    places = np.array(scene.places())
    aside = scene.length * (1.0 + WITHIN_REACH)
    top = (scene.layers + 1.0) * scene.length
    corners = np.array([[*(places.min(axis=0) - aside), 0.0], [*(places.max(axis=0) + aside), top]])
    grid = Grid.around(corners, NODES * spacing)
    return LevelSet(grid, np.full(grid.shape, MARGIN * NODES * spacing))
