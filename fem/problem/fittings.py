"""Fittings of a board or a structure: supports, lumped masses, watch points, strain gauges. SI floats."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

AXES = "xyz"
SAMPLED = 8  # masses along either side of a footprint; even, so that none lies on its middle
GAUGE = 2e-3  # [m] grid of usual foil gauges on boards
Axis = Literal["x", "y", "z"]
Direction = tuple[float, float, float]
Place = tuple[float, float, float]
PositiveLength = Annotated[float, Field(gt=0)]


class Bedding(Parameters):
    """Stiffness per area k of an elastic support, by component; zero leaves a component free.

    Over an area A with the second moment I the support has the stiffness k A and the rotational stiffness k I.
    """

    x: Annotated[float, Quantity("N/m^3")] = Field(0.0, ge=0)
    y: Annotated[float, Quantity("N/m^3")] = Field(0.0, ge=0)
    z: Annotated[float, Quantity("N/m^3")] = Field(0.0, ge=0)


class Support(Parameters):
    """Support of a facet set in the frame of the drop table: fixed components, others on a bedding of springs."""

    on: str
    hold: tuple[Axis, ...] = ()
    bedding: Bedding | None = None

    @property
    def stiffness(self) -> tuple[float, float, float]:
        """Stiffness per area [N/m^3] along x, y, z."""
        springs = self.bedding or Bedding()
        return springs.x, springs.y, springs.z


class PointMass(Parameters):
    """Lumped mass of a heavy component without stiffness: at a point, or uniform over ``footprint`` along x and y.

    With a plane of symmetry its mirror image is added; each half carries half of a mass on that plane.
    """

    mass: Annotated[float, Quantity("g")] = Field(gt=0)
    at: Annotated[Place, Quantity("mm")]
    footprint: Annotated[tuple[PositiveLength, PositiveLength], Quantity("mm")] | None = None

    def meshed_places(self, symmetry: Sequence[str], margin: float) -> list[tuple[Place, float]]:
        """Return the meshed points [m] that carry the mass, each with its fraction of the mass.

        The footprint is a grid of equal masses; masses beyond a plane of symmetry lie on the part that is not meshed.

        Args:
            symmetry: Axes whose planes through the origin are planes of symmetry.
            margin: Distance [m] below which a point lies on such a plane.
        """
        planes = [AXES.index(axis) for axis in dict.fromkeys(symmetry)]
        if self.footprint is None:
            return [(self.at, 0.5 ** sum(abs(self.at[k]) <= margin for k in planes))]
        offsets = [(k + 0.5) / SAMPLED - 0.5 for k in range(SAMPLED)]
        (x, y, z), (length, width) = self.at, self.footprint
        grid = [(x + a * length, y + b * width, z) for a in offsets for b in offsets]
        return [(point, 1.0 / len(grid)) for point in grid if all(point[k] > 0.0 for k in planes)]


class WatchPoint(Parameters):
    """A point whose displacement, velocity, strain and stress are recorded.

    ``direction`` is the axis of its accelerometer; the default is the direction of the input-G, or without input-G the
    axis of largest motion.
    """

    at: Annotated[Place, Quantity("mm")]
    direction: Direction | None = None


class StrainGauge(Parameters):
    """A strain gauge on the upper or lower face: change of the distance of its ends over their initial distance.

    ``at`` is its centre in x, y. The gauge has ``length``, or the length of an element of the face if that is longer.
    """

    at: Annotated[tuple[float, float], Quantity("mm")]
    face: Literal["upper", "lower"] = "lower"
    direction: tuple[float, float] = (1.0, 0.0)
    length: Annotated[float, Quantity("mm")] = Field(GAUGE, gt=0)


class Fittings(Parameters):
    """Supports, lumped masses, watch points and strain gauges by name.

    On the board of a drop z = 0 is its upper face, on which the package sits, and the only facet set is
    ``mounting_holes``. Without ``supports`` the walls of the holes are fixed.
    """

    supports: dict[str, Support] = Field(default_factory=dict)
    masses: dict[str, PointMass] = Field(default_factory=dict)
    watch: dict[str, WatchPoint] = Field(default_factory=dict)
    gauges: dict[str, StrainGauge] = Field(default_factory=dict)


class Neighbour(Parameters):
    """A further, coarse package on the board: it loads and stiffens the board, and its joints are not judged.

    ``at`` is its centre in x, y. Each of its ``rows`` x ``columns`` joints is a square post of side ``post`` and height
    ``standoff``. ``substrate`` and ``die`` are length, width and thickness. Its roles have the materials of the main
    package. With a plane of symmetry its mirror image is added.
    """

    at: Annotated[tuple[float, float], Quantity("mm")]
    rows: int = Field(ge=1, le=100)
    columns: int = Field(ge=1, le=100)
    pitch: Annotated[float, Quantity("mm")] = Field(gt=0)
    post: Annotated[float, Quantity("mm")] = Field(gt=0)
    standoff: Annotated[float, Quantity("mm")] = Field(gt=0)
    substrate: Annotated[tuple[PositiveLength, PositiveLength, PositiveLength], Quantity("mm")]
    die: Annotated[tuple[PositiveLength, PositiveLength, PositiveLength], Quantity("mm")]


class BoardFittings(Fittings):
    """Fittings of the board of a drop, with further packages."""

    packages: dict[str, Neighbour] = Field(default_factory=dict)
