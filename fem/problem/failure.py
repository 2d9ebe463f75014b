"""Failure criteria of a drop: limits with their sources, a law of drop life, board deflection, a reference design."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from reflowshock.effect import Switch
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Source = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Measure = Literal["peel_stress", "layer_von_mises", "layer_plastic_work"]
Component = Literal["axial", "bga", "dip", "leadless", "pga", "pga_two_rows", "side_brazed"]


class StressLimit(Parameters):
    """Stress at which a joint fails, and the source of the number: a test, a data sheet, a paper."""

    limit: Annotated[float, Quantity("MPa")] = Field(gt=0)
    source: Source


class WorkLimit(Parameters):
    """Plastic work density at which a joint fails, and the source of the number."""

    limit: Annotated[float, Quantity("kJ/m^3")] = Field(gt=0)
    source: Source


class StrainLimit(Parameters):
    """Largest board strain under the package, and the source of the number, such as the maker of the package."""

    limit: Annotated[float, Quantity("um/m")] = Field(gt=0)
    source: Source


class Life(Parameters):
    """Law of drop life from the user's tests: N = C s^-m drops.

    s is the ``measure`` of the critical joint in MPa or kJ/m^3, C the ``constant``, m the ``exponent``. Measured lives
    scatter between N / ``scatter`` and N times ``scatter``. With ``required`` drops, N / ``scatter`` must reach them.
    """

    measure: Measure
    constant: float = Field(gt=0)
    exponent: float = Field(gt=0)
    scatter: float = Field(ge=1)
    required: int | None = Field(None, ge=1)
    source: Source

    def drops(self, measure: float) -> tuple[float, float, float]:
        """Return the number of drops N and its lower and upper bound, for a measure in MPa or kJ/m^3."""
        middle = self.constant * measure**-self.exponent
        return middle, middle / self.scatter, middle * self.scatter


class BoardDeflection(Parameters):
    """Deflection that Steinberg's rule of thumb allows a board in a shock; judged unless ``apply`` is off.

    ``component`` is the type of the package. ``along`` is the edge of the board that its bending follows; ``auto`` is
    the edge along which the holes are farther apart.
    """

    apply: Switch = "auto"
    component: Component = "bga"
    along: Literal["auto", "length", "width"] = "auto"


class Reference(Parameters):
    """Run of a design that is known to survive; plastic work, peel stress and board strain are judged against it.

    ``run`` is a run folder, or a case file, which stands for its run folder in ``runs``. Each value may be
    ``largest_ratio`` times that of the reference. ``source`` says which test the reference has survived.
    """

    run: Annotated[str, StringConstraints(min_length=1)]
    largest_ratio: float = Field(1.0, gt=0)
    source: str = ""


class Failure(Parameters):
    """Failure criteria; the limits refer to peaks over time at the worse pad of a joint.

    ``peel_stress`` is the mean over a pad, ``layer_von_mises`` and ``layer_plastic_work`` are means over the solder
    layer at a pad, ``board_strain`` is the largest of the board under the package. These limits have no default,
    because strength depends on solder, finish, rate and process.
    """

    peel_stress: StressLimit | None = None
    layer_von_mises: StressLimit | None = None
    layer_plastic_work: WorkLimit | None = None
    board_strain: StrainLimit | None = None
    life: Life | None = None
    board_deflection: BoardDeflection = BoardDeflection()
    reference: Reference | None = None

    @property
    def judged(self) -> tuple[str, ...]:
        """Quantities that the case judges, by key."""
        limits = ("peel_stress", "layer_von_mises", "layer_plastic_work", "board_strain", "reference")
        given = [name for name in limits if getattr(self, name) is not None]
        required = self.life is not None and self.life.required is not None
        deflection = self.board_deflection.apply != "off"
        return (*given, *(["life"] if required else []), *(["board_deflection"] if deflection else []))
