"""Parameters (SI) of drop-on-demand printing: drops deposited one by one in layers, which cure or freeze."""

from functools import lru_cache
from math import cos, inf, pi, sin, sqrt
from typing import Annotated, Any, Literal

from pydantic import Field

from reflowshock.effect import Decision, Effect, Switch, decide_all, decision
from reflowshock.parameters import Parameters, with_value
from reflowshock.particles.flows.droplet import RIGHT_ANGLE, Droplet, DropletEffects, DropletNumerics, cap
from reflowshock.particles.flows.flow import FlowScene
from reflowshock.particles.flows.freezing import Freezing
from reflowshock.quantity import Quantity

# Longest simulated time after a drop has landed, in sqrt(rho D^3 / gamma), if it does not cure earlier.
SETTLING = 2.0
# Margin around the liquid in diameters: how far it may spread before the next drop lands or cures.
WITHIN_REACH = 1.0
# Fraction of the height of a drop that freezes before the next one lands, below which freezing is neglected.
LITTLE_FROZEN = 0.01


class Cure(Parameters):
    """Continuous light from above that cures the ink; a particle is solid once it has received the dose.

    The light decays in the ink over the depth (Beer-Lambert law); without a depth, the intensity is uniform.
    """

    intensity: Annotated[float, Quantity("W/m^2")] = Field(1.0e5, gt=0)
    dose: Annotated[float, Quantity("J/m^2")] = Field(50.0, gt=0)
    depth: Annotated[float | None, Quantity("um")] = Field(None, gt=0)


class PrintingEffects(DropletEffects):
    """Switches of the effects on printed drops, freezing included: decided automatically (auto), or set by the user."""

    freezing: Switch = "auto"


class PrintingNumerics(DropletNumerics):
    """Numerical parameters of a printed part: those for droplets, and the simulated time after the last drop.

    ``settling`` is in sqrt(rho D^3 / gamma). Afterwards, liquid is assumed to rest until it cures or a drop lands.
    """

    settling: float = Field(SETTLING, ge=0.5, le=100)


class Printing(FlowScene):
    """Drops of ink printed on a plate and on each other: columns along x, rows along y, layers upwards.

    The drops of a layer are printed row by row; "serpentine" reverses every second row, and "interleaved" prints every
    second position first. The plate is tilted about y by ``substrate_angle``, so drops arrive obliquely. The contact
    angle is the same on the plate and on cured ink. The drops are cured by light, or they freeze; a freezing drop is
    simulated until it is solid, and cools to the temperature of the plate before the next drop lands.
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
        """Light that cures drops that do not freeze."""
        return self.cure or Cure()

    @property
    def drop(self) -> Droplet:
        """A single isolated drop."""
        return _drop_of(self)

    @property
    def drops(self) -> int:
        """Total number of drops."""
        return self.columns * self.rows * self.layers

    @property
    def drops_of_layer(self) -> int:
        """Number of drops in a layer."""
        return self.columns * self.rows

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Velocity of the drops when they land, (x, y, z) [m/s]."""
        return self.speed * sin(self.substrate_angle), 0.0, -self.speed * cos(self.substrate_angle)

    @property
    def base(self) -> float:
        """Base diameter of one drop at rest on the plate [m]."""
        return cap(self.contact_angle)[0] * self.length

    @property
    def cure_time(self) -> float:
        """Time in which ink at the surface cures, or mean time in which one layer freezes [s]."""
        if self.freezes and self.freezing is not None:
            return self.freezing.time_for(self._height, self.density) / self.layers
        return self.light.dose / self.light.intensity

    @property
    def share_frozen(self) -> float:
        """Fraction of the height of a drop that freezes before the next one lands, 0 to 1."""
        if self.freezing is None:
            return 0.0
        return min(1.0, sqrt(self.delay / self.freezing.time_for(self._height / self.layers, self.density)))

    @property
    def freezes(self) -> bool:
        """Whether drops freeze instead of being cured by light."""
        if self.freezing is None or self.effects.freezing != "auto":
            return self.freezing is not None and self.effects.freezing == "on"
        return self.share_frozen > LITTLE_FROZEN

    @property
    def cooling_time(self) -> float:
        """Approximate time in which a drop of the top layer freezes and cools to the plate temperature [s]."""
        if self.freezing is None:
            return inf
        diffusion = self._height**2 / self.freezing.diffusivity(self.density)
        return self.freezing.time_for(self._height, self.density) + diffusion

    @property
    def _height(self) -> float:
        """Height of all layers if each drop were a spherical cap [m]."""
        return self.layers * cap(self.contact_angle)[1] * self.length

    @property
    def settling_time(self) -> float:
        """Simulated time after the last drop [s]."""
        drop = self.drop
        return self.numerics.settling * (drop.density * drop.diameter**3 / drop.surface_tension) ** 0.5

    @property
    def followed(self) -> float:
        """Longest simulated time of one drop [s]."""
        if self.freezes:
            return self.cure_time
        return min(self.settling_time, self.cure_time, self.delay if self.cure_time > self.delay else self.cure_time)

    @property
    def length(self) -> float:
        """Diameter of a drop [m]."""
        return self.drop.diameter

    @property
    def fastest(self) -> float:
        """Largest expected speed of one drop [m/s]."""
        return self.drop.fastest

    @property
    def spacing(self) -> float:
        """Initial spacing of the particles [m]."""
        return self.drop.spacing

    @property
    def particles(self) -> int:
        """Approximate number of particles of all drops."""
        return self.drops * self.drop.particles

    @property
    def until(self) -> float:
        """Total simulated time of all drops [s]."""
        return self.drops * self.followed

    def places(self) -> list[tuple[float, float]]:
        """Return x and y [m] of the drops of a layer in the order of printing, centred about the origin."""
        grid = [(column, row) for row in range(self.rows) for column in range(self.columns)]
        if self.order == "serpentine":
            grid = [(self.columns - 1 - column if row % 2 else column, row) for column, row in grid]
        if self.order == "interleaved":
            grid.sort(key=lambda position: (position[0] + position[1]) % 2)
        middle = 0.5 * (self.columns - 1), 0.5 * (self.rows - 1)
        return [((column - middle[0]) * self.pitch, (row - middle[1]) * self.pitch) for column, row in grid]

    @property
    def unit_scene(self) -> Droplet:
        """A single drop, whose dimensionless numbers decide on the common effects."""
        return self.drop

    def decide_own_effects(self) -> dict[str, Decision]:
        """Decide on surface tension and gravity of one drop, and on freezing."""
        return self.drop.decide_own_effects() | decide_all(PRINTING_EFFECTS, self)


@lru_cache(maxsize=8)  # read in every step
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
    implementation = "reflowshock.particles.sph.heat.Heat"
    switch = "printing.effects.freezing = auto, on, off"
    source = "Neumann's solution, as in Carslaw & Jaeger 1959; Cleary & Monaghan 1999; Voller & Prakash 1987"

    def decide(self, scene: Printing) -> Decision:
        """Decide by the fraction that freezes, unless the user sets the switch."""
        freezing, switch = scene.freezing, scene.effects.freezing
        if freezing is None:
            return decision(False, "no freezing is given: light cures the drops")
        why = (
            f"Stefan number {freezing.stefan:.3g}: {100.0 * scene.share_frozen:.3g} % of a drop's height between drops"
        )
        if switch != "auto":
            why = f"set to {switch} by the user ({why})"
        return decision(scene.freezes, why, scene.share_frozen)

    def toggled(self, case: Any, acts: bool) -> Any | None:
        """Return the case with drops cured by light; None if the effect is off."""
        return with_value(case, f"{case.kind}.freezing", None) if acts else None


PRINTING_EFFECTS = (InkFreezing(),)
