"""Parameters (SI) of scenes with liquid solder alone: a drop, a joint, two drops, a free oscillating drop.

A scene is resolved into the ``Solder`` and the geometry for the solvers.
"""

import math
from math import inf, pi
from typing import Annotated, Literal, Protocol

from pydantic import Field

from reflowshock.parameters import Parameters
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import (
    FlowEffects,
    Process,
    SchemeNumerics,
    Solder,
    SolderEffects,
    SolderNumerics,
    Switch,
)
from reflowshock.particles.reference.drop_oscillation import rayleigh_frequency
from reflowshock.quantity import Quantity

PI = 3.14159265
Direction = Literal["lift", "shift", "turn"]
DEFAULT_PER_EDGE, DEFAULT_PLACES = 11, 10
# Hu et al. print 10 times the surface tension and 100 times the viscosity of molten SAC solder.
PROPERTIES = {
    "physical": {"density": 8930.0, "surface_tension": 0.4985, "viscosity": 2.27e-3},
    "paper": {"density": 8930.0, "surface_tension": 4.985, "viscosity": 0.227},
}


class FloatingPackage(Parameters):
    """Package that floats on the joint, free to lift, to shift (along x and y) or to turn (about x and y).

    It cannot be free to both shift and turn, since it would roll off. The load presses it down: the weight of the
    package divided by the number of its joints.
    """

    load: Annotated[float, Quantity("mN")] = Field(0.0, ge=0)
    free: tuple[Direction, ...] = Field(("lift", "shift"), min_length=1)


class PackagePath(Parameters):
    """Path of a package from the position of the reflow to another one; omitted coordinates stay unchanged.

    Without a speed the package moves slowly, and the joint comes to rest after each of ``steps`` steps (default 10).
    With a speed, the package moves without stops; this needs inertia and the scheme ispg. The speed refers to
    the centre of the pad, or to its edge in a rotation.
    """

    standoff: Annotated[float | None, Quantity("mm")] = Field(None, gt=0)
    offset: Annotated[float | None, Quantity("mm")] = Field(None, ge=0)
    tilt: Annotated[float | None, Quantity("deg")] = Field(None, gt=-PI / 6.0, lt=PI / 6.0)
    steps: int | None = Field(None, ge=1, le=200)
    speed: Annotated[float | None, Quantity("mm/s")] = Field(None, gt=0)


class Drop(Parameters):
    """Drop that starts as a cube on a uniform wall, or on a round pad in the solder mask (with ``pad_radius``).

    For a wall with hysteresis, ``receding_angle`` and ``advancing_angle`` replace ``contact_angle``. Without any angle
    the drop is free and becomes a sphere.
    Resolution: ``spacing`` or ``particles_per_edge`` of the cube, not both; the default is 11 particles per edge.
    With ``symmetry``, only half or a quarter of the drop is computed; volume and results refer to the whole drop.
    With ``section``, the scheme ispg computes a two-dimensional drop. Axisymmetric: the drop starts as a cylinder as
    high as the cube. Plane: the drop is uniform along y and starts as the section of the cube; volume, energy and
    forces refer to a piece as deep as the cube.
    With ``speed``, the scheme ispg computes an impact, which starts as a spherical cap of 155 degrees.
    """

    volume: Annotated[float, Quantity("mm^3")] = Field(gt=0)
    contact_angle: Annotated[float | None, Quantity("deg")] = Field(None, gt=0, lt=PI)
    receding_angle: Annotated[float | None, Quantity("deg")] = Field(None, gt=0, lt=PI)
    advancing_angle: Annotated[float | None, Quantity("deg")] = Field(None, gt=0, lt=PI)
    pad_radius: Annotated[float | None, Quantity("mm")] = Field(None, gt=0)
    mask_contact_angle: Annotated[float, Quantity("deg")] = Field(math.radians(148.0), gt=0, lt=PI)
    speed: Annotated[float | None, Quantity("m/s")] = Field(None, gt=0)
    spacing: Annotated[float | None, Quantity("mm")] = Field(None, gt=0)
    particles_per_edge: int | None = Field(None, ge=5, le=50)
    symmetry: Literal["none", "half", "quarter"] = "none"
    section: Literal["none", "axisymmetric", "plane"] = "none"

    @property
    def symmetry_axes(self) -> tuple[int, ...]:
        """Normal axes of the planes of symmetry: 0 for x = 0, 1 for y = 0."""
        return {"none": (), "half": (0,), "quarter": (0, 1)}[self.symmetry]

    @property
    def particles(self) -> int:
        """Number of particles of the computed part of the cube."""
        if self.section == "plane":
            return self.count * (1 + 2 * max(3, round(0.5 * (self.count - 1))))
        if self.section != "none":
            return self.count * (1 + round((self.count - 1) / pi**0.5))
        cuts = len(self.symmetry_axes)
        return self.count ** (3 - cuts) * ((self.count + 1) // 2) ** cuts

    @property
    def diameter(self) -> float:
        """Diameter of the free drop [m]."""
        return (6.0 * self.volume / pi) ** (1.0 / 3.0)

    @property
    def edge(self) -> float:
        """Edge of the cube that the drop starts as [m]."""
        return self.volume ** (1.0 / 3.0)

    @property
    def count(self) -> int:
        """Number of particles along an edge of the cube."""
        if self.spacing is not None:
            return max(2, 1 + round(self.edge / self.spacing))
        return self.particles_per_edge or DEFAULT_PER_EDGE

    @property
    def resolution(self) -> float:
        """Initial spacing of the particles [m]."""
        return self.edge / (self.count - 1)

    @property
    def edge_radius(self) -> float:
        """Radius of the pad's edge [m], infinite on a uniform wall."""
        return self.pad_radius or inf

    @property
    def hysteresis(self) -> tuple[float, float] | None:
        """Receding and advancing angle [rad] of a wall with hysteresis."""
        if self.receding_angle is None or self.advancing_angle is None:
            return None
        return self.receding_angle, self.advancing_angle

    @property
    def is_free(self) -> bool:
        """Whether the scene is free of walls."""
        return self.contact_angle is None and self.hysteresis is None

    @property
    def needs_ispg(self) -> bool:
        """Whether only the scheme ispg computes the drop: in section, or striking a wall."""
        return self.section != "none" or self.speed is not None

    @property
    def contact_angles(self) -> dict[str, float]:
        """Contact angles of pad and mask under the names of ``Solder`` [rad]."""
        if self.contact_angle is None:
            return {}
        return {"pad_contact_angle": self.contact_angle, "mask_contact_angle": self.mask_contact_angle}


class Joint(Parameters):
    """Joint between two round pads; its contact lines are pinned or slide, by the angles of pad and mask.

    The upper pad may be offset along x and tilted about y (the +x side down). It is fixed, unless a table
    joint.package lets it float or a table joint.path moves it.
    """

    volume: Annotated[float, Quantity("mm^3")] = Field(gt=0)
    pad_bottom: Annotated[float, Quantity("mm")] = Field(gt=0)
    pad_top: Annotated[float, Quantity("mm")] = Field(gt=0)
    standoff: Annotated[float, Quantity("mm")] = Field(gt=0)
    offset: Annotated[float, Quantity("mm")] = Field(0.0, ge=0)
    tilt: Annotated[float, Quantity("deg")] = Field(0.0, gt=-PI / 6.0, lt=PI / 6.0)
    pad_contact_angle: Annotated[float, Quantity("deg")] = Field(math.radians(5.0), gt=0, lt=PI)
    mask_contact_angle: Annotated[float, Quantity("deg")] = Field(math.radians(148.0), gt=0, lt=PI)
    spacing: Annotated[float, Quantity("mm")] = Field(4.0e-5, gt=0)
    package: FloatingPackage | None = None
    path: PackagePath | None = None

    @property
    def geometry(self) -> JointGeometry:
        """Gap, pad radii, offset and tilt for the solver."""
        return self.geometry_at(self.standoff, self.offset, self.tilt)

    def geometry_at(self, standoff: float, offset: float, tilt: float) -> JointGeometry:
        """Return the geometry for another standoff [m], offset [m] and tilt [rad] of the upper pad."""
        return JointGeometry(standoff, self.pad_bottom, self.pad_top, (offset, 0.0), (0.0, tilt))

    @property
    def path_geometries(self) -> list[JointGeometry]:
        """Geometries after each step of the path, a single one with a speed; empty without a path."""
        if self.path is None:
            return []
        start = (self.standoff, self.offset, self.tilt)
        target = (self.path.standoff, self.path.offset, self.path.tilt)
        ranges = [(a, a if b is None else b) for a, b in zip(start, target, strict=True)]
        steps = self.path.steps or (DEFAULT_PLACES if self.path.speed is None else 1)
        shares = [number / steps for number in range(1, steps + 1)]
        return [self.geometry_at(*(a + share * (b - a) for a, b in ranges)) for share in shares]

    @property
    def needs_ispg(self) -> bool:
        """Whether only the scheme ispg computes the joint: with a package that moves at a speed."""
        return self.path is not None and self.path.speed is not None

    @property
    def path_length(self) -> float:
        """Length of the path [m], with rotations measured at the edge of the upper pad; zero without a path."""
        if not self.path_geometries:
            return 0.0
        end = self.path_geometries[-1]
        turn = self.pad_top * (end.tilt[1] - self.tilt)
        return math.hypot(end.gap - self.standoff, end.offset[0] - self.offset, turn)

    @property
    def resolution(self) -> float:
        """Initial spacing of the particles [m]."""
        return self.spacing

    @property
    def contact_angles(self) -> dict[str, float]:
        """Contact angles of pad and mask under the names of ``Solder`` [rad]."""
        return {"pad_contact_angle": self.pad_contact_angle, "mask_contact_angle": self.mask_contact_angle}


class Scene(Protocol):
    """Scene data for the solver: volume [m^3], contact angles [rad] and particle spacing [m]."""

    @property
    def volume(self) -> float: ...  # noqa: D102

    @property
    def contact_angles(self) -> dict[str, float]: ...  # noqa: D102

    @property
    def resolution(self) -> float: ...  # noqa: D102


class Liquid(Parameters):
    """Liquid with a named set of properties, whose values can be overridden individually.

    The set physical is SAC solder; the set paper has the values of Hu et al., with 10 times the surface tension and
    100 times the viscosity.
    """

    parameters: Literal["physical", "paper"] = "physical"
    density: Annotated[float | None, Quantity("kg/m^3")] = Field(None, gt=0)
    surface_tension: Annotated[float | None, Quantity("N/m")] = Field(None, gt=0)
    viscosity: Annotated[float | None, Quantity("Pa*s")] = Field(None, gt=0)

    @property
    def properties(self) -> dict[str, float]:
        """Density, surface tension and viscosity."""
        overrides = {name: getattr(self, name) for name in PROPERTIES["physical"] if getattr(self, name) is not None}
        return PROPERTIES[self.parameters] | overrides


class Fluid(Liquid, Process):
    """Molten solder with a named set of properties, whose values can be overridden individually.

    The set physical is SAC solder; the set paper has the values of Hu et al., with 10 times the surface tension and
    100 times the viscosity.
    """

    effects: FlowEffects = FlowEffects()
    numerics: SchemeNumerics = SchemeNumerics()

    def resolve(self, scene: Scene, gravity: Switch) -> Solder:
        """Return the solder of a scene, with the properties of this liquid.

        The scheme auto becomes energy here; ``scene_checks.with_scheme`` may select another one.

        Args:
            scene: Volume, contact angles and spacing.
            gravity: Switch of gravity.
        """
        numerics = self.numerics.model_dump()
        if self.numerics.scheme == "auto":
            del numerics["scheme"]
        return Solder(
            volume=scene.volume,
            **{name: getattr(self, name) for name in Process.model_fields},
            effects=SolderEffects(gravity=gravity, **self.effects.model_dump()),
            numerics=SolderNumerics(spacing=scene.resolution, **numerics),
            **scene.contact_angles,
            **self.properties,
        )


class Drops(Parameters):
    """Two drops at a distance of centres, which are expected to merge or, with merge = false, to stay apart.

    With a contact angle they start as cubes on a wall and spread; otherwise they are free and start as spheres.
    """

    volume_left: Annotated[float, Quantity("mm^3")] = Field(gt=0)
    volume_right: Annotated[float, Quantity("mm^3")] = Field(gt=0)
    distance: Annotated[float, Quantity("mm")] = Field(gt=0)
    merge: bool = True
    contact_angle: Annotated[float | None, Quantity("deg")] = Field(None, gt=0, lt=PI)
    spacing: Annotated[float, Quantity("mm")] = Field(1.0e-4, gt=0)

    @property
    def needs_ispg(self) -> bool:
        """Whether only the scheme ispg computes the drops: False."""
        return False

    @property
    def volumes(self) -> tuple[float, float]:
        """Both volumes [m^3]."""
        return self.volume_left, self.volume_right

    @property
    def volume(self) -> float:
        """Volume of both together [m^3]."""
        return sum(self.volumes)

    @property
    def resolution(self) -> float:
        """Initial spacing of the particles [m]."""
        return self.spacing

    @property
    def is_free(self) -> bool:
        """Whether the scene is free of walls."""
        return self.contact_angle is None

    @property
    def contact_angles(self) -> dict[str, float]:
        """Contact angle under its name in ``Solder`` [rad]."""
        return {} if self.contact_angle is None else {"pad_contact_angle": self.contact_angle}

    def per_edge(self, volume: float) -> int:
        """Return the number of particles along an edge of a cube of a volume [m^3]."""
        return 1 + round(volume ** (1.0 / 3.0) / self.spacing)

    @property
    def particles(self) -> int:
        """Number of particles of both cubes, an approximation for spheres."""
        return sum(self.per_edge(volume) ** 3 for volume in self.volumes)


class Oscillation(Parameters):
    """Free drop that oscillates in its second mode, starting as a sphere with the velocity of that mode.

    The amplitude is in radii, the duration in Rayleigh periods. The scheme inertia uses moving tetrahedra; ispg is a
    stable form of the particle method of Hu et al.
    """

    volume: Annotated[float, Quantity("mm^3")] = Field(gt=0)
    amplitude: float = Field(0.1, gt=0, le=0.3)
    periods: float = Field(2.0, ge=1, le=50)
    particles_per_radius: int = Field(4, ge=2, le=20)
    steps_per_period: int = Field(100, ge=16)
    scheme: Literal["inertia", "ispg"] = "inertia"

    @property
    def radius(self) -> float:
        """Radius of the sphere [m]."""
        return (0.75 * self.volume / pi) ** (1.0 / 3.0)

    @property
    def particles(self) -> int:
        """Number of particles: 10 k^2 + 2 on shell k, one at the centre."""
        return 1 + sum(10 * shell**2 + 2 for shell in range(1, self.particles_per_radius + 1))

    def resolve(self, liquid: Liquid) -> Solder:
        """Return the solder of the drop."""
        scheme = "ispg" if self.scheme == "ispg" else "energy"
        numerics = SolderNumerics(spacing=self.radius / self.particles_per_radius, scheme=scheme)
        return Solder(volume=self.volume, numerics=numerics, **liquid.properties)


def rayleigh_period(scene: Oscillation, solder: Solder) -> float:
    """Return the period of the second mode at small amplitude and viscosity [s].

    Args:
        scene: Free drop, of which the radius is used.
        solder: Density and surface tension.
    """
    return 2.0 * pi / rayleigh_frequency(2, scene.radius, solder.density, solder.surface_tension)
