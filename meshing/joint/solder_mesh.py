"""Joint meshes: hexahedra in the assembly from the closed surface of a joint or of two bridged joints.

A coarse joint (``package.coarse_joint_numerics``) consists of solder only, which also replaces its copper: eight
hexahedra, tied by the same facet sets. In bga_drop its critical time step is nine times the copper's and nearly three
times that of fine solder. A joint whose shape a few hexahedra cannot represent keeps its fine mesh; ``fine_instead`` in
``coarse_quality.json`` gives the reason.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from reflowshock.meshing.board.estimate import element_edge
from reflowshock.meshing.board.pads import PadSite
from reflowshock.meshing.board.parameters import Package
from reflowshock.meshing.joint.attempts import attempts, first_valid_mesh
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
    """Mesh a joint in its position in the assembly.

    Args:
        surface: Closed surface of the solder in the joint's own frame: board's pad at z = 0, its centre on the axis.
        site: Positions and sizes of its pads.
        package: Package with copper and numerics.
        side: Underside of the package, which the head of the joint follows.
        columns: Columns of board and substrate that continue the pads.

    Returns:
        Hexahedra of solder, copper and columns by part name, with named facets and a record of the meshing.

    Raises:
        JointMeshError: The height of the surface differs from the gap, the package is not at its upper end, or every
            meshing attempt fails its checks; the message gives the reason of each.
    """
    copper = _copper_pads(package, columns)
    to_assembly = JointPlace.of(surface, site, side, copper.thickness if copper else 0.0)
    return _mesh(surface, package, [site], copper, to_assembly)


def mesh_bridge(surface: ClosedSurface, sites: Sequence[PadSite], package: Package, side: Underside) -> JointMesh:
    """Mesh two joints that a solder bridge connects to one body.

    Args:
        surface: Closed surface; its origin is midway between the joints, the second lies towards +x of the first.
        sites: Sites of both joints, the left one first.
        package: Package with copper and numerics.
        side: Underside of the package.

    Returns:
        Hexahedra of solder and copper by part name, with named facets and a record of the meshing.

    Raises:
        JointMeshError: The height of the surface differs from the gap, every meshing attempt fails its checks, or the
            body crosses a plane of symmetry.
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
    body, copper = replace(surface, points=turned), _copper_pads(package, ())
    to_assembly = JointPlace.of(body, middle, side, copper.thickness if copper else 0.0)
    return _mesh(body, package, sites, copper, to_assembly)


def mesh_coarse_joint(surface: ClosedSurface, site: PadSite, package: Package, side: Underside) -> JointMesh:
    """Mesh a joint with a few hexahedra of solder, which also replace the copper on its wetted discs.

    Args:
        surface: Closed surface of the solder in the joint's own frame: board's pad at z = 0, its centre on the axis.
        site: Positions and sizes of its pads.
        package: Package with copper and the numerics of coarse joints.
        side: Underside of the package, which the head of the joint follows.

    Returns:
        Hexahedra of solder, in the assembly, with named facets and a record of the meshing.

    Raises:
        JointMeshError: The joint cannot be swept, a scaled Jacobian is too small, volume or shape differ too much from
            the surface, or the height of the surface differs from the gap.
    """
    overhang = package.copper.thickness if package.copper.layout == "pads" else 0.0
    to_assembly = JointPlace.of(surface, site, side, overhang)
    _check_place(surface, to_assembly)
    try:
        solder = swept_solder(surface, package.coarse_joint_numerics, to_assembly, overhang)
        return build_joint(solder, [site], None, to_assembly)
    except ValueError as error:
        raise JointMeshError(f"joint {site.name}: {error}") from error


def mesh_coarse_or_fine(
    surface: ClosedSurface, fine: JointMesh, site: PadSite, package: Package, side: Underside
) -> JointMesh:
    """Mesh a joint with a few hexahedra, or return its fine mesh if these cannot represent its shape.

    The record of a fine mesh gives the reason. Coarse joints are tied to the boxes of the board; a joint with columns
    is therefore meshed again without them.

    Args:
        surface: Closed surface of the solder in the joint's own frame: board's pad at z = 0, its centre on the axis.
        fine: Fine mesh of the joint.
        site: Positions and sizes of its pads.
        package: Package with copper and numerics.
        side: Underside of the package, which the head of the joint follows.

    Returns:
        Coarse mesh, or fine mesh without columns.
    """
    try:
        return mesh_coarse_joint(surface, site, package, side)
    except JointMeshError as error:
        untied = fine if package.imprint is None else mesh_joint(surface, site, package, side)
        return replace(untied, tetrahedra=None, record=untied.record | {"fine_instead": str(error)})


def _mesh(
    surface: ClosedSurface,
    package: Package,
    sites: Sequence[PadSite],
    copper: CopperPads | None,
    to_assembly: JointPlace,
) -> JointMesh:
    """Mesh a body of solder on the pads of the sites that it wets."""
    _check_place(surface, to_assembly)
    candidates = attempts(surface, package.joint_numerics, to_assembly)
    build = partial(build_joint, sites=sites, copper=copper, place=to_assembly)
    return first_valid_mesh(surface, candidates, to_assembly.site.name, build)


def _copper_pads(package: Package, columns: tuple[Column, ...]) -> CopperPads | None:
    """Return the copper pads of a fine joint, or None if the copper is a plate."""
    if package.copper.layout == "plate":
        return None
    numerics = package.joint_numerics
    edge = element_edge(package, numerics)
    return CopperPads(package.copper.thickness, numerics.copper_layers, edge, columns)


def _check_distance(surface: ClosedSurface, first: PadSite, second: PadSite) -> None:
    """Raise JointMeshError if the body crosses a plane of symmetry, so that its second joint is a mirror image."""
    lower = surface.points[np.unique(surface.triangles[surface.boundary == BOARD_PAD])]
    between, distance = float(np.ptp(lower[:, 0])), math.dist((first.x, first.y), (second.x, second.y))
    widest = distance + 4.0 * max(first.pad_radius_board, second.pad_radius_board)
    if not distance < between < widest:
        distances = f"its pads span {between:.4g} m, allowed {distance:.4g} to {widest:.4g} m"
        raise JointMeshError(f"joints {first.name} and {second.name}: {distances}; one may be a mirror image")


def _check_place(surface: ClosedSurface, to_assembly: JointPlace) -> None:
    """Raise JointMeshError unless the surface spans its gap and ends at the package.

    The gap is measured at the centre of the package's pad, because overflowing solder may leave a tilted pad.
    """
    site = to_assembly.site
    gap = float(to_assembly.head.height(*np.array(site.offset)))
    bottom = float(surface.points[:, 2].min())
    if max(abs(bottom), abs(gap - site.gap)) > GAP_TOLERANCE * site.gap:
        span = f"z = {bottom:.6g} to {gap:.6g} m, allowed 0 to its gap of {site.gap:.6g} m"
        raise JointMeshError(f"joint {site.name}: its surface spans {span}")
    upper = surface.points[np.unique(surface.triangles[surface.boundary == PACKAGE_PAD])]
    try:
        limit, mean = HEAD_TOLERANCE * site.gap, float(to_assembly.rise(upper).mean())
    except ValueError as error:
        raise JointMeshError(f"joint {site.name}: {error}") from error
    if abs(mean) > limit:
        above = f"{mean:.3g} m above its upper face, allowed +-{limit:.3g} m"
        raise JointMeshError(f"joint {site.name}: the package is {above} ({HEAD_TOLERANCE:g} of its gap)")
