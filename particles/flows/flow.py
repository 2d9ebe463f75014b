"""Base classes of flows: density, viscosity, size, largest speed, duration and resolution."""

from abc import abstractmethod
from typing import Annotated, ClassVar

from pydantic import Field

from reflowshock.effect import Decision, Switch
from reflowshock.parameters import Parameters
from reflowshock.particles.flows.flow_method import FlowNumerics
from reflowshock.particles.flows.methods import PlaneNumerics
from reflowshock.particles.flows.rheology import Rheology
from reflowshock.particles.flows.sph_numerics import SphNumerics
from reflowshock.quantity import Quantity


class FlowSwitches(Parameters):
    """Switches of the optional effects: decided from the Reynolds number (auto), or set by the user."""

    viscosity: Switch = "auto"


class FlowScene(Parameters):
    """Base of all flows: liquid properties, effects and numerical parameters.

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
    numerics: FlowNumerics

    @property
    @abstractmethod
    def length(self) -> float:
        """Characteristic length [m]."""

    @property
    @abstractmethod
    def fastest(self) -> float:
        """Largest expected speed [m/s]."""

    @property
    @abstractmethod
    def particles(self) -> int:
        """Number of liquid particles."""

    @property
    @abstractmethod
    def until(self) -> float:
        """Duration of the flow [s]."""

    @property
    @abstractmethod
    def spacing(self) -> float:
        """Initial spacing of the particles [m]."""

    @property
    def unit_scene(self) -> "FlowScene":
        """Scene whose dimensionless numbers decide on the common effects."""
        return self

    def decide_own_effects(self) -> dict[str, Decision]:
        """Decide on the effects that only this kind of flow has: name -> decision."""
        return {}

    @property
    def reynolds_number(self) -> float:
        """Reynolds number from the characteristic length and the largest speed."""
        return self.density * self.fastest * self.length / self.liquid_viscosity

    @property
    def tension(self) -> float:
        """Surface tension of the liquid [N/m]; 0 if it is neglected."""
        return 0.0

    @property
    def liquid_viscosity(self) -> float:
        """Viscosity of the liquid [Pa s]; with a rheology, the reference viscosity of its law."""
        return self.viscosity

    @property
    def largest_viscosity(self) -> float:
        """Largest viscosity at shear rates between zero and the largest speed over a spacing [Pa s]."""
        if self.rheology is None:
            return self.liquid_viscosity
        return self.rheology.largest(self.liquid_viscosity, self.fastest / self.spacing)

    def expected_time_step(self, is_viscous: bool) -> float:
        """Return the expected time step [s], with or without viscosity."""
        return self.numerics.time_step(self, is_viscous)


class PlaneFlow(FlowScene):
    """Two-dimensional flow, resolved by a number of particles across its characteristic length."""

    dimension = 2

    numerics: PlaneNumerics = SphNumerics()

    @property
    def spacing(self) -> float:
        """Initial spacing of the particles [m]."""
        return self.length / self.numerics.particles_across
