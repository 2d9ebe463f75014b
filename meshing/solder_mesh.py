"""Joint meshes: the closed surface as swept butterfly hexahedra, with its copper pads, placed in the assembly."""

from dataclasses import dataclass

import numpy as np

from meshing.butterfly import Butterfly, butterfly
from meshing.hexahedra import scaled_jacobian, shortest_lengths, volumes
from meshing.pads import PadSite, lift
from meshing.parameters import Package, Warpage
from meshing.section import cut_segments, radius_by_angle, section_area, section_centroid
from meshing.surface import ClosedSurface, enclosed_volume

MINIMUM_SCALED_JACOBIAN = 0.2
VOLUME_TOLERANCE = 1.0e-6


class JointMeshError(ValueError):
    """A joint that cannot be meshed to the required quality; names the joint, the value and the allowed range."""


@dataclass(frozen=True, slots=True)
class JointMesh:
    """Hexahedra of one joint.

    ``points`` (n, 3) [m]; ``cells``: part name -> (c, 8); ``facets``: facet set name -> (f, 4);
    ``surface_volume`` [m^3]: of the closed surface that it was made from; ``volume`` [m^3]: of its solder before it
    was sheared onto the warped package.
    """

    name: str
    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]
    surface_volume: float
    volume: float


def mesh_joint(surface: ClosedSurface, site: PadSite, package: Package, warpage: Warpage) -> JointMesh:
    """Mesh a joint and put it in its place.

    Args:
        surface: closed surface in the joint's own frame.
        site: where it sits.
        package: copper and numerics.
        warpage: lift of the package, which the joint's head follows.

    Raises:
        JointMeshError: the shape has sections that are not star-shaped, or the scaled Jacobian is too small.
    """
    numerics, copper = package.joint_numerics, package.copper
    section = butterfly(numerics.core, numerics.rings)
    try:
        levels = _solder_levels(surface, section, site.gap, numerics.layers)
    except ValueError as error:
        raise JointMeshError(f"joint {site.name}: {error}") from error
    mesh = _sweep(levels, section, site, copper.thickness if copper.layout == "pads" else None)
    solder = mesh.cells[f"solder@{site.name}"]
    before_shear = float(volumes(mesh.points, solder).sum())
    placed = _placed(mesh.points, site, package, warpage)
    result = JointMesh(site.name, placed, mesh.cells, mesh.facets, enclosed_volume(surface), before_shear)
    _check_quality(result)
    return result


def joint_quality(mesh: JointMesh) -> dict:
    """Quality of a joint mesh.

    Returns:
        volume_error (relative, against the closed surface), minimum_scaled_jacobian, and smallest_length: material
        role -> shortest element length [m].
    """
    lengths: dict[str, float] = {}
    for part, cells in mesh.cells.items():
        role = part.split("@")[0].split("_")[0]
        lengths[role] = min(lengths.get(role, np.inf), float(shortest_lengths(mesh.points, cells).min()))
    return {
        "volume_error": abs(mesh.volume / mesh.surface_volume - 1.0),
        "minimum_scaled_jacobian": min(float(scaled_jacobian(mesh.points, cells).min()) for cells in mesh.cells.values()),
        "smallest_length": lengths,
    }


def _solder_levels(surface: ClosedSurface, section: Butterfly, gap: float, layers: int) -> np.ndarray:
    """Section nodes at every level, (layers + 1, n, 3) [m]; outline areas are the surface's, and so is the volume.

    A polygon and straight layers cut off volume: each outline is scaled to its section's area, then all inner levels
    by one factor to the body's volume.
    """
    heights = np.linspace(0.0, gap, layers + 1)
    inside = np.clip(heights, 1.0e-4 * gap, (1.0 - 1.0e-4) * gap)
    planes = [_section_nodes(surface, section, height) for height in inside]
    levels = np.array([np.column_stack([plane, np.full(len(plane), z)]) for plane, z in zip(planes, heights, strict=True)])
    centres = levels[:, section.rim, :2].mean(axis=1)
    target = enclosed_volume(surface)
    for _ in range(50):
        excess = _swept_volume(levels, section) / target - 1.0
        if abs(excess) < VOLUME_TOLERANCE:
            return levels
        offsets = levels[1:-1, :, :2] - centres[1:-1, None]
        levels[1:-1, :, :2] = centres[1:-1, None] + offsets * (1.0 - 0.5 * excess * layers / max(layers - 1, 1))
    raise ValueError(f"its volume error stays at {excess:.2e}, allowed {VOLUME_TOLERANCE:.0e}; use more layers")


def _section_nodes(surface: ClosedSurface, section: Butterfly, height: float) -> np.ndarray:
    """Section nodes at one height, (n, 2) [m]: the unit disc stretched to the outline along each angle."""
    segments = cut_segments(surface.points, surface.triangles, height)
    centre, area = section_centroid(segments), section_area(segments)
    outline = section.points[section.rim]
    angles = np.arctan2(outline[:, 1], outline[:, 0])
    radii = radius_by_angle(segments, centre, angles)
    x, y = radii * np.cos(angles), radii * np.sin(angles)
    polygon = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    node_angles = np.arctan2(section.points[:, 1], section.points[:, 0])
    order = np.argsort(angles)
    stretch = np.interp(node_angles, angles[order], radii[order], period=2.0 * np.pi) * np.sqrt(area / polygon)
    return centre + stretch[:, None] * section.points


def _swept_volume(levels: np.ndarray, section: Butterfly) -> float:
    points = levels.reshape(-1, 3)
    return float(volumes(points, _layer_cells(section.quads, levels.shape[1], len(levels) - 1)).sum())


def _layer_cells(quads: np.ndarray, nodes: int, layers: int) -> np.ndarray:
    return np.vstack([np.hstack([quads + k * nodes, quads + (k + 1) * nodes]) for k in range(layers)]).astype(np.int32)


@dataclass(slots=True)
class _Sweep:
    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]


def _sweep(levels: np.ndarray, section: Butterfly, site: PadSite, copper: float | None) -> _Sweep:
    """Stack solder between its copper pads; the frame's z = 0 is the lower solder face."""
    count, layers = levels.shape[1], len(levels) - 1
    lower, upper = section.quads, section.quads + layers * count
    mesh = _Sweep(levels.reshape(-1, 3), {f"solder@{site.name}": _layer_cells(section.quads, count, layers)}, {})
    mesh.facets |= {f"pad_board@{site.name}": lower[:, ::-1], f"pad_package@{site.name}": upper}
    if copper is None:
        mesh.facets |= {f"foot@{site.name}": lower[:, ::-1], f"head@{site.name}": upper}
        return mesh
    board = (0, -copper, site.pad_radius_board / site.wetted_radius_board)
    package = (layers * count, copper, site.pad_radius_package / site.wetted_radius_package)
    for side, outer, (first, rise, reach) in (("board", "foot", board), ("package", "head", package)):
        quads = _add_pad(mesh, section, first, rise, max(reach, 1.0))
        cells = np.hstack([quads.inner, quads.outer] if rise > 0 else [quads.outer, quads.inner])
        mesh.cells[f"copper_{side}@{site.name}"] = cells.astype(np.int32)
        mesh.facets[f"{outer}@{site.name}"] = quads.outer if rise > 0 else quads.outer[:, ::-1]
    return mesh


@dataclass(frozen=True, slots=True)
class _PadQuads:
    inner: np.ndarray
    outer: np.ndarray


def _add_pad(mesh: _Sweep, section: Butterfly, first: int, rise: float, reach: float) -> _PadQuads:
    """Add the nodes of a copper disc on the solder face that starts at node ``first``; return its two faces."""
    face = mesh.points[first : first + len(section.points)]
    quads, rim = section.quads, section.rim
    ids = first + np.arange(len(face))
    if reach > 1.0:
        centre = face[rim].mean(axis=0)
        wide = centre + reach * (face[rim] - centre)
        extra = len(face) + np.arange(len(rim))
        ring = np.column_stack([rim, extra, np.roll(extra, -1), np.roll(rim, -1)])
        quads = np.vstack([quads, ring])
        ids = np.concatenate([ids, len(mesh.points) + np.arange(len(rim))])
        mesh.points = np.vstack([mesh.points, wide])
    beyond = len(mesh.points) + np.arange(len(ids))
    mesh.points = np.vstack([mesh.points, mesh.points[ids] + [0.0, 0.0, rise]])
    return _PadQuads(ids[quads], beyond[quads])


def _placed(points: np.ndarray, site: PadSite, package: Package, warpage: Warpage) -> np.ndarray:
    """Move the joint to its site and shear it in z so that its head lies on the warped package."""
    x, y = points[:, 0] + site.x, points[:, 1] + site.y
    tilt = lift(package, warpage, x, y) - lift(package, warpage, site.x, site.y)
    share = np.clip(points[:, 2] / site.gap, 0.0, 1.0)
    return np.column_stack([x, y, site.z_board + points[:, 2] + share * tilt])


def _check_quality(mesh: JointMesh) -> None:
    for part, cells in mesh.cells.items():
        worst = float(scaled_jacobian(mesh.points, cells).min())
        if worst <= MINIMUM_SCALED_JACOBIAN:
            raise JointMeshError(f"{part}: smallest scaled Jacobian {worst:.3f}, allowed > {MINIMUM_SCALED_JACOBIAN}")
