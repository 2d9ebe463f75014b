"""Ways to mesh a body of solder, the most wanted first; the first whose mesh meets its bars is taken."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from reflowshock.meshing.board.parameters import JointNumerics
from reflowshock.meshing.joint.butterfly import circumradius
from reflowshock.meshing.joint.free_form import free_form_solder
from reflowshock.meshing.joint.joint_mesh import JointMesh, JointMeshError, check_errors
from reflowshock.meshing.joint.levels import Placing
from reflowshock.meshing.joint.shape_errors import shape_errors
from reflowshock.meshing.joint.solder import Solder
from reflowshock.meshing.joint.swept import swept_solder
from reflowshock.meshing.joint.tetrahedra import fill_apart
from reflowshock.meshing.surface.closed_surface import (
    BOARD_PAD,
    PACKAGE_PAD,
    ClosedSurface,
    enclosed_volume,
    pad_planes,
    pieces_of,
)

MOST_LAYERS = 64
FREE_FORM_SIZES = (1.0, 0.75, 1.25)  # of two layers: split in two, an edge is as long as a layer is high
LARGEST_DEVIATION = 0.1  # of the radius of a ball of the same volume, beside that of the wanted polygon from a circle


@dataclass(frozen=True, slots=True)
class Attempt:
    """One way to mesh a body.

    Attributes:
        told: of it.
        make: makes the solder.
        largest_deviation: of its shape, over the radius of a ball of the same volume.
    """

    told: dict[str, Any]
    make: Callable[[], Solder]
    largest_deviation: float


def attempts(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """List the ways to mesh a body: swept, if it is one piece between two pads, then free-form."""
    one_piece = len(pieces_of(surface)) == 1
    if one_piece and all(len(pieces_of(surface, pad)) == 1 for pad in (BOARD_PAD, PACKAGE_PAD)):
        yield from _swept(surface, numerics, place)
    element = 2.0 * pad_planes(surface).gap / numerics.layers
    for share in FREE_FORM_SIZES:
        for cut in (False, True):
            told = {"method": "free-form", "size": share * element, "cut_into_patches": cut}
            yield Attempt(told, partial(_fill, surface, (share * element, cut), place), LARGEST_DEVIATION)


def _swept(surface: ClosedSurface, numerics: JointNumerics, place: Placing) -> Iterator[Attempt]:
    """The wanted resolution, with more layers, and with a finer section as well."""
    taller = {"layers": min(2 * numerics.layers, MOST_LAYERS)}
    for finer in ({}, taller, taller | {"core": numerics.core + 1, "rings": numerics.rings + 1}):
        chosen = numerics.model_copy(update=finer)
        told = {"method": "swept", **chosen.model_dump()}
        corner = circumradius(4 * chosen.core) - 1.0
        yield Attempt(told, partial(swept_solder, surface, chosen, place), LARGEST_DEVIATION + corner)


def _fill(surface: ClosedSurface, how: tuple[float, bool], place: Placing) -> Solder:
    return free_form_solder(surface, fill_apart(surface, *how), place)


def first_good(
    surface: ClosedSurface, ways: Iterator[Attempt], name: str, build: Callable[[Solder], JointMesh]
) -> JointMesh:
    """Return the first mesh that meets its bars; its record tells what others missed.

    Args:
        surface: that it fills.
        ways: to mesh it.
        name: of the joint.
        build: puts solder into its place.

    Raises:
        JointMeshError: none does; tells what each missed.
    """
    radius = math.cbrt(0.75 * enclosed_volume(surface) / math.pi)
    missed: list[dict[str, Any]] = []
    for way in ways:
        try:
            solder = way.make()
            mesh, errors = build(solder), shape_errors(surface, solder)
            check_errors(mesh, errors, way.largest_deviation * radius)
        except ValueError as error:
            missed.append({**way.told, "missed": str(error)})
            continue
        return replace(mesh, record={**way.told, **errors, **mesh.record, "tries": missed})
    told = dict.fromkeys(f"{way['missed']} ({way['method']})" for way in missed)
    raise JointMeshError(f"joint {name}: {'; '.join(told)}")
