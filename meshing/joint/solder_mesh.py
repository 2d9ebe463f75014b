"""Joint meshes: the closed surface of a joint, or of two that are bridged, as hexahedra in its place.

A coarse joint (``package.coarse_joint_numerics``) is solder alone, also in place of its copper: eight hexahedra, tied
by the same facet sets. In bga_drop its step is nine times that of copper and nearly three times that of fine solder. A
joint that few hexahedra cannot follow keeps its fine mesh; ``fine_instead`` in ``coarse_quality.json`` says why.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from reflowshock.meshing.board.estimate import element_edge
from reflowshock.meshing.board.pads import PadSite
from reflowshock.meshing.board.parameters import Package
from reflowshock.meshing.joint.attempts import attempts, first_good
from reflowshock.meshing.joint.column import Column
from reflowshock.meshing.joint.joint_mesh import (
    CopperPads,
    JointMesh,
    JointMeshError,
    JointPlace,
    Underside,
    build_joint,
    joint_quality,
)
from reflowshock.meshing.joint.swept import swept_solder
from reflowshock.meshing.surface.closed_surface import BOARD_PAD, PACKAGE_PAD, ClosedSurface

__all__ = [
    "JointMesh",
    "JointMeshError",
    "joint_quality",
    "mesh_bridge",
    "mesh_coarse_joint",
    "mesh_coarse_or_fine",
    "mesh_joint",
]

GAP_TOLERANCE = 1.0e-3
HEAD_TOLERANCE = 0.03  # of the gap: mean distance of the solder's upper face from the package's pad


def mesh_joint(
    surface: ClosedSurface, site: PadSite, package: Package, side: Underside, columns: tuple[Column, ...] = ()
) -> JointMesh:
    """Mesh a joint and put it in its place.

    Args:
        surface: closed surface in the joint's own frame.
        site: where it sits.
        package: copper and numerics.
        side: the package's underside, which the joint's head follows.
        columns: of board and substrate that continue its pads.

    Raises:
        JointMeshError: the surface spans another gap, or one in which the package is not, or no mesh of it meets its
            bars; tells what each of them missed.
    """
    return _mesh(surface, site, [site], (package, side, columns))


def mesh_bridge(surface: ClosedSurface, sites: Sequence[PadSite], package: Package, side: Underside) -> JointMesh:
    """Mesh two joints that are one body.

    Args:
        surface: closed surface; its origin is midway between the axes, the second lies towards +x from the first.
        sites: of both, the first to the left.
        package: copper and numerics.
        side: the package's underside.

    Raises: as ``mesh_joint``.
    """
    first, second = sites
    _check_distance(surface, first, second)
    turn = math.atan2(second.y - first.y, second.x - first.x)
    cosine, sine = math.cos(turn), math.sin(turn)
    turned = surface.points @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    middle = replace(
        first,
        name=f"{first.name}+{second.name}",
        x=0.5 * (first.x + second.x),
        y=0.5 * (first.y + second.y),
        gap=0.5 * (first.gap + second.gap),
    )
    return _mesh(replace(surface, points=turned), middle, sites, (package, side, ()))


def mesh_coarse_joint(surface: ClosedSurface, site: PadSite, package: Package, side: Underside) -> JointMesh:
    """Mesh a joint by few hexahedra of solder alone, which also fill the place of the copper on its wetted discs.

    Args and errors as ``mesh_joint``.
    """
    overhang = package.copper.thickness if package.copper.layout == "pads" else 0.0
    place = JointPlace.of(surface, site, side, overhang)
    _check_place(surface, place)
    try:
        solder = swept_solder(surface, package.coarse_joint_numerics, place, overhang)
        return build_joint(solder, [site], None, place)
    except ValueError as error:
        raise JointMeshError(f"joint {site.name}: {error}") from error


def mesh_coarse_or_fine(
    surface: ClosedSurface, fine: JointMesh, at: tuple[Package, PadSite], side: Underside
) -> JointMesh:
    """Mesh a joint by few hexahedra; where they cannot follow its shape, its fine mesh stands for them and says why.

    It then is tied to boxes, too, so it is meshed again where columns continue its pads.

    Args:
        surface: closed surface in the joint's own frame.
        fine: its fine mesh.
        at: the package and where the joint sits.
        side: the package's underside.
    """
    package, site = at
    try:
        return mesh_coarse_joint(surface, site, package, side)
    except JointMeshError as error:
        alone = fine if package.imprint is None else mesh_joint(surface, site, package, side)
        return replace(alone, tetrahedra=None, record=alone.record | {"fine_instead": str(error)})


def _mesh(
    surface: ClosedSurface,
    site: PadSite,
    sites: Sequence[PadSite],
    above: tuple[Package, Underside, tuple[Column, ...]],
) -> JointMesh:
    """Mesh a body whose own frame is at a site, on the pads of its sites."""
    package, side, columns = above
    copper = _copper_pads(package, columns)
    place = JointPlace.of(surface, site, side, copper.thickness if copper else 0.0)
    _check_place(surface, place)
    ways = attempts(surface, package.joint_numerics, place)
    return first_good(surface, ways, site.name, partial(build_joint, sites=sites, copper=copper, place=place))


def _copper_pads(package: Package, columns: tuple[Column, ...]) -> CopperPads | None:
    """Return the pads of fine joints, none where copper is a plate."""
    if package.copper.layout == "plate":
        return None
    numerics = package.joint_numerics
    edge = element_edge(package, numerics)
    return CopperPads(package.copper.thickness, numerics.copper_layers, edge, columns)


def _check_distance(surface: ClosedSurface, first: PadSite, second: PadSite) -> None:
    """Raise JointMeshError where the body lies across a plane of symmetry: its second joint is then an image."""
    lower = surface.points[np.unique(surface.triangles[surface.boundary == BOARD_PAD])]
    between, distance = float(np.ptp(lower[:, 0])), math.dist((first.x, first.y), (second.x, second.y))
    widest = distance + 4.0 * max(first.pad_radius_board, second.pad_radius_board)
    if not distance < between < widest:
        distances = f"its pads span {between:.4g} m, allowed {distance:.4g} to {widest:.4g} m"
        raise JointMeshError(f"joints {first.name} and {second.name}: {distances}; an image of one may be meant")


def _check_place(surface: ClosedSurface, place: JointPlace) -> None:
    """Raise JointMeshError unless the surface spans its gap and ends where the package is.

    The gap is measured at the package pad's centre: solder that overflows goes off it, up or down a tilted plane.
    """
    site = place.site
    gap = float(place.head.height(*np.array(site.offset)))
    bottom = float(surface.points[:, 2].min())
    if max(abs(bottom), abs(gap - site.gap)) > GAP_TOLERANCE * site.gap:
        span = f"z = {bottom:.6g} to {gap:.6g} m, allowed 0 to its gap of {site.gap:.6g} m"
        raise JointMeshError(f"joint {site.name}: its surface spans {span}")
    upper = surface.points[np.unique(surface.triangles[surface.boundary == PACKAGE_PAD])]
    try:
        limit, mean = HEAD_TOLERANCE * site.gap, float(place.rise(upper).mean())
    except ValueError as error:
        raise JointMeshError(f"joint {site.name}: {error}") from error
    if abs(mean) > limit:
        above = f"{mean:.3g} m above its upper face, allowed +-{limit:.3g} m"
        raise JointMeshError(f"joint {site.name}: the package is {above} ({HEAD_TOLERANCE:g} of its gap)")
