"""Joint meshes: the closed surface as swept butterfly hexahedra, with its copper pads, placed in the assembly."""

import math
from dataclasses import dataclass

import numpy as np

from meshing.butterfly import Butterfly, butterfly
from meshing.hexahedra import quad_areas, scaled_jacobian, shortest_lengths, volumes
from meshing.joint_place import JointPlace
from meshing.levels import Levels, layer_cells, solder_levels
from meshing.package_side import PackageSide
from meshing.pads import PadSite, has_rim
from meshing.parameters import JointNumerics, Package
from meshing.surface import ClosedSurface

MINIMUM_SCALED_JACOBIAN = 0.2
GAP_TOLERANCE = 1.0e-3
HEAD_TOLERANCE = 0.03  # of the gap: mean distance of the solder's upper face from the package's pad


class JointMeshError(ValueError):
    """A joint that cannot be meshed to the required quality; names the joint, the value and the allowed range."""


@dataclass(frozen=True, slots=True)
class JointMesh:
    """Hexahedra of one joint in its place.

    Attributes:
        name: JEDEC name.
        points: (n, 3) [m].
        cells: part name -> (c, 8) int32.
        facets: facet set name -> (f, 4) int32, seen from outside counter-clockwise.
        volume_error: of the solder in its place against the body that it fills, relative.
        section_scale: factor by which the inner sections were scaled to keep the volume.
        head_mismatch: largest distance by which its head was sheared to lie on the package's underside [m].
    """

    name: str
    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]
    volume_error: float
    section_scale: float
    head_mismatch: float


def mesh_joint(surface: ClosedSurface, site: PadSite, package: Package, side: PackageSide) -> JointMesh:
    """Mesh a joint and put it in its place.

    Args:
        surface: closed surface in the joint's own frame.
        site: where it sits.
        package: copper and numerics.
        side: the package's underside, which the joint's head follows.

    Raises:
        JointMeshError: the surface spans another gap, or one in which the package is not; it has sections that are not
            star-shaped, needs more layers to keep its volume, or the scaled Jacobian is too small.
    """
    copper = package.copper.thickness if package.copper.layout == "pads" else None
    place = JointPlace.of(surface, site, side, copper or 0.0)
    return _mesh(surface, place, package.joint_numerics, copper)


def mesh_coarse_joint(surface: ClosedSurface, site: PadSite, package: Package, side: PackageSide) -> JointMesh:
    """Mesh a joint by few hexahedra of solder alone, which also fill the place of the copper on its wetted discs.

    Args and errors as ``mesh_joint``.
    """
    overhang = package.copper.thickness if package.copper.layout == "pads" else 0.0
    place = JointPlace.of(surface, site, side, overhang)
    return _mesh(surface, place, package.coarse_joint_numerics, None, overhang)


def _mesh(
    surface: ClosedSurface, place: JointPlace, numerics: JointNumerics, copper: float | None, overhang: float = 0.0
) -> JointMesh:
    """Mesh a joint with copper pads of a thickness [m], or without, its ends drawn out by ``overhang`` [m]."""
    site = place.site
    _check_gap(surface, site)
    section = butterfly(numerics.core, numerics.rings)
    try:
        levels = solder_levels(surface, section, numerics.layers, place, overhang)
        stack = _stack(levels, section, site, copper)
        points, rise = place(stack.points), place.rise(levels.points[-1])
    except ValueError as error:
        raise JointMeshError(f"joint {site.name}: {error}") from error
    _check_head(rise, site)
    _check_quality(points, stack.cells)
    volume = volumes(points, stack.cells[f"solder@{site.name}"]).sum()
    volume_error = float(abs(volume / levels.volume - 1.0))
    mismatch = float(np.abs(rise).max())
    return JointMesh(site.name, points, stack.cells, stack.facets, volume_error, levels.scale, mismatch)


def joint_quality(mesh: JointMesh) -> dict:
    """Return the quality of a joint mesh.

    Returns:
        volume_error, section_scale, head_mismatch (see ``JointMesh``), minimum_scaled_jacobian, and smallest_length:
        material role -> volume over largest face of the thinnest element [m].
    """
    lengths: dict[str, float] = {}
    for part, cells in mesh.cells.items():
        role = part.split("@")[0].split("_")[0]
        lengths[role] = min(lengths.get(role, math.inf), float(shortest_lengths(mesh.points, cells).min()))
    return {
        "volume_error": mesh.volume_error,
        "section_scale": mesh.section_scale,
        "head_mismatch": mesh.head_mismatch,
        "minimum_scaled_jacobian": min(
            float(scaled_jacobian(mesh.points, cells).min()) for cells in mesh.cells.values()
        ),
        "smallest_length": lengths,
    }


@dataclass(slots=True)
class _Stack:
    """A joint in its own frame while its parts are put on each other; z = 0 is the lower solder face."""

    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]


def _stack(levels: Levels, section: Butterfly, site: PadSite, copper: float | None) -> _Stack:
    """Stack solder between its copper pads of thickness ``copper`` [m], or leave it bare between plates."""
    name, count, layers = site.name, levels.points.shape[1], len(levels.points) - 1
    lower, upper = section.quads[:, ::-1], section.quads + layers * count
    solder = layer_cells(section.quads, count, layers)
    stack = _Stack(levels.points.reshape(-1, 3), {f"solder@{name}": solder}, {})
    stack.facets |= {f"pad_board@{name}": lower, f"pad_package@{name}": upper}
    if copper is None:
        stack.facets |= {f"foot@{name}": lower, f"head@{name}": upper}
    else:
        inner, outer = _add_pad(stack, section, 0, -copper, site.pad_radius_board)
        stack.cells[f"copper_board@{name}"] = np.hstack([outer, inner])
        stack.facets[f"foot@{name}"] = outer[:, ::-1]
        inner, outer = _add_pad(stack, section, layers * count, copper, site.pad_radius_package)
        stack.cells[f"copper_package@{name}"] = np.hstack([inner, outer])
        stack.facets[f"head@{name}"] = outer
    stack.cells = {part: cells.astype(np.int32) for part, cells in stack.cells.items()}
    stack.facets = {part: quads.astype(np.int32) for part, quads in stack.facets.items()}
    return stack


def _add_pad(
    stack: _Stack, section: Butterfly, first: int, rise: float, pad_radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Add the nodes of a copper disc on the solder face whose first node is ``first``; return its two faces."""
    face = stack.points[first : first + len(section.points)]
    quads, rim, ids = section.quads, section.rim, first + np.arange(len(section.points))
    wetted_radius = math.sqrt(quad_areas(face, quads).sum() / math.pi)
    if has_rim(pad_radius, wetted_radius):
        centre = face[rim].mean(axis=0)
        edge = len(face) + np.arange(len(rim))
        quads = np.vstack([quads, np.column_stack([rim, edge, np.roll(edge, -1), np.roll(rim, -1)])])
        ids = np.concatenate([ids, len(stack.points) + np.arange(len(rim))])
        stack.points = np.vstack([stack.points, centre + pad_radius / wetted_radius * (face[rim] - centre)])
    beyond = len(stack.points) + np.arange(len(ids))
    stack.points = np.vstack([stack.points, stack.points[ids] + [0.0, 0.0, rise]])
    return ids[quads], beyond[quads]


def _check_gap(surface: ClosedSurface, site: PadSite) -> None:
    bottom, top = float(surface.points[:, 2].min()), float(surface.points[:, 2].max())
    if max(abs(bottom), abs(top - site.gap)) > GAP_TOLERANCE * site.gap:
        span = f"z = {bottom:.6g} to {top:.6g} m, allowed 0 to its gap of {site.gap:.6g} m"
        raise JointMeshError(f"joint {site.name}: its surface spans {span}")


def _check_head(rise: np.ndarray, site: PadSite) -> None:
    limit, mean = HEAD_TOLERANCE * site.gap, float(rise.mean())
    if abs(mean) > limit:
        above = f"{mean:.3g} m above its upper face, allowed +-{limit:.3g} m"
        raise JointMeshError(f"joint {site.name}: the package is {above} ({HEAD_TOLERANCE:g} of its gap)")


def _check_quality(points: np.ndarray, cells: dict[str, np.ndarray]) -> None:
    for part, hexahedra in cells.items():
        worst = float(scaled_jacobian(points, hexahedra).min())
        if worst <= MINIMUM_SCALED_JACOBIAN:
            raise JointMeshError(f"{part}: smallest scaled Jacobian {worst:.3f}, allowed > {MINIMUM_SCALED_JACOBIAN}")
