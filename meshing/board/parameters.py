"""Parameters of the geometry: array, pads, package, board, warpage.

All values are SI floats; ``Quantity`` has the unit in which a user sees them.
"""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Length = Annotated[float, Quantity("mm")]
IN_LINE = 1.0e-9  # m: holes whose places along an axis differ by less are in line


class Pad(Parameters):
    """A circular copper pad and the opening of the solder mask above it.

    SMD (solder mask defined): the opening is smaller than the pad and limits the solder.
    NSMD: the opening is larger, the edge of the copper limits the solder.
    """

    diameter: Length = Field(gt=0)
    mask_opening: Length = Field(gt=0)
    definition: Literal["SMD", "NSMD"]

    @property
    def wetted_radius(self) -> float:
        """Radius of the disc that solder can wet [m]."""
        return 0.5 * min(self.diameter, self.mask_opening)


class Copper(Parameters):
    """Copper under and above the joints (H 4.3 draws it as thin plates, 0.02 mm)."""

    thickness: Length = Field(2.0e-5, gt=0)
    layout: Literal["pads", "plate"] = "pads"


class Layer(Parameters):
    """A rectangular, centred layer of the package: substrate or die."""

    length: Length = Field(gt=0)
    width: Length = Field(gt=0)
    thickness: Length = Field(gt=0)
    elements: int = Field(2, ge=1, le=20)


class PackageNumerics(Parameters):
    """How the package is meshed."""

    element_size: Length = Field(5.0e-4, gt=0)


class JointNumerics(Parameters):
    """How a joint is meshed: butterfly cross-section swept from pad to pad.

    With ``pad_layer``, the thickness over which stress and plastic work are averaged, ``pad_layers`` of the ``layers``
    divide it equally at either pad; the others grow from there to the middle by one ratio. Without, all are alike.
    """

    core: int = Field(2, ge=1, le=16)
    rings: int = Field(1, ge=0, le=16)
    layers: int = Field(6, ge=2, le=64)
    pad_layer: Length | None = Field(None, gt=0)
    pad_layers: int = Field(2, ge=1, le=16)
    copper_layers: int = Field(1, ge=1, le=8)


class Imprint(Parameters):
    """Pads imprinted in the faces of board and substrate: each fine joint stands in a square column of its own.

    The column goes through board and substrate. From the pad's edge ``rings`` of elements, each ``growth`` times as
    wide as the one inside it, reach out to a square of side ``size`` (the pitch, if none is given). Its layers are as
    high as ``first_layer`` at the pad and grow with the depth z, h = first_layer + (growth - 1) z. Its sides are tied
    to structured boxes, which should be a quarter of its side long: larger ones make the joint too stiff. Joints that
    cannot be swept (voids, arms) have the same columns and are tied to their pads, which adds 1 % to what they bear.
    """

    size: Length | None = Field(None, gt=0)
    rings: int = Field(5, ge=1, le=32)
    first_layer: Length = Field(1.5e-5, gt=0)
    growth: float = Field(1.65, ge=1.01, le=3.0)


class Package(Parameters):
    """A ball grid array package: the array of joints, substrate and die.

    ``surfaces`` are files (STL, PLY, VTU; lengths in ``surface_unit``) of joints whose shape is given, by their names.
    ``coarse_joint_numerics`` is for joints of a shock that are not fine: solder alone, also in place of their copper.
    ``imprint`` is for the fine ones: without, they are tied to boxes of board and substrate that ignore the pads.
    """

    rows: int = Field(ge=1, le=100)
    columns: int = Field(ge=1, le=100)
    depopulated: tuple[str, ...] = ()
    pitch: Length = Field(gt=0)
    standoff: Length = Field(gt=0)
    board_pad: Pad
    package_pad: Pad
    copper: Copper = Copper()
    substrate: Layer
    die: Layer
    numerics: PackageNumerics = PackageNumerics()
    joint_numerics: JointNumerics = JointNumerics()
    coarse_joint_numerics: JointNumerics = JointNumerics(core=2, rings=0, layers=2)
    imprint: Imprint | None = None
    surfaces: dict[str, str] = Field(default_factory=dict)
    surface_unit: Literal["um", "mm", "m"] = "mm"

    @property
    def column_size(self) -> float | None:
        """Side of the square in which a fine joint stands [m]; none where pads are not imprinted."""
        return (self.imprint.size or self.pitch) if self.imprint else None


Place = Annotated[tuple[float, float], Quantity("mm")]


class Holes(Parameters):
    """Mounting holes of one diameter: four, one near each corner of the board, or ``at`` any places beside the package.

    Those at places have the package's centre as their origin; each needs strips of the board of its own along both
    axes, which holes in line share.
    """

    diameter: Length = Field(gt=0)
    inset_x: Length | None = Field(None, gt=0)
    inset_y: Length | None = Field(None, gt=0)
    at: tuple[Place, ...] = ()


class BoardNumerics(Parameters):
    """How the board is meshed, and how much of it belongs to the meso model.

    ``patch_layers`` layers of elements under the package, and ``patch_margin`` elements around its
    footprint, are part of the meso model: the cut lies inside the FR4 (stability of the held-velocity scheme).
    """

    element_size: Length = Field(5.0e-4, gt=0)
    coarse_size: Length = Field(2.0e-3, gt=0)
    growth: float = Field(1.2, ge=1.01, le=2.0)
    layers: int = Field(4, ge=1, le=40)
    patch_layers: int = Field(2, ge=1, le=40)
    patch_margin: int = Field(2, ge=1, le=20)


class Board(Parameters):
    """The printed circuit board; its top face is z = 0, the origin below the package's centre.

    ``centre`` is where the middle of the board lies: off the origin, if the package is not in the middle.
    """

    length: Length = Field(gt=0)
    width: Length = Field(gt=0)
    thickness: Length = Field(gt=0)
    centre: Place = (0.0, 0.0)
    holes: Holes
    symmetry: Literal["full", "quarter"] = "quarter"
    numerics: BoardNumerics = BoardNumerics()

    @property
    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the whole board begins and ends along x and y [m]."""
        (x, y), (a, b) = self.centre, (0.5 * self.length, 0.5 * self.width)
        return (x - a, x + a), (y - b, y + b)

    @property
    def hole_places(self) -> tuple[tuple[float, float], ...]:
        """Axes of the mounting holes of the whole board [m]."""
        if self.holes.at or self.holes.inset_x is None or self.holes.inset_y is None:
            return self.holes.at
        insets = (self.holes.inset_x, self.holes.inset_y)
        xs, ys = ((low + inset, high - inset) for (low, high), inset in zip(self.ends, insets, strict=True))
        return tuple((x, y) for x in xs for y in ys)

    @property
    def hole_lines(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Places along x and y [m] at which there are mounting holes, in ascending order."""
        xs, ys = ([place[axis] for place in self.hole_places] for axis in (0, 1))
        return _apart(xs), _apart(ys)


def _apart(places: list[float]) -> tuple[float, ...]:
    """Sort places [m] and leave out those that only rounding tells apart."""
    kept: list[float] = []
    for place in sorted(places):
        if not kept or place - kept[-1] > IN_LINE:
            kept.append(place)
    return tuple(kept)


class Warpage(Parameters):
    """Prescribed warpage of the package: w(x, y) = corner (x^2 + y^2) / (x_c^2 + y_c^2), corner joint at (x_c, y_c)."""

    corner: Length = 0.0

    def height(self, x, y, corner_x: float, corner_y: float):
        """Return the lift of the package's underside at (x, y) [m]; scalars or arrays [m]."""
        return self.corner * (x**2 + y**2) / (corner_x**2 + corner_y**2)

    def slope(self, x, y, corner_x: float, corner_y: float):
        """Return the derivatives of the lift along x and y; scalars or arrays."""
        twice = 2.0 * self.corner / (corner_x**2 + corner_y**2)
        return twice * x, twice * y
