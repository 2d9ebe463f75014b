"""Parameters of the geometry: array, pads, package, board, warpage.

All values are SI floats; ``Quantity`` names the unit that case files and messages use.
"""

from typing import Annotated, Literal

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

Length = Annotated[float, Quantity("mm")]
IN_LINE = 1.0e-9  # m: holes whose coordinates along an axis differ by less are in line


class Pad(Parameters):
    """Circular copper pad and the opening of the solder mask above it.

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
    """Copper under and above the joints (thin plates of 0.02 mm in H 4.3)."""

    thickness: Length = Field(2.0e-5, gt=0)
    layout: Literal["pads", "plate"] = "pads"


class Layer(Parameters):
    """Rectangular, centred layer of the package: substrate or die."""

    length: Length = Field(gt=0)
    width: Length = Field(gt=0)
    thickness: Length = Field(gt=0)
    elements: int = Field(2, ge=1, le=20)


class PackageNumerics(Parameters):
    """Mesh parameters of the package."""

    element_size: Length = Field(5.0e-4, gt=0)


class JointNumerics(Parameters):
    """Mesh parameters of a joint: a butterfly cross-section swept from pad to pad.

    ``pad_layer`` is the thickness over which stress and plastic work are averaged. At each pad ``pad_layers`` of the
    ``layers`` divide it equally; the other layers grow towards the middle by a constant ratio. Without ``pad_layer``
    all layers are equally high.
    """

    core: int = Field(2, ge=1, le=16)
    rings: int = Field(1, ge=0, le=16)
    layers: int = Field(6, ge=2, le=64)
    pad_layer: Length | None = Field(None, gt=0)
    pad_layers: int = Field(2, ge=1, le=16)
    copper_layers: int = Field(1, ge=1, le=8)


class Imprint(Parameters):
    """Pads imprinted in the faces of board and substrate, so that each fine joint stands in a square column.

    The column extends through board and substrate. From the edge of the pad ``rings`` of elements, each ``growth``
    times as wide as the previous one, extend to a square of side ``size`` (default: the pitch). Its layers have the
    height ``first_layer`` at the pad and grow with the depth z, h = first_layer + (growth - 1) z. Its sides are tied to
    structured boxes, whose edges should be a quarter of its side; larger boxes make the joint too stiff. Joints that
    cannot be swept (voids, arms) have the same columns and are tied to their pads, which increases their load by 1 %.
    """

    size: Length | None = Field(None, gt=0)
    rings: int = Field(5, ge=1, le=32)
    first_layer: Length = Field(1.5e-5, gt=0)
    growth: float = Field(1.65, ge=1.01, le=3.0)


class Package(Parameters):
    """Ball grid array package: array of joints, substrate and die.

    ``surfaces`` maps names of joints to files with their shapes (STL, PLY, VTU; lengths in ``surface_unit``).
    ``coarse_joint_numerics`` applies to the coarse joints of a shock: solder only, which also replaces their copper.
    ``imprint`` applies to fine joints; without it, they are tied to boxes of board and substrate that ignore the pads.
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
        """Side of the square column of a fine joint [m]; None if pads are not imprinted."""
        return (self.imprint.size or self.pitch) if self.imprint else None


Place = Annotated[tuple[float, float], Quantity("mm")]


class Holes(Parameters):
    """Mounting holes of one diameter: four near the corners of the board, or ``at`` any positions around the package.

    Positions are relative to the centre of the package. Each hole needs strips of the board along both axes, which
    only holes in line with it may share.
    """

    diameter: Length = Field(gt=0)
    inset_x: Length | None = Field(None, gt=0)
    inset_y: Length | None = Field(None, gt=0)
    at: tuple[Place, ...] = ()


class BoardNumerics(Parameters):
    """Mesh parameters of the board, and the size of its patch that belongs to the meso model.

    The patch has ``patch_layers`` layers of elements under the package and ``patch_margin`` elements around its
    footprint. Its boundary lies inside the FR4, because the held-velocity scheme is stable only there.
    """

    element_size: Length = Field(5.0e-4, gt=0)
    coarse_size: Length = Field(2.0e-3, gt=0)
    growth: float = Field(1.2, ge=1.01, le=2.0)
    layers: int = Field(4, ge=1, le=40)
    patch_layers: int = Field(2, ge=1, le=40)
    patch_margin: int = Field(2, ge=1, le=20)


class Board(Parameters):
    """Printed circuit board; its top face is z = 0, the origin lies below the centre of the package.

    ``centre`` is the position of the centre of the board, which differs from the origin if the package is off-centre.
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
        """Coordinates of the ends of the whole board along x and along y [m]."""
        (x, y), (a, b) = self.centre, (0.5 * self.length, 0.5 * self.width)
        return (x - a, x + a), (y - b, y + b)

    @property
    def hole_places(self) -> tuple[tuple[float, float], ...]:
        """Positions in plan of the mounting holes of the whole board [m]."""
        if self.holes.at or self.holes.inset_x is None or self.holes.inset_y is None:
            return self.holes.at
        insets = (self.holes.inset_x, self.holes.inset_y)
        xs, ys = ((low + inset, high - inset) for (low, high), inset in zip(self.ends, insets, strict=True))
        return tuple((x, y) for x in xs for y in ys)

    @property
    def hole_lines(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Coordinates of the mounting holes along x and along y, ascending, each once [m]."""
        xs, ys = ([centre[axis] for centre in self.hole_places] for axis in (0, 1))
        return _distinct(xs), _distinct(ys)


def _distinct(coordinates: list[float]) -> tuple[float, ...]:
    """Sort coordinates [m] and drop those that differ only by rounding."""
    distinct: list[float] = []
    for coordinate in sorted(coordinates):
        if not distinct or coordinate - distinct[-1] > IN_LINE:
            distinct.append(coordinate)
    return tuple(distinct)


class Warpage(Parameters):
    """Prescribed warpage of the package: w(x, y) = corner (x^2 + y^2) / (x_c^2 + y_c^2), corner joint at (x_c, y_c)."""

    corner: Length = 0.0

    def height(self, x, y, corner_x: float, corner_y: float):
        """Return the lift of the package's underside at (x, y), scalars or arrays [m]."""
        return self.corner * (x**2 + y**2) / (corner_x**2 + corner_y**2)

    def slope(self, x, y, corner_x: float, corner_y: float):
        """Return the derivatives of the lift along x and y at (x, y), scalars or arrays."""
        twice = 2.0 * self.corner / (corner_x**2 + corner_y**2)
        return twice * x, twice * y
