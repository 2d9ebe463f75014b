"""Parameters of a printed part in SI floats: drops of ink, one after the other, layer on layer, and how they cure."""

from functools import lru_cache
from math import cos, pi, sin
from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.particles.parameters.droplets import RIGHT_ANGLE, Droplet, DropletEffects, DropletNumerics, cap
from reflowshock.particles.parameters.flows import SphFlow
from reflowshock.quantity import Quantity

# sqrt(rho D^3 / gamma) that a drop is followed at most after it has landed, if it does not cure before.
SETTLING = 2.0
# Beside liquid, in diameters: how far it may get before the next drop lands or cures.
WITHIN_REACH = 1.0


class Cure(Parameters):
    """Light that cures the ink from above, all the time: a particle is solid once it has got the dose.

    Within the ink the light dies out over the depth (Beer and Lambert); without one it reaches all of it alike.
    """

    intensity: Annotated[float, Quantity("W/m^2")] = Field(1.0e5, gt=0)
    dose: Annotated[float, Quantity("J/m^2")] = Field(50.0, gt=0)
    depth: Annotated[float | None, Quantity("um")] = Field(None, gt=0)


class PrintingNumerics(DropletNumerics):
    """How a printed part is computed: as droplets are; and for how long liquid is followed after the last drop.

    `settling` is in sqrt(rho D^3 / gamma). What is then liquid is taken to rest until it cures or a drop lands.
    """

    settling: float = Field(SETTLING, ge=0.5, le=100)


class Printing(SphFlow):
    """Drops of ink that are printed on a plate and on each other: columns along x, rows along y, layers upwards.

    Drops of a layer are printed row by row; "serpentine" turns at the end of each, "interleaved" takes every other
    place first. The plate is tilted about y by `substrate_angle`: drops come down aslant. The contact angle is that on
    the plate and on cured ink alike.
    """

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
    cure: Cure = Cure()
    effects: DropletEffects = DropletEffects()
    numerics: PrintingNumerics = PrintingNumerics()

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
        """In which ink at the light cures [s]."""
        return self.cure.dose / self.cure.intensity

    @property
    def settling_time(self) -> float:
        """For which liquid is followed after the last drop [s]."""
        drop = self.drop
        return self.numerics.settling * (drop.density * drop.diameter**3 / drop.surface_tension) ** 0.5

    @property
    def followed(self) -> float:
        """For how long at most one drop is followed [s]."""
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


@lru_cache(maxsize=8)  # asked for in every step
def _drop_of(scene: Printing) -> Droplet:
    return Droplet(
        diameter=(6.0 * scene.drop_volume / pi) ** (1.0 / 3.0), density=scene.density, viscosity=scene.viscosity,
        rheology=scene.rheology,
        surface_tension=scene.surface_tension, speed=scene.speed, contact_angle=scene.contact_angle,
        gravity=scene.gravity, duration=scene.delay, effects=scene.effects,
        numerics=DropletNumerics(**scene.numerics.model_dump(exclude={"settling"})),
    )  # fmt: skip
