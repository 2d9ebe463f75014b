"""Remeshing trials: bodies of known shape and external triangulations are meshed by hexahedra or refused."""

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from reflowshock.cases.hard.trial import Measured, Refused, Trial
from reflowshock.meshing.board.parameters import JointNumerics
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

if TYPE_CHECKING:
    from reflowshock.cases.hard.trials.joints import Meshed
    from reflowshock.meshing.surface.closed_surface import ClosedSurface

PI = 3.14159265
Fault = Literal[
    "no_fault", "hole", "flipped", "inside_out", "doubled", "two_shells", "crossing", "void_outside", "round_top",
    "far_too_high",
]  # fmt: skip
Length = Annotated[float, Quantity("mm")]


class Barrel(Parameters):
    """Parabolic barrel (bulge > 0) or hourglass (bulge < 0) between discs of two radii, with or without a void."""

    kind: Literal["barrel"]
    gap: Length = Field(3.0e-4, gt=0)
    bulge: Length = 0.0
    lower: Length = Field(2.4e-4, gt=0)
    upper: Length = Field(2.4e-4, gt=0)
    void: Length | None = Field(None, gt=0)

    def surface(self) -> "ClosedSurface":
        """Return the closed surface."""
        from reflowshock.cases.hard.trials.surfaces import barrel, with_void

        whole = barrel(self.gap, self.bulge, self.lower, self.upper)
        return whole if self.void is None else with_void(whole, (0.0, 0.0, 0.5 * self.gap), self.void)


class Overflow(Parameters):
    """Solder on the mask: an arc that meets both plates at an angle, with discs wider than the pads."""

    kind: Literal["overflow"]
    gap: Length = Field(3.0e-4, gt=0)
    angle: Annotated[float, Quantity("deg")] = Field(gt=PI / 2.0, lt=PI)
    reach: Length = Field(3.0e-4, gt=0)

    def surface(self) -> "ClosedSurface":
        """Return the closed surface."""
        from reflowshock.cases.hard.trials.surfaces import overflow

        return overflow(self.gap, self.angle, self.reach)


class Lobed(Parameters):
    """Cylinder with lobes at half height, with a depth relative to its radius."""

    kind: Literal["lobed"]
    gap: Length = Field(3.0e-4, gt=0)
    radius: Length = Field(2.4e-4, gt=0)
    lobes: int = Field(ge=2, le=12)
    depth: float = Field(gt=0, lt=1)

    def surface(self) -> "ClosedSurface":
        """Return the closed surface."""
        from reflowshock.cases.hard.trials.surfaces import lobed

        return lobed(self.gap, self.radius, self.lobes, self.depth)


class Hooked(Parameters):
    """Joint with an arm that bends round a bay."""

    kind: Literal["hooked"]
    gap: Length = Field(3.0e-4, gt=0)
    reach: Length = Field(gt=0)

    def surface(self) -> "ClosedSurface":
        """Return the closed surface."""
        from reflowshock.cases.hard.trials.surfaces import hooked

        return hooked(self.gap, self.reach)


class Bridged(Parameters):
    """Two truncated spheres 1 mm apart, joined by a cylinder."""

    kind: Literal["bridged"]
    gap: Length = Field(3.1e-4, gt=0)
    radius: Length = Field(gt=0)
    bridge: Length = Field(gt=0)

    def surface(self) -> "ClosedSurface":
        """Return the closed surface."""
        from reflowshock.cases.hard.trials.joints import PAIR
        from reflowshock.cases.hard.trials.surfaces import bridged_pair

        return bridged_pair(self.gap, PAIR, self.radius, self.bridge)


class BodyTrial(Parameters):
    """Body with an upper pad shifted along x and tilted about y, and its mesh settings."""

    shape: Barrel | Overflow | Lobed | Hooked | Bridged = Field(discriminator="kind")
    offset: Length = 0.0
    tilt: Annotated[float, Quantity("deg")] = Field(0.0, gt=-PI / 6.0, lt=PI / 6.0)
    numerics: JointNumerics = JointNumerics()


class WarpedTrial(Parameters):
    """Corner joint of a small package lifted by ``corner``; its head lies on the paraboloid."""

    corner: Length
    bulge: Length = 0.0
    lower: Length = Field(2.4e-4, gt=0)
    upper: Length = Field(2.4e-4, gt=0)
    offset: Length = 0.0
    numerics: JointNumerics = JointNumerics()


class GivenTrial(Parameters):
    """External triangulation with or without a fault, with vertex noise and a rotation about x."""

    fault: Fault = "no_fault"
    bulge: Length = 4.0e-5
    noise: Annotated[float, Quantity("um")] = Field(0.0, ge=0)
    turn: Annotated[float, Quantity("deg")] = Field(0.0, gt=-PI / 6.0, lt=PI / 6.0)


def body(parameters: BodyTrial) -> dict[str, Measured]:
    """Mesh a body."""
    from math import tan

    from reflowshock.cases.hard.trials.joints import mesh_at, sites_of
    from reflowshock.cases.hard.trials.surfaces import laid_between
    from reflowshock.meshing.joint.solder_mesh import JointMeshError

    shape = parameters.shape
    surface = laid_between(shape.surface(), (parameters.offset, 0.0), (tan(parameters.tilt), 0.0))
    try:
        made = mesh_at(surface, sites_of(surface, shape.kind == "bridged"), parameters.numerics)
    except JointMeshError as error:
        raise Refused(str(error)) from error
    return _measured(made)


def warped(parameters: WarpedTrial) -> dict[str, Measured]:
    """Mesh a joint under a warped package."""
    from reflowshock.cases.hard.trials.joints import mesh_warped
    from reflowshock.meshing.joint.solder_mesh import JointMeshError

    discs = parameters.lower, parameters.upper
    try:
        meshed = mesh_warped(parameters.corner, parameters.bulge, discs, parameters.offset, parameters.numerics)
    except JointMeshError as error:
        raise Refused(str(error)) from error
    return _measured(meshed)


def given(parameters: GivenTrial) -> dict[str, Measured]:
    """Read a triangulation from a file and mesh it."""
    from reflowshock.cases.hard.trials.joints import load_given, mesh_given
    from reflowshock.meshing.surface.closed_surface import SurfaceError, enclosed_volume

    try:
        surface, exact = load_given(parameters.fault, parameters.bulge, parameters.noise, parameters.turn)
    except SurfaceError as error:
        raise Refused(str(error)) from error
    read = Measured(enclosed_volume(surface) / enclosed_volume(exact) - 1.0)
    return _measured(mesh_given(surface)) | {"read_volume_error": read}


def _measured(made: "Meshed") -> dict[str, Measured]:
    from reflowshock.cases.hard.trials.joints import measured

    return {name: Measured(value, MEASURES[name]) for name, value in measured(made).items()}


MEASURES = {
    "volume_error": "",
    "standoff_error": "",
    "contact_area_error": "",
    "shape_deviation": "m",
    "scaled_jacobian": "",
    "head_error": "m",
    "tries": "",
    "hexahedra": "",
}
TRIALS = {
    "body": Trial(BodyTrial, body, MEASURES),
    "warped_joint": Trial(WarpedTrial, warped, MEASURES),
    "given_surface": Trial(GivenTrial, given, MEASURES | {"read_volume_error": ""}),
}
