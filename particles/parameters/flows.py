"""Flows of a liquid by delta-SPH, their parameters in SI floats: a dam break, a channel, vortices."""

from abc import abstractmethod
from math import pi, sqrt
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from reflowshock.effect import Switch
from reflowshock.parameters import Parameters
from reflowshock.particles.parameters.rheology import Rheology, rate_at_wall
from reflowshock.quantity import Quantity

# Alpha of liquid without viscosity of its own: as in dam breaks of Marrone et al. 2011.
ARTIFICIAL_VISCOSITY = 0.02
# Of the time step: in which sound crosses a smoothing length, velocity diffuses over one (Monaghan 1992), and the
# shortest waves of surface tension pass (Brackbill et al. 1992).
COURANT, DIFFUSIVE, CAPILLARY = 0.25, 0.125, 0.25
# Viscosity along the line of two particles, as where there is a free surface, slows the shortest waves down twice as
# fast as viscosity along their velocities: so many times it bounds the step. Without, stiff drops flew apart.
CENTRAL = 2.0


class MethodNumerics(Parameters):
    """How a flow is computed, whatever its particles stand along.

    The smoothing length is over the spacing of the particles, the speed of sound over the largest speed expected;
    density diffusion is delta, artificial viscosity alpha (by default 0.02 where viscosity does not act, else none).
    The density diffuses along its gradient: "renormalised" by a 3 x 3 matrix, or "reproducing", the slope of the linear
    function next to the neighbours, from a 4 x 4 matrix (Belytschko et al. 1998).
    XSPH lets particles move with a velocity that is smoothed by so much: 0.5 is usual, none is needed with viscosity.
    Particles are on threads of the processor, or on a GPU (cuda); a surface that is tracked stays with the processor.
    """

    device: Literal["cpu", "cuda"] = "cpu"
    kernel: Literal["cubic_spline", "wendland"] = "cubic_spline"
    smoothing_length: float = Field(1.3, ge=1.0, le=2.5)
    sound_speed: float = Field(10.0, ge=5, le=100)
    density_diffusion: float = Field(0.1, ge=0, le=0.2)
    density_gradient: Literal["renormalised", "reproducing"] = "renormalised"
    artificial_viscosity: float | None = Field(None, ge=0, le=0.5)
    xsph: float = Field(0.0, ge=0, le=1)


class SphNumerics(MethodNumerics):
    """How a flow is computed that its particles stand across.

    They stand along the length of the scene: the height of the dam, the width of the channel, the side of the box of
    vortices.
    """

    particles_across: int = Field(40, ge=8, le=1000)


class SphEffects(Parameters):
    """What acts besides pressure: decided from the Reynolds number (auto), or by the user."""

    viscosity: Switch = "auto"


class SphFlow(Parameters):
    """Base of all flows: a liquid, and how it is computed; its viscosity may depend on the rate of shear.

    Attributes:
        dimension: Dimension of the flow, 2 or 3.
        has_free_surface: Whether part of the surface of the liquid is free.
    """

    dimension: ClassVar[int]
    has_free_surface: ClassVar[bool] = False

    density: Annotated[float, Quantity("kg/m^3")] = Field(1000.0, gt=0)
    viscosity: Annotated[float, Quantity("Pa*s")] = Field(1.0e-3, gt=0)
    rheology: Rheology | None = None
    effects: SphEffects = SphEffects()
    numerics: MethodNumerics = MethodNumerics()

    @property
    @abstractmethod
    def length(self) -> float:
        """What the particles across stand along [m]."""

    @property
    @abstractmethod
    def fastest(self) -> float:
        """Largest speed expected [m/s]."""

    @property
    @abstractmethod
    def particles(self) -> int:
        """Particles of the liquid."""

    @property
    @abstractmethod
    def until(self) -> float:
        """How long it flows [s]."""

    @property
    @abstractmethod
    def spacing(self) -> float:
        """Of the particles at the start [m]."""

    @property
    def sound(self) -> float:
        """Speed of sound [m/s]."""
        return self.numerics.sound_speed * self.fastest

    @property
    def reynolds_number(self) -> float:
        """Reynolds number of length and largest speed."""
        return self.density * self.fastest * self.length / self.liquid_viscosity

    @property
    def tension(self) -> float:
        """Surface tension that acts on the liquid [N/m]; 0 where none does."""
        return 0.0

    @property
    def liquid_viscosity(self) -> float:
        """Of the liquid, however the case says it [Pa s]; where it depends on the rate of shear, that in its law."""
        return self.viscosity

    @property
    def largest_viscosity(self) -> float:
        """At rest or at the rate of shear of the largest speed over a spacing [Pa s]."""
        if self.rheology is None:
            return self.liquid_viscosity
        return self.rheology.largest(self.liquid_viscosity, self.fastest / self.spacing)

    def expected_time_step(self, is_viscous: bool) -> float:
        """Return the time step [s] that the flow is expected to take, with or without viscosity."""
        length, viscosity = self.numerics.smoothing_length * self.spacing, 0.0
        if is_viscous:
            viscosity = self.largest_viscosity * (CENTRAL if self.has_free_surface else 1.0)
        return largest_time_step(length, self.sound + self.fastest, self.density, viscosity, self.tension)


class PlaneFlow(SphFlow):
    """A flow in a plane, that particles stand across."""

    dimension = 2

    numerics: SphNumerics = SphNumerics()

    @property
    def spacing(self) -> float:
        """Of the particles at the start [m]."""
        return self.length / self.numerics.particles_across


class DamBreak(PlaneFlow):
    """A column of liquid in the corner of a tank is let go; a sensor in the opposite wall measures pressure.

    Walls are smooth: liquid slides along them. Pressures are told over rho g H, times in sqrt(H / g), H being the
    column's height.
    """

    has_free_surface = True

    height: Annotated[float, Quantity("m")] = Field(gt=0)
    width: Annotated[float, Quantity("m")] = Field(gt=0)
    tank_length: Annotated[float, Quantity("m")] = Field(gt=0)
    sensor_height: Annotated[float, Quantity("m")] = Field(gt=0)
    gravity: Annotated[float, Quantity("m/s^2")] = Field(9.81, gt=0)
    duration: Annotated[float, Quantity("s")] = Field(gt=0)

    @property
    def length(self) -> float:
        """The column's height [m]."""
        return self.height

    @property
    def fastest(self) -> float:
        """Speed of a fall over the column's height, sqrt(2 g H) [m/s]."""
        return sqrt(2.0 * self.gravity * self.height)

    @property
    def unit_of_time(self) -> float:
        """sqrt(H / g) [s]."""
        return sqrt(self.height / self.gravity)

    @property
    def columns(self) -> int:
        """Particles along the column's width."""
        return max(1, round(self.width / self.spacing))

    @property
    def particles(self) -> int:
        """Particles of the liquid."""
        return self.columns * self.numerics.particles_across

    @property
    def until(self) -> float:
        """How long it flows [s]."""
        return self.duration


class Poiseuille(PlaneFlow):
    """Liquid at rest between two plates is set in motion by a force along them; along them it is periodic.

    The speed is that of the middle at the end of all time; the duration is in w^2 / nu, in which the flow develops.
    """

    width: Annotated[float, Quantity("mm")] = Field(gt=0)
    speed: Annotated[float, Quantity("m/s")] = Field(gt=0)
    duration: float = Field(1.0, gt=0, le=10)

    @property
    def length(self) -> float:
        """The channel's width [m]."""
        return self.width

    @property
    def fastest(self) -> float:
        """Speed of the middle [m/s]."""
        return self.speed

    @property
    def force(self) -> float:
        """Acceleration along the channel [m/s^2]."""
        if self.rheology is not None:
            rate = self.rate_at_wall
            return 2.0 * self.rheology.viscosity(rate, self.viscosity) * rate / (self.density * self.width)
        return 8.0 * self.viscosity * self.speed / (self.density * self.width**2)

    @property
    def rate_at_wall(self) -> float:
        """Of shear, where it flows steadily and its viscosity depends on that [1/s]."""
        assert self.rheology is not None
        return rate_at_wall(self.rheology, self.viscosity, self.speed, self.width)

    @property
    def columns(self) -> int:
        """Particles along a period of the channel."""
        return max(10, self.numerics.particles_across // 2)

    @property
    def particles(self) -> int:
        """Particles of the liquid."""
        return self.columns * self.numerics.particles_across

    @property
    def until(self) -> float:
        """How long it flows [s]."""
        return self.duration * self.density * self.width**2 / self.viscosity


class TaylorGreen(PlaneFlow):
    """Four vortices in a periodic box, which viscosity slows down.

    The duration is in side / speed, the speed the largest one at the start.
    """

    side: Annotated[float, Quantity("mm")] = Field(gt=0)
    speed: Annotated[float, Quantity("m/s")] = Field(gt=0)
    duration: float = Field(1.0, gt=0, le=20)

    @property
    def length(self) -> float:
        """The box's side [m]."""
        return self.side

    @property
    def fastest(self) -> float:
        """The largest speed at the start [m/s]."""
        return self.speed

    @property
    def particles(self) -> int:
        """Particles of the liquid."""
        return self.numerics.particles_across**2

    @property
    def until(self) -> float:
        """How long it flows [s]."""
        return self.duration * self.side / self.speed


def largest_time_step(length: float, speed: float, density: float, viscosity: float, tension: float = 0.0) -> float:
    """Return the largest stable time step [s].

    Args:
        length: smoothing length [m].
        speed: of sound, and the largest of the liquid added [m/s].
        density: [kg/m^3].
        viscosity: [Pa s], `CENTRAL` times it where there is a free surface; 0 where none acts.
        tension: surface tension [N/m]; 0 where none acts.
    """
    steps = [COURANT * length / speed]
    if viscosity > 0.0:
        steps.append(DIFFUSIVE * length**2 * density / viscosity)
    if tension > 0.0:
        steps.append(CAPILLARY * sqrt(density * length**3 / (2.0 * pi * tension)))
    return min(steps)
