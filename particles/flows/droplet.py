"""Parameters (SI) of three-dimensional droplets for delta-SPH: free, at rest on a wall, or striking a wall."""

from math import cos, pi, sin, sqrt
from typing import Annotated, Literal

from pydantic import Field

from reflowshock.effect import Decision, Effect, Switch, decide_all, decision
from reflowshock.particles.flows.flow import FlowScene, FlowSwitches
from reflowshock.particles.flows.sph_numerics import MethodNumerics
from reflowshock.particles.parameters.effect_gravity import NEGLIGIBLE_SHAPE_CHANGE, SHAPE_CHANGE_BY_BOND
from reflowshock.quantity import Quantity

RIGHT_ANGLE = 0.5 * pi
PARTICLES_PER_DIAMETER = 16.0
# Smallest ratio of sound speed to largest expected speed; below it, densities change by more than 2 % at the impact.
LEAST_SOUND_SPEED = 8.0
# Default durations in units of time. Impact: until the recoil; up to a Weber number of 300 the largest width is reached
# before 4 D / U. Otherwise: five Rayleigh periods of 0.785 sqrt(rho D^3 / gamma) each.
FOLLOWED_IMPACT, FOLLOWED_REST = 6.0, 4.0

WallAngle = Annotated[float | None, Quantity("deg"), Field(ge=pi / 6.0 - 1e-9, le=5.0 * pi / 6.0 + 1e-9)]

# Threshold of 1 / sqrt(We): below it, surface tension changes the spread of an impact by less than 1 %.
LITTLE_TENSION = 0.01


class DropletNumerics(MethodNumerics):
    """Numerical parameters of a droplet; the resolution is a spacing or a number of particles across the diameter."""

    spacing: Annotated[float | None, Quantity("um")] = Field(None, gt=0)
    particles_per_diameter: float | None = Field(None, ge=8, le=200)


class DropletEffects(FlowSwitches):
    """Switches of the effects on a droplet: decided from Reynolds, Weber and Bond number (auto), or set by the user."""

    surface_tension: Switch = "auto"
    gravity: Switch = "auto"


class Droplet(FlowScene):
    """A droplet: striking a wall, at rest on a wall, or free.

    With a speed, or with Weber and Reynolds number, the droplet strikes a wall; it starts as a sphere that just touches
    the wall, and the default contact angle is 90 degrees. With only a contact angle, it starts as a half sphere on the
    wall and comes to rest. With neither, it is free and starts as a sphere or a cube. The Weber number
    rho U^2 D / gamma may replace the speed, and the Reynolds number rho U D / mu the viscosity. The contact line is
    pinned between the receding and the advancing angle; each of them defaults to the contact angle.
    """

    dimension = 3
    has_free_surface = True

    diameter: Annotated[float, Quantity("um")] = Field(gt=0)
    surface_tension: Annotated[float, Quantity("N/m")] = Field(gt=0)
    speed: Annotated[float | None, Quantity("m/s")] = Field(None, gt=0)
    weber: float | None = Field(None, gt=0)
    reynolds: float | None = Field(None, gt=0)
    contact_angle: WallAngle = None
    advancing_angle: WallAngle = None
    receding_angle: WallAngle = None
    gravity: Annotated[float, Quantity("m/s^2")] = Field(9.81, ge=0)
    start: Literal["sphere", "cube"] = "sphere"
    duration: Annotated[float | None, Quantity("us")] = Field(None, gt=0)
    effects: DropletEffects = DropletEffects()
    numerics: DropletNumerics = DropletNumerics()

    @property
    def impact_speed(self) -> float:
        """Speed of the impact [m/s]; 0 without an impact."""
        if self.weber is not None:
            return sqrt(self.weber * self.surface_tension / (self.density * self.diameter))
        return self.speed or 0.0

    @property
    def tension(self) -> float:
        """Surface tension [N/m]."""
        return self.surface_tension

    @property
    def liquid_viscosity(self) -> float:
        """Viscosity as specified, or from the Reynolds number [Pa s]."""
        if self.reynolds is None:
            return self.viscosity
        return self.density * self.impact_speed * self.diameter / self.reynolds

    @property
    def has_wall(self) -> bool:
        """Whether the droplet touches a wall."""
        return self.contact_angle is not None or self.impact_speed > 0.0

    @property
    def angle(self) -> float:
        """Contact angle [rad]."""
        return RIGHT_ANGLE if self.contact_angle is None else self.contact_angle

    @property
    def advancing(self) -> float:
        """Advancing contact angle [rad]."""
        return self.angle if self.advancing_angle is None else self.advancing_angle

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Cosines of the advancing and the receding angle; None without hysteresis."""
        if self.advancing_angle is None and self.receding_angle is None:
            return None
        receding = self.angle if self.receding_angle is None else self.receding_angle
        return cos(self.advancing), cos(receding)

    @property
    def length(self) -> float:
        """Diameter [m]."""
        return self.diameter

    @property
    def volume(self) -> float:
        """Volume of the droplet [m^3]."""
        return pi * self.diameter**3 / 6.0

    @property
    def fastest(self) -> float:
        """Larger of the impact speed and the capillary wave speed sqrt(2 gamma / (rho R)) [m/s]."""
        return max(self.impact_speed, sqrt(4.0 * self.surface_tension / (self.density * self.diameter)))

    @property
    def spacing(self) -> float:
        """Initial spacing of the particles [m]."""
        if self.numerics.spacing is not None:
            return self.numerics.spacing
        return self.diameter / (self.numerics.particles_per_diameter or PARTICLES_PER_DIAMETER)

    @property
    def particles(self) -> int:
        """Approximate number of liquid particles."""
        return max(1, round(self.volume / self.spacing**3))

    @property
    def until(self) -> float:
        """Duration of the simulation [s]."""
        if self.duration is not None:
            return self.duration
        return (FOLLOWED_IMPACT if self.impact_speed else FOLLOWED_REST) * self.unit_of_time

    @property
    def unit_of_time(self) -> float:
        """Time unit: D / U for an impact, otherwise sqrt(rho D^3 / gamma) [s]."""
        if self.impact_speed:
            return self.diameter / self.impact_speed
        return sqrt(self.density * self.diameter**3 / self.surface_tension)

    @property
    def laplace_pressure(self) -> float:
        """Laplace pressure of the sphere, 4 gamma / D [Pa]."""
        return 4.0 * self.surface_tension / self.diameter

    @property
    def weber_number(self) -> float:
        """Weber number of the impact."""
        return self.density * self.impact_speed**2 * self.diameter / self.surface_tension

    @property
    def bond(self) -> float:
        """Bond number rho g D^2 / gamma."""
        return self.density * self.gravity * self.diameter**2 / self.surface_tension

    @property
    def ohnesorge(self) -> float:
        """Ohnesorge number mu / sqrt(rho gamma D)."""
        return self.liquid_viscosity / sqrt(self.density * self.surface_tension * self.diameter)

    def decide_own_effects(self) -> dict[str, Decision]:
        """Decide on surface tension and gravity."""
        return decide_all(DROPLET_EFFECTS, self)


class DropletTension(Effect[Droplet]):
    """Surface tension of a droplet, and the wetting of its wall."""

    name = "droplet_tension"
    stage = "particles"
    adds = "-d(gamma (A_free - cos(theta) A_wet))/dx, distributed to the particles next to the surface"
    number = "1 / sqrt(We), We = rho U^2 D / gamma: square root of surface energy over kinetic energy"
    threshold = LITTLE_TENSION
    influence = "the number, for the spread of an impact; without an impact nothing else acts"
    implementation = "reflowshock.particles.sph.liquid_surface.LiquidSurface"
    switch = "droplet.effects.surface_tension = auto, on, off"
    source = "Pasandideh-Fard et al. 1996: D_max / D = sqrt((We + 12) / (3 (1 - cos theta) + 4 We / sqrt(Re)))"

    def decide(self, scene: Droplet) -> Decision:
        """Decide by the Weber number, unless the user sets the switch."""
        number = min(1.0 / sqrt(scene.weber_number), 1.0) if scene.weber_number else 1.0
        why = f"Weber number {scene.weber_number:.3g}" if scene.impact_speed else "nothing else moves the drop"
        switch = scene.effects.surface_tension
        if switch != "auto":
            return decision(switch == "on", f"set to {switch} by the user ({why})", number)
        return decision(number > LITTLE_TENSION, why, number)


class DropletGravity(Effect[Droplet]):
    """Weight of a droplet on a wall."""

    name = "droplet_gravity"
    stage = "particles"
    adds = "g"
    number = "Bo = rho g D^2 / gamma"
    threshold = NEGLIGIBLE_SHAPE_CHANGE / SHAPE_CHANGE_BY_BOND
    influence = "0.2 Bo, of the height"
    implementation = "reflowshock.particles.sph.flow.law_of"
    switch = "droplet.effects.gravity = auto, on, off"
    source = "Bashforth & Adams 1883, tables"

    def decide(self, scene: Droplet) -> Decision:
        """Decide by the Bond number, unless the user sets the switch; off for a free drop, which would only fall."""
        bond, switch = scene.bond, scene.effects.gravity
        if not scene.has_wall:
            return decision(False, "no wall: the drop would fall as a whole", 0.0)
        influence, why = min(SHAPE_CHANGE_BY_BOND * bond, 1.0), f"Bond number {bond:.3g}"
        if switch != "auto":
            return decision(switch == "on", f"set to {switch} by the user ({why})", influence)
        return decision(influence > NEGLIGIBLE_SHAPE_CHANGE, why, influence)


DROPLET_EFFECTS = (DropletTension(), DropletGravity())


def cap(angle: float) -> tuple[float, float]:
    """Return base diameter and height of a spherical cap, divided by the diameter of the sphere of equal volume.

    Args:
        angle: Contact angle [rad].
    """
    radius = 0.5 * (4.0 / ((2.0 + cos(angle)) * (1.0 - cos(angle)) ** 2)) ** (1.0 / 3.0)
    return 2.0 * radius * sin(angle), radius * (1.0 - cos(angle))
