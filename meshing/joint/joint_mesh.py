"""A joint's mesh in its place: solder and copper pads, named facets, quality; what exceeds a limit is an error.

Its place is that of its pad on the board, its head laid on the package's underside.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.board.pads import PadSite, has_rim
from reflowshock.meshing.core.hexahedra import quad_areas, scaled_jacobian, shortest_lengths, volumes
from reflowshock.meshing.core.quadratic_tetrahedra import QuadraticTetrahedra, tetrahedra_quality
from reflowshock.meshing.joint.column import Column, ColumnMesh, column_pad, grow_column
from reflowshock.meshing.joint.solder import Solder, WettedFace
from reflowshock.meshing.surface.closed_surface import ClosedSurface, pad_planes


class Underside(Protocol):
    """The underside of a package."""

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height (k,) over the board's top face at points (k,), (k,) [m]; ValueError beyond the package."""


@dataclass(frozen=True, slots=True)
class JointPlace:
    """The way of a joint to its site.

    Attributes:
        site: where its pads are.
        side: the package's underside.
        copper: thickness of the copper between the solder and that underside, but for a plate's, which is part of
            the package [m].
        head: the solder's upper face in its own frame.
    """

    site: PadSite
    side: Underside
    copper: float
    head: PadPlanes

    @classmethod
    def of(cls, surface: ClosedSurface, site: PadSite, side: Underside, copper: float) -> "JointPlace":
        """Take the upper face from the joint's closed surface."""
        return cls(site, side, copper, pad_planes(surface))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Move points (n, 3) [m] to the site; shear them in z so that the upper face gets where the package is."""
        share = np.clip(points[:, 2] / self.head.height(*points[:, :2].T), 0.0, 1.0)
        x, y = points[:, 0] + self.site.x, points[:, 1] + self.site.y
        return np.column_stack([x, y, self.site.z_board + points[:, 2] + share * self.rise(points)])

    def rise(self, points: np.ndarray) -> np.ndarray:
        """Return how far the upper face lies below its place at the x and y of points (n, 3) [m]: (n,)."""
        height = self.side.height(points[:, 0] + self.site.x, points[:, 1] + self.site.y)
        return height - self.copper - self.site.z_board - self.head.height(*points[:, :2].T)


MINIMUM_SCALED_JACOBIAN = 0.2
LARGEST_ERROR = 3.0e-3  # of volume, standoff and contact areas


class JointMeshError(ValueError):
    """A joint that cannot be meshed to the required quality; names the joint, the value and the allowed range."""


@dataclass(frozen=True, slots=True)
class JointMesh:
    """Hexahedra of one joint, or of several that are one body, in their place.

    Attributes:
        name: JEDEC name, or several joined by "+".
        points: (n, 3) [m].
        cells: part name -> (c, 8) int32.
        facets: facet set name -> (f, 4) int32, seen from outside counter-clockwise.
        volume_error: of the solder in its place against the body that it fills, relative.
        section_scale: factor by which free outlines were scaled to keep the volume.
        head_mismatch: largest distance by which its head was sheared to lie on the package's underside [m].
        tetrahedra: of which it was made, in its place, if it is free-form.
        record: what else is recorded of it: how it was made, its errors against the given surface.
    """

    name: str
    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]
    volume_error: float
    section_scale: float
    head_mismatch: float
    tetrahedra: QuadraticTetrahedra | None = None
    record: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Pad:
    """A copper pad: name of its joint, radius [m], nodes (k, r) of circles outwards beyond its solder, if any.

    ``swept`` says whether its solder is: its mesh is then a butterfly.
    """

    name: str
    radius: float
    swept: bool
    rims: np.ndarray = field(default_factory=lambda: np.empty((0, 0), dtype=np.int64))


@dataclass(slots=True)
class _Parts:
    """A joint while its parts are put on each other."""

    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]


@dataclass(frozen=True, slots=True)
class CopperPads:
    """Copper pads on the wetted faces of a joint, and what continues them.

    Attributes:
        thickness: of each [m].
        layers: of elements.
        edge: wanted length of elements beyond the solder [m].
        columns: of board and substrate, where the joint stands in some.
    """

    thickness: float
    layers: int = 1
    edge: float = math.inf
    columns: tuple[Column, ...] = ()


def build_joint(solder: Solder, sites: Sequence[PadSite], copper: CopperPads | None, place: JointPlace) -> JointMesh:
    """Put a body of solder in its place and copper pads on its wetted faces.

    Args:
        solder: in its own frame.
        sites: of the joints whose pads it wets: a face lies on the pad that is nearest.
        copper: the pads; none where solder sits on plates, or fills the place of copper.
        place: from the own frame to the assembly.

    Raises:
        JointMeshError: a scaled Jacobian is too small.
    """
    own, pads = solder.points, []
    for face in solder.faces:
        pad = _pad_of(solder, face, sites, place)
        rim = np.empty((0, 0, 3)) if copper is None else _rim(solder, face, pad.radius, copper.edge)
        pads.append(replace(pad, rims=len(own) + np.arange(rim.size // 3).reshape(rim.shape[:2])))
        own = np.vstack([own, rim.reshape(-1, 3)])
    name = place.site.name
    parts = _Parts(place(own), {f"solder@{name}": solder.cells}, {})
    for face, pad in zip(solder.faces, pads, strict=True):
        _add_pad(parts, face, pad, copper)
    cells = {part: hexahedra.astype(np.int32) for part, hexahedra in parts.cells.items()}
    facets = {part: quads.astype(np.int32) for part, quads in parts.facets.items()}
    _check_quality(parts.points, cells)
    heads = np.concatenate([np.unique(face.quads) for face in solder.faces if face.side == "package"])
    volume = float(volumes(parts.points, cells[f"solder@{name}"]).sum())
    tetrahedra = solder.tetrahedra and replace(solder.tetrahedra, points=place(solder.tetrahedra.points))
    return JointMesh(
        name=name,
        points=parts.points,
        cells=cells,
        facets=facets,
        volume_error=abs(volume / solder.volume - 1.0),
        section_scale=solder.scale,
        head_mismatch=float(np.abs(place.rise(solder.points[heads])).max()),
        tetrahedra=tetrahedra,
        record={"tetrahedra": tetrahedra_quality(tetrahedra, solder.volume)} if tetrahedra else {},
    )


def check_errors(mesh: JointMesh, errors: dict[str, float], largest_deviation: float) -> None:
    """Raise JointMeshError where volume, standoff, contact areas or shape [m] are too far from the given surface's."""
    limits = dict.fromkeys(("volume_error", "standoff_error", "contact_area_error"), LARGEST_ERROR)
    limits["shape_deviation"] = largest_deviation
    for name, value in {"volume_error": mesh.volume_error, **errors}.items():
        if not value <= limits[name]:
            raise JointMeshError(f"{name} {value:.3g}, allowed <= {limits[name]:.3g}")


def joint_quality(mesh: JointMesh) -> dict:
    """Return the quality of a joint mesh.

    Returns:
        volume_error, section_scale, head_mismatch (see ``JointMesh``), minimum_scaled_jacobian, smallest_length:
        material role -> volume over largest face of the thinnest element [m], and what the mesh's record holds.
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
        **mesh.record,
    }


def _pad_of(solder: Solder, face: WettedFace, sites: Sequence[PadSite], place: JointPlace) -> _Pad:
    """Find the pad that a face lies on."""
    centre = place(solder.points[face.rim]).mean(axis=0)
    site = min(sites, key=lambda site: math.dist((site.x, site.y), centre[:2]))
    radius = site.pad_radius_board if face.side == "board" else site.pad_radius_package
    return _Pad(site.name, radius, solder.tetrahedra is None)


def _rim(solder: Solder, face: WettedFace, pad_radius: float, edge: float) -> np.ndarray:
    """Return circles of nodes (k, r, 3) out to a copper pad's edge in its plane, none where the solder covers it."""
    wetted_radius = math.sqrt(quad_areas(solder.points, face.quads).sum() / math.pi)
    if not has_rim(pad_radius, wetted_radius):
        return np.empty((0, 0, 3))
    outline = solder.points[face.rim]
    centre = outline.mean(axis=0)
    count = max(1, round((pad_radius - wetted_radius) / edge))
    radii = np.linspace(wetted_radius, pad_radius, count + 1)[1:]
    rims = centre + radii[:, None, None] / wetted_radius * (outline - centre)
    rims[..., 2] = 0.0 if face.side == "board" else solder.planes.height(rims[..., 0], rims[..., 1])
    return rims


def _add_pad(parts: _Parts, face: WettedFace, pad: _Pad, copper: CopperPads | None) -> None:
    """Name a wetted face; put copper on it as wide as its rims reach, and the column that continues it."""
    board, quads, rim = face.side == "board", face.quads, face.rim
    end = "foot" if board else "head"
    facets = {f"pad_{face.side}@{pad.name}": quads, f"{end}@{pad.name}": quads}
    if copper is not None:
        for circle in pad.rims:
            around = np.column_stack([rim, circle, np.roll(circle, -1), np.roll(rim, -1)])
            quads, rim = np.vstack([quads, around]), circle
        step = np.array([0.0, 0.0, -copper.thickness if board else copper.thickness])
        beyond, rim = _add_copper(parts, f"copper_{face.side}@{pad.name}", (quads, rim), (step, copper.layers))
        facets[f"{end}@{pad.name}"] = beyond
        for column in copper.columns:
            if column.side == face.side:
                del facets[f"{end}@{pad.name}"]
                if pad.swept and len(rim) == 4 * column.numerics.core:
                    _add_column(parts, column, pad.name, (beyond, rim))
                else:
                    facets[f"slave@{end}@{pad.name}"] = beyond
                    top = _add_tied_column(parts, column, pad, (beyond, rim), face)
                    parts.facets[f"master@{end}@{pad.name}"] = top
    parts.facets |= {name: faces[:, ::-1] if board else faces for name, faces in facets.items()}


def _add_copper(
    parts: _Parts, name: str, face: tuple[np.ndarray, np.ndarray], layers: tuple[np.ndarray, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Sweep a face, its quads and its outline, along a step [m] in so many layers; return the face at the other end."""
    (quads, rim), (step, count) = face, layers
    nodes, local = np.unique(quads, return_inverse=True)
    levels = [nodes, *(len(parts.points) + len(nodes) * layer + np.arange(len(nodes)) for layer in range(count))]
    shares = np.arange(1, count + 1)[:, None, None] / count
    parts.points = np.vstack([parts.points, (parts.points[nodes] + shares * step).reshape(-1, 3)])
    order = levels if step[2] > 0.0 else levels[::-1]
    local = local.reshape(quads.shape)
    parts.cells[name] = np.vstack([np.hstack([low[local], high[local]]) for low, high in pairwise(order)])
    return levels[-1][local], levels[-1][np.searchsorted(nodes, rim)]


def _add_tied_column(
    parts: _Parts, column: Column, pad: _Pad, end: tuple[np.ndarray, np.ndarray], face: WettedFace
) -> np.ndarray:
    """Add the column under a pad with another mesh, given its outer and its wetted face; return what the pad is on."""
    quads, rim = end
    wetted, all_of_it = (quad_areas(parts.points, some).sum() for some in (face.quads, quads))
    points, section = column_pad(column, parts.points[rim], math.sqrt(wetted / all_of_it), len(pad.rims))
    first = len(parts.points)
    parts.points = np.vstack([parts.points, points])
    return _add_column(parts, column, pad.name, (first + section.quads, first + section.rim)).top


def _add_column(parts: _Parts, column: Column, name: str, face: tuple[np.ndarray, np.ndarray]) -> ColumnMesh:
    """Continue the outer face of a pad, its quads and its outline; what may be tied is ``column_<side>@<joint>``."""
    mesh = grow_column(column, parts.points, *face)
    parts.points = np.vstack([parts.points, mesh.points])
    parts.cells[f"{column.part}@{name}"] = mesh.cells
    free = f"board_bottom@{name}" if column.side == "board" else None
    tied = [mesh.sides] if free else [mesh.sides, mesh.end]
    parts.facets[f"column_{column.side}@{name}"] = np.vstack(tied)
    if free:
        parts.facets[free] = mesh.end
    return mesh


def _check_quality(points: np.ndarray, cells: dict[str, np.ndarray]) -> None:
    for part, hexahedra in cells.items():
        worst = float(scaled_jacobian(points, hexahedra).min())
        if worst <= MINIMUM_SCALED_JACOBIAN:
            raise JointMeshError(f"{part}: smallest scaled Jacobian {worst:.3f}, allowed > {MINIMUM_SCALED_JACOBIAN}")
