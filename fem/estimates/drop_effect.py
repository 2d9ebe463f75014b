"""Base class of the effects of a drop, and the properties of a planned and a completed drop that decide on them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from reflowshock.effect import Decision, Effect
from reflowshock.fem.problem.shock import Shock
from reflowshock.materials.parameters import Material


class Deflection(NamedTuple):
    """Expected bending of a board by a shock.

    Attributes:
        largest: Largest deflection of the centre of the board [m].
        slope: Largest slope of the board.
        omega: Angular frequency of the first mode [rad/s].
    """

    largest: float
    slope: float
    omega: float


class Drop(Protocol):
    """Properties of a drop before it is computed."""

    @property
    def shock(self) -> Shock:
        """Parameters of the shock."""

    @property
    def materials(self) -> Mapping[str, Material]:
        """Materials by role."""

    @property
    def thickness(self) -> float:
        """Thickness of the board [m]."""

    @property
    def symmetry(self) -> Literal["full", "quarter"]:
        """Symmetry of the model."""

    @property
    def weight(self) -> Decision:
        """Decision on gravity, from g over the peak acceleration."""

    @property
    def yielding(self) -> Decision:
        """Decision on plastic solder, from the expected peel stress over its yield stress."""

    @property
    def cooled(self) -> bool:
        """Whether the drop begins with the residual stress of cooling."""

    @property
    def duration(self) -> float:
        """Longest duration of the computation [s]."""

    @property
    def expected(self) -> Deflection:
        """Expected bending of the board by the shock."""

    @property
    def frequency(self) -> float:
        """First natural frequency of the board [Hz]."""

    @property
    def bent_by_weight(self) -> float:
        """Static deflection of the board by its weight [m]."""


@dataclass(frozen=True, slots=True)
class DropRun:
    """Completed drop.

    Attributes:
        shock: Parameters of the shock.
        materials: Materials by role.
        weight: Decision on gravity.
        added_mass: Mass added by mass scaling [kg].
        neglected_strain: Largest strain neglected by the kinematics.
    """

    shock: Shock
    materials: Mapping[str, Material]
    weight: Decision
    added_mass: float
    neglected_strain: float


class DropEffect(Effect[Drop]):
    """Effect of a drop."""

    def report(self, run: DropRun) -> Decision | None:
        """Return the decision for the results of a completed run, or None if results omit the effect."""
        return None
