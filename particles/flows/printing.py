"""Parameters of a printed part in SI floats: drops, one after the other, layer on layer, that cure or freeze."""

from functools import lru_cache
from math import cos, inf, pi, sin, sqrt
from typing import Annotated, Any, Literal

from pydantic import Field

from reflowshock.effect import Decision, Effect, Switch, decided, decision
from reflowshock.parameters import Parameters, changed
from reflowshock.particles.flows.droplet import RIGHT_ANGLE, Droplet, DropletEffects, DropletNumerics, cap
from reflowshock.particles.flows.flow import FlowScene
from reflowshock.particles.flows.freezing import Freezing
from reflowshock.quantity import Quantity

# sqrt(rho D^3 / gamma) that a drop is followed at most after it has landed, if it does not cure before.
SETTLING = 2.0
# Beside liquid, in diameters: how far it may get before the next drop lands or cures.
WITHIN_REACH = 1.0
# Share of the height of a drop that freezes before the next one lands: with less freezing is left out.
LITTLE_FROZEN = 0.01


class Cure(Parameters):
    """Light that cures the ink from above, all the time: a particle is solid once it has got the dose.

    Within the ink the light dies out over the depth (Beer and Lambert); without one it reaches all of it alike.
    """

    intensity: Annotated[float, Quantity("W/m^2")] = Field(1.0e5, gt=0)
    dose: Annotated[float, Quantity("J/m^2")] = Field(50.0, gt=0)
    depth: Annotated[float | None, Quantity("um")] = Field(None, gt=0)


class PrintingEffects(DropletEffects):
    """What acts besides pressure, and whether drops freeze: decided from how much of one freezes, or by the user."""

    freezing: Switch = "auto"


class PrintingNumerics(DropletNumerics):
    """How a printed part is computed: as droplets are; and for how long liquid is followed after the last drop.

    `settling` is in sqrt(rho D^3 / gamma). What is then liquid is taken to rest until it cures or a drop lands.
    """

    settling: float = Field(SETTLING, ge=0.5, le=100)


class Printing(FlowScene):
    """Drops of ink that are printed on a plate and on each other: columns along x, rows along y, layers upwards.

    Drops of a layer are printed row by row; "serpentine" turns at the end of each, "interleaved" takes every other
    place first. The plate is tilted about y by `substrate_angle`: drops come down aslant. The contact angle is that on
    the plate and on cured ink alike. Light cures the drops, or they freeze; then one is followed until it is solid, and
    cools down to the plate before the next one lands.
    """

    dimension = 3
    has_free_surface = True

    drop_volume: Annotated[float, Quantity("pL")] = Field(gt=0)
    surface_tension: Annotated[float, Quantity("N/m")] = Field(gt=0)
    speed: Annotated[float, Quantity("m/s")] = Field(gt=0)
    contact_angle: Annotated[float, Quantity("deg")] = Field(RIGHT_ANGLE, ge=pi / 6.0 - 1e-9, le=5.0 * pi / 6.0 + 1e-9)
    columns: int = Field(ge=1, le=100)
    rows: int = Field(ge=1, le=100)
    layers: int = Field(1, ge=1, le=100)
    pitch: Annotated[float, Quantity("um")] = Field(gt=0)
    order: Literal["raster", "serpentine", "interleaved"] = "raster"
    delay: Annotated[float, Quantity("us")] = Field(gt=0)
    substrate_angle: Annotated[float, Quantity("deg")] = Field(0.0, ge=-pi / 4.0 - 1e-9, le=pi / 4.0 + 1e-9)
    gravity: Annotated[float, Quantity("m/s^2")] = Field(9.81, ge=0)
    cure: Cure | None = None
    freezing: Freezing | None = None
    effects: PrintingEffects = PrintingEffects()
    numerics: PrintingNumerics = PrintingNumerics()

    @property
    def tension(self) -> float:
        """Surface tension of the ink [N/m]."""
        return self.surface_tension

    @property
    def light(self) -> Cure:
        """What cures drops that do not freeze."""
        return self.cure or Cure()

    @property
    def drop(self) -> Droplet:
        """One of its drops, as if it were alone."""
        return _drop_of(self)

    @property
    def drops(self) -> int:
        """Their number."""
        return self.columns * self.rows * self.layers

    @property
    def drops_of_layer(self) -> int:
        """Drops in a layer."""
        return self.columns * self.rows

    @property
    def velocity(self) -> tuple[float, float, float]:
        """With which drops land [m/s]."""
        return self.speed * sin(self.substrate_angle), 0.0, -self.speed * cos(self.substrate_angle)

    @property
    def base(self) -> float:
        """Width on the plate of one drop at rest [m]."""
        return cap(self.contact_angle)[0] * self.length

    @property
    def cure_time(self) -> float:
        """In which ink at the light cures, or in which a drop freezes, the mean over the layers [s]."""
        if self.freezes and self.freezing is not None:
            return self.freezing.time_for(self._height, self.density) / self.layers
        return self.light.dose / self.light.intensity

    @property
    def share_frozen(self) -> float:
        """How much of the height of a drop freezes before the next one lands, 0 to 1."""
        if self.freezing is None:
            return 0.0
        return min(1.0, sqrt(self.delay / self.freezing.time_for(self._height / self.layers, self.density)))

    @property
    def freezes(self) -> bool:
        """Whether drops freeze, and no light cures them."""
        if self.freezing is None or self.effects.freezing != "auto":
            return self.freezing is not None and self.effects.freezing == "on"
        return self.share_frozen > LITTLE_FROZEN

    @property
    def cooling_time(self) -> float:
        """In which a drop on top freezes and cools down to the plate, nearly [s]."""
        if self.freezing is None:
            return inf
        diffusion = self._height**2 / self.freezing.diffusivity(self.density)
        return self.freezing.time_for(self._height, self.density) + diffusion

    @property
    def _height(self) -> float:
        """Of all layers, were their drops caps [m]."""
        return self.layers * cap(self.contact_angle)[1] * self.length

    @property
    def settling_time(self) -> float:
        """For which liquid is followed after the last drop [s]."""
        drop = self.drop
        return self.numerics.settling * (drop.density * drop.diameter**3 / drop.surface_tension) ** 0.5

    @property
    def followed(self) -> float:
        """For how long at most one drop is followed [s]."""
        if self.freezes:
            return self.cure_time
        return min(self.settling_time, self.cure_time, self.delay if self.cure_time > self.delay else self.cure_time)

    @property
    def length(self) -> float:
        """Diameter of a drop [m]."""
        return self.drop.diameter

    @property
    def fastest(self) -> float:
        """As of one drop [m/s]."""
        return self.drop.fastest

    @property
    def spacing(self) -> float:
        """Of the particles at the start [m]."""
        return self.drop.spacing

    @property
    def particles(self) -> int:
        """Particles of all drops, nearly."""
        return self.drops * self.drop.particles

    @property
    def until(self) -> float:
        """All the time in which drops are followed [s]."""
        return self.drops * self.followed

    def places(self) -> list[tuple[float, float]]:
        """Where the drops of a layer land, in their order: x and y [m], their mean in the origin."""
        grid = [(column, row) for row in range(self.rows) for column in range(self.columns)]
        if self.order == "serpentine":
            grid = [(self.columns - 1 - column if row % 2 else column, row) for column, row in grid]
        if self.order == "interleaved":
            grid.sort(key=lambda place: (place[0] + place[1]) % 2)
        middle = 0.5 * (self.columns - 1), 0.5 * (self.rows - 1)
        return [((column - middle[0]) * self.pitch, (row - middle[1]) * self.pitch) for column, row in grid]

    @property
    def unit_scene(self) -> Droplet:
        """One drop, whose numbers decide on the effects of every flow."""
        return self.drop

    def decide_own_effects(self) -> dict[str, Decision]:
        """Decide on surface tension and gravity of one drop, and on freezing."""
        return self.drop.decide_own_effects() | decided(PRINTING_EFFECTS, self)


@lru_cache(maxsize=8)  # asked for in every step
def _drop_of(scene: Printing) -> Droplet:
    return Droplet(
        diameter=(6.0 * scene.drop_volume / pi) ** (1.0 / 3.0), density=scene.density, viscosity=scene.viscosity,
        rheology=scene.rheology,
        surface_tension=scene.surface_tension, speed=scene.speed, contact_angle=scene.contact_angle,
        gravity=scene.gravity, duration=scene.delay,
        effects=DropletEffects(**scene.effects.model_dump(exclude={"freezing"})),
        numerics=DropletNumerics(**scene.numerics.model_dump(exclude={"settling"})),
    )  # fmt: skip


class InkFreezing(Effect[Printing]):
    """Freezing of printed drops on a cold plate."""

    name = "freezing"
    stage = "particles"
    adds = "de/dt = div(k grad T) / rho; a particle without half of its latent heat stands still"
    number = (
        "sqrt(delay / t_f), t_f = H^2 / (4 lambda^2 a): share of a drop's height that freezes before the next lands"
    )
    threshold = LITTLE_FROZEN
    influence = "the number; without freezing light cures the drops"
    place = "reflowshock.particles.sph.heat.Heat"
    switch = "printing.effects.freezing = auto, on, off"
    source = "Neumann's solution, as in Carslaw & Jaeger 1959; Cleary & Monaghan 1999; Voller & Prakash 1987"

    def decide(self, scene: Printing) -> Decision:
        """By the share that freezes, or as the user says."""
        freezing, switch = scene.freezing, scene.effects.freezing
        if freezing is None:
            return decision(False, "no freezing is given: light cures the drops")
        why = (
            f"Stefan number {freezing.stefan:.3g}: {100.0 * scene.share_frozen:.3g} % of a drop's height between drops"
        )
        if switch != "auto":
            why = f"set to {switch} by the user ({why})"
        return decision(scene.freezes, why, scene.share_frozen)

    def other_way(self, case: Any, acts: bool) -> Any | None:
        """Return a case whose drops are cured by light; where the case gives no freezing, none is known."""
        return changed(case, f"{case.kind}.freezing", None) if acts else None


PRINTING_EFFECTS = (InkFreezing(),)
