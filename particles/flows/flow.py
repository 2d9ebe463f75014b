"""Base of the scenes of flowing liquids: density, viscosity, size, largest speed, duration and resolution."""

from abc import abstractmethod
from typing import Annotated, ClassVar

from pydantic import Field

from reflowshock.effect import Decision, Switch
from reflowshock.parameters import Parameters
from reflowshock.particles.flows.rheology import Rheology
from reflowshock.particles.flows.sph_numerics import CENTRAL, MethodNumerics, SphNumerics, largest_time_step
from reflowshock.quantity import Quantity


class FlowSwitches(Parameters):
    """Switches of effects besides pressure: decided from the Reynolds number (auto), or by the user."""

    viscosity: Switch = "auto"


class FlowScene(Parameters):
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
    effects: FlowSwitches = FlowSwitches()
    numerics: MethodNumerics = MethodNumerics()

    @property
    @abstractmethod
    def length(self) -> float:
        """Length that the particles across divide [m]."""

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
        """Duration of the flow [s]."""

    @property
    @abstractmethod
    def spacing(self) -> float:
        """Spacing of the particles at the start [m]."""

    @property
    def unit_scene(self) -> "FlowScene":
        """Scene whose numbers decide on the effects of every flow."""
        return self

    def decide_own_effects(self) -> dict[str, Decision]:
        """Decide on the effects that only this kind of flow has."""
        return {}

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
        """Viscosity of the liquid [Pa s]; with a rheology, the viscosity in its law."""
        return self.viscosity

    @property
    def largest_viscosity(self) -> float:
        """Largest viscosity from rest up to the rate of shear of the largest speed over a spacing [Pa s]."""
        if self.rheology is None:
            return self.liquid_viscosity
        return self.rheology.largest(self.liquid_viscosity, self.fastest / self.spacing)

    def expected_time_step(self, is_viscous: bool) -> float:
        """Return the time step [s] that the flow is expected to take, with or without viscosity."""
        length, viscosity = self.numerics.smoothing_length * self.spacing, 0.0
        if is_viscous:
            viscosity = self.largest_viscosity * (CENTRAL if self.has_free_surface else 1.0)
        return largest_time_step(length, self.sound + self.fastest, self.density, viscosity, self.tension)


class PlaneFlow(FlowScene):
    """Flow in a plane, with a number of particles across it."""

    dimension = 2

    numerics: SphNumerics = SphNumerics()

    @property
    def spacing(self) -> float:
        """Spacing of the particles at the start [m]."""
        return self.length / self.numerics.particles_across
