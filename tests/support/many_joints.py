"""Two hundred joints of exactly known shape, deterministic, and how their meshes turn out."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from meshing.hexahedra import scaled_jacobian, volumes
from meshing.joint_mesh import JointMesh
from meshing.pad_planes import PadPlanes
from meshing.pads import PadSite
from meshing.solder_mesh import JointMeshError, joint_quality, mesh_bridge, mesh_joint
from meshing.surface import ClosedSurface, close_surface, enclosed_volume, pad_planes
from tests.support.free_form_surfaces import bridged_pair, of_level_set, with_void
from tests.support.joint_surfaces import laid_between, revolve
from tests.support.meshing_models import MM, package

AROUND, LEVELS = 48, 25
COUNTS = {
    "barrel": 60,
    "hourglass": 40,
    "shifted": 30,
    "tilted": 30,
    "overflow": 20,
    "lobed": 8,
    "hooked": 4,
    "bridged": 4,
    "void": 3,
    "two voids": 1,
}


@dataclass(frozen=True, slots=True)
class Sample:
    """A joint, or two that are one body, and where it goes."""

    kind: str
    surface: ClosedSurface
    sites: tuple[PadSite, ...]


@dataclass(frozen=True, slots=True)
class Underside:
    """A package's underside that is one plane."""

    planes: PadPlanes
    x: float
    y: float
    level: float

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return self.level + self.planes.height(x - self.x, y - self.y)


def samples(every: int = 1) -> Iterator[Sample]:
    """All joints, or every so many of each kind, the first included."""
    for seed, (kind, count) in enumerate(COUNTS.items()):
        generator = np.random.default_rng(seed)
        for number in range(count):
            made = SHAPES[kind](generator, number)
            if number % every == 0:
                yield Sample(kind, made, sites_of(made, kind == "bridged"))


def sites_of(surface: ClosedSurface, pair: bool) -> tuple[PadSite, ...]:
    """The site of a joint, or the two of a pair that is 1 mm apart."""
    planes = pad_planes(surface)
    lower = surface.points[np.unique(surface.triangles[surface.boundary == 1])]
    wetted = float(np.linalg.norm(lower[:, :2], axis=1).max())
    radii = *([0.24 * MM] * 2), *([max(0.29 * MM, wetted)] * 2)
    site = PadSite("A1", 0, 0, 0.0, 0.0, planes.gap, *radii, 0.02 * MM, tuple(planes.offset))
    return (replace(site, x=-0.5 * MM), replace(site, name="A2", x=0.5 * MM)) if pair else (site,)


def mesh(sample: Sample) -> JointMesh:
    """Mesh a joint in its place."""
    first = sample.sites[0]
    whole = package()
    middle = float(np.mean([site.x for site in sample.sites]))
    side = Underside(pad_planes(sample.surface), middle, first.y, first.z_board + whole.copper.thickness)
    if len(sample.sites) == 2:
        return mesh_bridge(sample.surface, sample.sites, whole, side)
    return mesh_joint(sample.surface, first, whole, side)


def outcome(sample: Sample) -> dict:
    """Mesh a joint; tell method, errors, quality, tries and processor seconds, or why it was refused.

    Volume and smallest scaled Jacobian are measured here again, whatever the mesher says of them.
    """
    start = time.process_time()
    try:
        made = mesh(sample)
    except JointMeshError as error:
        return {"kind": sample.kind, "method": "refused", "reason": str(error), "seconds": time.process_time() - start}
    quality = joint_quality(made)
    (solder,) = (cells for part, cells in made.cells.items() if part.startswith("solder@"))
    told = ("method", "standoff_error", "contact_area_error", "shape_deviation")
    return {
        "kind": sample.kind,
        **{name: quality[name] for name in told},
        "volume_error": abs(float(volumes(made.points, solder).sum()) / enclosed_volume(sample.surface) - 1.0),
        "scaled_jacobian": min(float(scaled_jacobian(made.points, cells).min()) for cells in made.cells.values()),
        "hexahedra": len(solder),
        "smallest_length": quality["smallest_length"]["solder"],
        "tries": len(quality["tries"]) + 1,
        "missed": [way["missed"] for way in quality["tries"]],
        "seconds": time.process_time() - start,
    }


def _revolved(generator: np.random.Generator, bulge: tuple[float, float]) -> ClosedSurface:
    """Barrel or hourglass between discs of two radii; bulge over the smaller one."""
    gap, lower, upper = generator.uniform(0.2, 0.45) * MM, *generator.uniform(0.18, 0.28, 2) * MM
    share = np.linspace(0.0, 1.0, LEVELS)
    depth = generator.uniform(*bulge) * min(lower, upper)
    profile = lower + (upper - lower) * share + 4.0 * depth * share * (1.0 - share)
    return close_surface(*revolve(profile, gap, AROUND))


def barrel(generator: np.random.Generator, number: int) -> ClosedSurface:
    return _revolved(generator, (0.0, 0.7))


def hourglass(generator: np.random.Generator, number: int) -> ClosedSurface:
    return _revolved(generator, (-0.5, 0.0))


def shifted(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Shifted by up to 0.3 radius, as far as that every fifth time."""
    shift = 0.3 * 0.18 * MM * (1.0 if number % 5 == 0 else generator.uniform())
    angle = generator.uniform(0.0, 2.0 * np.pi)
    return laid_between(_revolved(generator, (-0.3, 0.6)), (shift * np.cos(angle), shift * np.sin(angle)), (0.0, 0.0))


def tilted(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Tilted by up to 5 degrees, as far as that every fifth time, and shifted."""
    angles = generator.uniform(0.0, 2.0 * np.pi, 2)
    slope = np.tan(np.radians(5.0 if number % 5 == 0 else generator.uniform(0.0, 5.0)))
    shift = 0.3 * 0.18 * MM * generator.uniform()
    to = (slope * np.cos(angles[0]), slope * np.sin(angles[0]))
    return laid_between(_revolved(generator, (-0.3, 0.6)), (shift * np.cos(angles[1]), shift * np.sin(angles[1])), to)


def overflow(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Solder on the mask: a sphere that meets both plates at 120 to 150 degrees, beyond the pads."""
    angle, gap = np.radians(generator.uniform(120.0, 150.0)), generator.uniform(0.25, 0.4) * MM
    radius = 0.5 * gap / np.cos(np.pi - angle)
    neck = max(0.0, 0.3 * MM - radius * np.sin(angle))
    height = np.linspace(-0.5 * gap, 0.5 * gap, LEVELS)
    return close_surface(*revolve(neck + np.sqrt(radius**2 - height**2), gap, AROUND))


def lobed(generator: np.random.Generator, number: int) -> ClosedSurface:
    """A barrel with two to four lobes, star-shaped."""
    points, triangles, lower, upper = revolve(np.full(LEVELS, 0.24 * MM), 0.3 * MM, 96)
    angle = np.arctan2(points[:, 1], points[:, 0])
    wave = np.cos((2 + number % 3) * angle) * np.sin(np.pi * points[:, 2] / (0.3 * MM))
    points[:, :2] *= 1.0 + generator.uniform(0.1, 0.3) * wave[:, None]
    return close_surface(points, triangles, lower, upper)


def hooked(generator: np.random.Generator, number: int) -> ClosedSurface:
    """A joint with an arm that bends round a bay: not star-shaped."""
    gap, reach = 0.3 * MM, generator.uniform(0.35, 0.5) * MM

    def inside(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        height = z - 0.5 * gap
        column = 0.22 * MM - np.sqrt(x**2 + y**2)
        along = np.clip(x, 0.0, reach)
        arm = 0.08 * MM - np.sqrt((x - along) ** 2 + y**2 + height**2)
        up = np.clip(y, 0.0, 0.25 * MM)
        finger = 0.08 * MM - np.sqrt((x - reach) ** 2 + (y - up) ** 2 + height**2)
        sharp = 60.0 / MM
        return np.log(sum(np.exp(sharp * part) for part in (column, arm, finger))) / sharp

    return of_level_set(inside, gap, (0.65 * MM, 0.45 * MM), across=14)


def bridged(generator: np.random.Generator, number: int) -> ClosedSurface:
    gap = 0.31 * MM
    return bridged_pair(gap, 1.0 * MM, generator.uniform(0.3, 0.36) * MM, generator.uniform(0.08, 0.12) * MM)


def void(generator: np.random.Generator, number: int) -> ClosedSurface:
    whole = _revolved(generator, (0.1, 0.4))
    middle = 0.5 * pad_planes(whole).gap
    return with_void(whole, (*generator.uniform(-0.05, 0.05, 2) * MM, middle), generator.uniform(0.04, 0.07) * MM)


def two_voids(generator: np.random.Generator, number: int) -> ClosedSurface:
    return with_void(
        with_void(_revolved(generator, (0.2, 0.4)), (0.1 * MM, 0.0, 0.12 * MM), 0.05 * MM),
        (-0.09 * MM, 0.02 * MM, 0.14 * MM),
        0.04 * MM,
    )


SHAPES = {
    "barrel": barrel,
    "hourglass": hourglass,
    "shifted": shifted,
    "tilted": tilted,
    "overflow": overflow,
    "lobed": lobed,
    "hooked": hooked,
    "bridged": bridged,
    "void": void,
    "two voids": two_voids,
}
