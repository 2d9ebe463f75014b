"""Base of the numerical parameters of a particle method for flows; ``methods.py`` lists the methods."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Protocol

from reflowshock.parameters import Parameters


class FlowScale(Protocol):
    """Scales of a flow that determine the time step."""

    has_free_surface: ClassVar[bool]

    @property
    def density(self) -> float: ...  # noqa: D102

    @property
    def spacing(self) -> float: ...  # noqa: D102

    @property
    def fastest(self) -> float: ...  # noqa: D102

    @property
    def tension(self) -> float: ...  # noqa: D102

    @property
    def largest_viscosity(self) -> float: ...  # noqa: D102


class FlowNumerics(Parameters):
    """Numerical parameters of a flow; the class is also the description of its method.

    Attributes:
        relative_cost: Wall time of a time step relative to delta-SPH.
        devices: Devices that compute it.
        study_values: Key -> values that the convergence study tries at the coarsest spacing.
    """

    relative_cost: ClassVar[float] = 1.0
    devices: ClassVar[tuple[str, ...]] = ("cpu",)
    study_values: ClassVar[Mapping[str, tuple[float, ...]]] = {}

    method: str

    @abstractmethod
    def time_step(self, scale: FlowScale, is_viscous: bool) -> float:
        """Return the expected time step [s], with or without viscosity."""

    def sound(self, fastest: float) -> float | None:
        """Return the speed of sound [m/s] for a largest expected speed [m/s]; None for an incompressible method."""
        return None
