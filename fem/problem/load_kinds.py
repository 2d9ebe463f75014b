"""Kinds of load of a structure: parameters, quantity, effect and place of each; the last union lists all kinds.

The force of a kind is built in ``fem.loads.structure_loads``, its pulse in ``fem.loads.structure_pulses``.
"""

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from reflowshock.fem.problem.fittings import Axis, Direction
from reflowshock.fem.problem.shock import ServiceCondition
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity


class Pulsed(Parameters):
    """Base of loads whose value is a peak times a pulse of unit height, or a table of values.

    ``half_sine`` and ``haversine`` act for ``duration``; ``constant`` acts from the start, for ``duration`` or to the
    end. ``table`` is a CSV file of times and values that replaces peak and pulse; ``table_column`` is the title of the
    column of values if there are several. A record that begins at a negative time is shifted to time zero.

    Attributes:
        effect: Name of the effect in plans and results.
        quantity: Physical quantity of the values, a key of ``fem.loads.pulse_table.QUANTITIES``.
        alternatives: Keys of which exactly one set defines the pulse, as text for messages.
        has_default_peak: Whether the load is complete without a peak or a table.
        is_base_excitation: Whether the load is the acceleration of the supports.
    """

    effect: ClassVar[str]
    quantity: ClassVar[str]
    alternatives: ClassVar[str] = "peak, or table"
    has_default_peak: ClassVar[bool] = False
    is_base_excitation: ClassVar[bool] = False
    pulse: Literal["half_sine", "haversine", "constant"] = "half_sine"
    duration: Annotated[float | None, Quantity("ms")] = Field(None, gt=0)
    table: str | None = None
    table_column: str | None = None

    @property
    def definitions(self) -> tuple[str, ...]:
        """Keys present in the case that define the pulse."""
        names = ("service_condition", "table") if self.has_default_peak else ("service_condition", "peak", "table")
        return tuple(name for name in names if getattr(self, name, None) is not None)

    @property
    def jedec_condition(self) -> ServiceCondition | None:
        """JEDEC service condition that defines the pulse, or None."""
        return None

    @property
    def is_large_mass(self) -> bool:
        """Whether a large mass at the supports applies the load."""
        return False

    @property
    def facet_set(self) -> str | None:
        """Name of the facet set that the load acts on; None for loads on the body or at a point."""
        return None


class OnBody(Pulsed):
    """Base of loads on the whole body along ``direction``."""

    direction: Direction


class OnNodes(Pulsed):
    """Base of loads on the nodes of a facet set."""

    on: str

    @property
    def facet_set(self) -> str:
        """Name of the facet set that the load acts on."""
        return self.on


class OnAreas(Pulsed):
    """Base of loads per area on a facet set."""

    on: str

    @property
    def facet_set(self) -> str:
        """Name of the facet set that the load acts on."""
        return self.on


class AtPoint(Pulsed):
    """Base of loads at a point along ``direction``."""

    at: Annotated[tuple[float, float, float], Quantity("mm")]
    direction: Direction


class InputG(OnBody):
    """Acceleration of all supports along ``direction`` (input-G).

    It is defined by a JEDEC service condition, by peak and duration, or by a table. With ``method = direct``
    displacements are relative to the supports.
    """

    effect: ClassVar = "input_g"
    is_base_excitation: ClassVar[bool] = True
    quantity: ClassVar = "acceleration"
    kind: Literal["input_g"] = "input_g"
    service_condition: ServiceCondition | None = None
    peak: Annotated[float | None, Quantity("G")] = Field(None, gt=0)
    direction: Direction = (0.0, 0.0, 1.0)
    method: Literal["direct", "large_mass"] = "direct"
    alternatives: ClassVar[str] = "service_condition, or peak and duration, or table"

    @property
    def jedec_condition(self) -> ServiceCondition | None:
        """JEDEC service condition that defines the pulse, or None."""
        return self.service_condition

    @property
    def is_large_mass(self) -> bool:
        """Whether a large mass at the supports applies the load."""
        return self.method == "large_mass"


class Pressure(OnAreas):
    """Pressure on a facet set, positive in compression; it follows the moving surface unless kinematics are small."""

    effect: ClassVar = "pressure"
    quantity: ClassVar = "pressure"
    kind: Literal["pressure"] = "pressure"
    peak: Annotated[float | None, Quantity("MPa")] = None


class PrescribedMotion(OnNodes):
    """Prescribed velocity component of the nodes of a facet set."""

    effect: ClassVar = "prescribed_motion"
    quantity: ClassVar = "velocity"
    kind: Literal["motion"] = "motion"
    component: Axis
    peak: Annotated[float | None, Quantity("m/s")] = None


class Gravity(OnBody):
    """Weight of the body, constant unless a pulse or a table is given."""

    effect: ClassVar = "gravity"
    quantity: ClassVar = "acceleration"
    kind: Literal["gravity"] = "gravity"
    pulse: Literal["half_sine", "haversine", "constant"] = "constant"
    peak: Annotated[float, Quantity("m/s^2")] = Field(9.80665, gt=0)
    direction: Direction = (0.0, 0.0, -1.0)
    has_default_peak: ClassVar[bool] = True


class PointForce(AtPoint):
    """Force of constant direction at a point, distributed over the nodes of the element that contains the point.

    It is the force on the whole body: with a plane of symmetry its mirror image acts too, and each half carries half of
    a force on that plane. Strains in the loaded element depend on the mesh.
    """

    effect: ClassVar = "point_force"
    quantity: ClassVar = "force"
    kind: Literal["point_force"] = "point_force"
    peak: Annotated[float | None, Quantity("N")] = Field(None, gt=0)


AnyLoad = InputG | Gravity | Pressure | PrescribedMotion | PointForce
StructureLoad = Annotated[AnyLoad, Field(discriminator="kind")]
KINDS: tuple[type[Pulsed], ...] = get_args(AnyLoad)
