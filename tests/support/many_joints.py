"""Two hundred deterministic joints of exactly known shape, and the outcome of meshing them."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reflowshock.cases.hard.trials import surfaces
from reflowshock.cases.hard.trials.joints import measured, mesh_at, sites_of
from reflowshock.cases.hard.trials.packages import MM
from reflowshock.cases.hard.trials.surfaces import bridged_pair, laid_between, revolve, with_void
from reflowshock.meshing.board.pads import PadSite
from reflowshock.meshing.joint.joint_mesh import JointMesh
from reflowshock.meshing.joint.solder_mesh import JointMeshError, joint_quality
from reflowshock.meshing.surface.closed_surface import ClosedSurface, close_surface, pad_planes

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
    """Joint, or two joined ones, and their pad sites."""

    kind: str
    surface: ClosedSurface
    sites: tuple[PadSite, ...]


def samples(every: int = 1) -> Iterator[Sample]:
    """Yield every ``every``-th joint of each kind, including the first: its kind, closed surface and pad sites."""
    for seed, (kind, count) in enumerate(COUNTS.items()):
        generator = np.random.default_rng(seed)
        for number in range(count):
            made = SHAPES[kind](generator, number)
            if number % every == 0:
                yield Sample(kind, made, sites_of(made, kind == "bridged"))


def mesh(sample: Sample) -> JointMesh:
    """Return the mesh of a joint at its pad site."""
    return mesh_at(sample.surface, sample.sites).mesh


def outcome(sample: Sample) -> dict:
    """Mesh a joint and measure the result.

    Volume and smallest scaled Jacobian are measured independently of the mesher.

    Returns:
        ``kind``, ``method`` ("swept", "free-form" or "refused"), errors, ``scaled_jacobian``, ``smallest_length`` [m],
        reasons of failed attempts ``missed``, and ``seconds`` (processor time); ``reason`` if refused.
    """
    start = time.process_time()
    try:
        made = mesh_at(sample.surface, sample.sites)
    except JointMeshError as error:
        return {"kind": sample.kind, "method": "refused", "reason": str(error), "seconds": time.process_time() - start}
    quality = joint_quality(made.mesh)
    return {
        "kind": sample.kind,
        "method": quality["method"],
        **measured(made),
        "smallest_length": quality["smallest_length"]["solder"],
        "missed": [way["missed"] for way in quality["tries"]],
        "seconds": time.process_time() - start,
    }


def _revolved(generator: np.random.Generator, bulge: tuple[float, float]) -> ClosedSurface:
    """Return a barrel or hourglass between discs of two radii; bulge over the smaller one."""
    gap, lower, upper = generator.uniform(0.2, 0.45) * MM, *generator.uniform(0.18, 0.28, 2) * MM
    share = np.linspace(0.0, 1.0, LEVELS)
    depth = generator.uniform(*bulge) * min(lower, upper)
    profile = lower + (upper - lower) * share + 4.0 * depth * share * (1.0 - share)
    return close_surface(*revolve(profile, gap, AROUND))


def barrel(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a random barrel or cylinder, a body of revolution; ``number`` is not used."""
    return _revolved(generator, (0.0, 0.7))


def hourglass(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a random hourglass or cylinder, a body of revolution; ``number`` is not used."""
    return _revolved(generator, (-0.5, 0.0))


def shifted(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a random joint shifted by up to 0.3 radius; it has the full shift if ``number`` is a multiple of 5."""
    shift = 0.3 * 0.18 * MM * (1.0 if number % 5 == 0 else generator.uniform())
    angle = generator.uniform(0.0, 2.0 * np.pi)
    return laid_between(_revolved(generator, (-0.3, 0.6)), (shift * np.cos(angle), shift * np.sin(angle)), (0.0, 0.0))


def tilted(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a random shifted joint tilted by up to 5 degrees, the full tilt if ``number`` is a multiple of 5."""
    angles = generator.uniform(0.0, 2.0 * np.pi, 2)
    slope = np.tan(np.radians(5.0 if number % 5 == 0 else generator.uniform(0.0, 5.0)))
    shift = 0.3 * 0.18 * MM * generator.uniform()
    to = (slope * np.cos(angles[0]), slope * np.sin(angles[0]))
    return laid_between(_revolved(generator, (-0.3, 0.6)), (shift * np.cos(angles[1]), shift * np.sin(angles[1])), to)


def overflow(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return solder on the mask: a sphere that meets both plates at 120 to 150 degrees, beyond the pads."""
    angle, gap = np.radians(generator.uniform(120.0, 150.0)), generator.uniform(0.25, 0.4) * MM
    return surfaces.overflow(gap, angle, 0.3 * MM, AROUND, LEVELS)


def lobed(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a star-shaped barrel with two to four lobes."""
    return surfaces.lobed(0.3 * MM, 0.24 * MM, 2 + number % 3, generator.uniform(0.1, 0.3), LEVELS)


def hooked(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a joint with an arm that bends round a bay, not star-shaped."""
    return surfaces.hooked(0.3 * MM, generator.uniform(0.35, 0.5) * MM)


def bridged(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a random pair of joints that a solder bridge connects; ``number`` is not used."""
    gap = 0.31 * MM
    return bridged_pair(gap, 1.0 * MM, generator.uniform(0.3, 0.36) * MM, generator.uniform(0.08, 0.12) * MM)


def void(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a random barrel with a spherical void near its middle; ``number`` is not used."""
    whole = _revolved(generator, (0.1, 0.4))
    middle = 0.5 * pad_planes(whole).gap
    return with_void(whole, (*generator.uniform(-0.05, 0.05, 2) * MM, middle), generator.uniform(0.04, 0.07) * MM)


def two_voids(generator: np.random.Generator, number: int) -> ClosedSurface:
    """Return a random barrel with two spherical voids at fixed positions; ``number`` is not used."""
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
