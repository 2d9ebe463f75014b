"""Mesh of a joint in the assembly: solder, copper pads, columns, named facets, and checks of its quality.

A joint moves to its pad on the board and is sheared along z, so that its head lies on the underside of the package.
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
    """Underside of a package as a height field."""

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height above the board's top face at points x, y, all of shape (k,) [m].

        Raises:
            ValueError: A point lies beyond the package.
        """


@dataclass(frozen=True, slots=True)
class JointPlace:
    """Map from the own frame of a joint to its position in the assembly.

    Attributes:
        site: Positions and sizes of the pads.
        side: Underside of the package.
        copper: Thickness of the copper pad between solder and underside [m]; 0 with a copper plate, which is part of
            the package.
        head: Plane of the solder's upper face in its own frame.
    """

    site: PadSite
    side: Underside
    copper: float
    head: PadPlanes

    @classmethod
    def of(cls, surface: ClosedSurface, site: PadSite, side: Underside, copper: float) -> "JointPlace":
        """Build the map, with the plane of the upper face fitted to the closed surface of the joint."""
        return cls(site, side, copper, pad_planes(surface))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Move points (n, 3) [m] to the site, sheared along z so that the upper face lies on the package."""
        share = np.clip(points[:, 2] / self.head.height(*points[:, :2].T), 0.0, 1.0)
        x, y = points[:, 0] + self.site.x, points[:, 1] + self.site.y
        return np.column_stack([x, y, self.site.z_board + points[:, 2] + share * self.rise(points)])

    def rise(self, points: np.ndarray) -> np.ndarray:
        """Return the distance along z from the upper face up to the package at points (n, 3) [m], shape (n,) [m]."""
        height = self.side.height(points[:, 0] + self.site.x, points[:, 1] + self.site.y)
        return height - self.copper - self.site.z_board - self.head.height(*points[:, :2].T)


MINIMUM_SCALED_JACOBIAN = 0.2
LARGEST_ERROR = 3.0e-3  # of volume, standoff and contact areas


class JointMeshError(ValueError):
    """Error for a joint that cannot be meshed well enough; gives the joint, the value and the allowed range."""


@dataclass(frozen=True, slots=True)
class JointMesh:
    """Hexahedra of a joint, or of a bridge of several joints, in the assembly.

    Attributes:
        name: JEDEC name, or several names joined by "+".
        points: Node coordinates, shape (n, 3) [m].
        cells: Part name -> nodes of the hexahedra, shape (c, 8), int32.
        facets: Facet set name -> nodes of the facets, counter-clockwise seen from outside, shape (f, 4), int32.
        volume_error: Relative error of the solder volume.
        section_scale: Factor by which free outlines were scaled to keep the volume.
        head_mismatch: Largest distance by which the head was sheared to lie on the underside of the package [m].
        tetrahedra: Quadratic tetrahedra of the same body in the assembly, for free-form meshes.
        record: Meshing method, deviations from the closed surface, and failed attempts.
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
    """Copper pad of a joint.

    Attributes:
        name: Name of the joint.
        radius: Radius of the copper [m].
        is_swept: Whether the solder on it is swept, so that its mesh is a butterfly.
        rims: Nodes on circles beyond the solder, from inside outwards, shape (k, r).
    """

    name: str
    radius: float
    is_swept: bool
    rims: np.ndarray = field(default_factory=lambda: np.empty((0, 0), dtype=np.int64))


@dataclass(slots=True)
class _Parts:
    """Joint under construction, to which parts are added."""

    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]


@dataclass(frozen=True, slots=True)
class _Face:
    """Face of a part: its quadrilaterals, shape (q, 4), and the nodes of its outline, shape (r,)."""

    quads: np.ndarray
    rim: np.ndarray


@dataclass(frozen=True, slots=True)
class CopperPads:
    """Copper pads on the wetted faces of a joint, and the columns that continue them.

    Attributes:
        thickness: Thickness of each pad [m].
        layers: Number of element layers.
        edge: Target length of elements beyond the solder [m].
        columns: Columns of board and substrate, if pads are imprinted.
    """

    thickness: float
    layers: int = 1
    edge: float = math.inf
    columns: tuple[Column, ...] = ()


def build_joint(solder: Solder, sites: Sequence[PadSite], copper: CopperPads | None, place: JointPlace) -> JointMesh:
    """Move a body of solder into the assembly and add copper pads to its wetted faces.

    Args:
        solder: Hexahedra in the body's own frame, with wetted faces.
        sites: Sites of the joints whose pads the solder wets; each face belongs to the nearest pad.
        copper: Thickness and resolution of the copper pads; None if solder sits on copper plates or replaces the
            copper.
        place: Map from the own frame to the assembly.

    Returns:
        Hexahedra of solder, copper and columns by part name, and named facets, in the assembly.

    Raises:
        JointMeshError: A scaled Jacobian is too small.
    """
    points, pads = solder.points, []
    for face in solder.faces:
        pad = _pad_of(solder, face, sites, place)
        rim = np.empty((0, 0, 3)) if copper is None else _rim(solder, face, pad.radius, copper.edge)
        pads.append(replace(pad, rims=len(points) + np.arange(rim.size // 3).reshape(rim.shape[:2])))
        points = np.vstack([points, rim.reshape(-1, 3)])
    name = place.site.name
    parts = _Parts(place(points), {f"solder@{name}": solder.cells}, {})
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
    """Check volume, standoff, contact areas and shape of a joint mesh against its closed surface.

    Args:
        mesh: Mesh of the joint, with the error of its volume.
        errors: ``standoff_error``, ``contact_area_error`` and ``shape_deviation`` [m], as ``shape_errors`` returns
            them.
        largest_deviation: Largest allowed deviation of the shape [m].

    Raises:
        JointMeshError: An error exceeds its limit.
    """
    limits = dict.fromkeys(("volume_error", "standoff_error", "contact_area_error"), LARGEST_ERROR)
    limits["shape_deviation"] = largest_deviation
    for name, value in {"volume_error": mesh.volume_error, **errors}.items():
        if not value <= limits[name]:
            raise JointMeshError(f"{name} {value:.3g}, allowed <= {limits[name]:.3g}")


def joint_quality(mesh: JointMesh) -> dict:
    """Return measures of the quality of a joint mesh, for the summary of a run.

    Args:
        mesh: Mesh of a joint, with the record of its meshing.

    Returns:
        ``volume_error``, ``section_scale`` and ``head_mismatch`` [m] (see ``JointMesh``); ``minimum_scaled_jacobian``;
        ``smallest_length``, material role -> smallest ratio of volume and largest face of an element [m]; and all
        entries of the record of the mesh.
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
    """Return circles of nodes from the solder to the edge of the copper, shape (k, r, 3) [m]; k = 0 without rim."""
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
    """Name a wetted face and add its copper pad and, if pads are imprinted, the column that continues it."""
    board, quads, rim = face.side == "board", face.quads, face.rim
    end = "foot" if board else "head"
    facets = {f"pad_{face.side}@{pad.name}": quads, f"{end}@{pad.name}": quads}
    if copper is not None:
        for circle in pad.rims:
            around = np.column_stack([rim, circle, np.roll(circle, -1), np.roll(rim, -1)])
            quads, rim = np.vstack([quads, around]), circle
        step = np.array([0.0, 0.0, -copper.thickness if board else copper.thickness])
        outer = _add_copper(parts, f"copper_{face.side}@{pad.name}", _Face(quads, rim), step, copper.layers)
        facets[f"{end}@{pad.name}"] = outer.quads
        for column in copper.columns:
            if column.side == face.side:
                del facets[f"{end}@{pad.name}"]
                if pad.is_swept and len(outer.rim) == 4 * column.numerics.core:
                    _add_column(parts, column, pad.name, outer)
                else:
                    facets[f"slave@{end}@{pad.name}"] = outer.quads
                    top = _add_tied_column(parts, column, pad, outer, face)
                    parts.facets[f"master@{end}@{pad.name}"] = top
    parts.facets |= {name: faces[:, ::-1] if board else faces for name, faces in facets.items()}


def _add_copper(parts: _Parts, name: str, face: _Face, step: np.ndarray, count: int) -> _Face:
    """Sweep a face along a step, shape (3,) [m], in ``count`` layers; return the face at the other end."""
    nodes, local = np.unique(face.quads, return_inverse=True)
    levels = [nodes, *(len(parts.points) + len(nodes) * layer + np.arange(len(nodes)) for layer in range(count))]
    shares = np.arange(1, count + 1)[:, None, None] / count
    parts.points = np.vstack([parts.points, (parts.points[nodes] + shares * step).reshape(-1, 3)])
    order = levels if step[2] > 0.0 else levels[::-1]
    local = local.reshape(face.quads.shape)
    parts.cells[name] = np.vstack([np.hstack([low[local], high[local]]) for low, high in pairwise(order)])
    return _Face(levels[-1][local], levels[-1][np.searchsorted(nodes, face.rim)])


def _add_tied_column(parts: _Parts, column: Column, pad: _Pad, outer: _Face, wetted: WettedFace) -> np.ndarray:
    """Add a column whose mesh differs from the copper's, so that both must be tied.

    Args:
        parts: Joint under construction.
        column: Geometry and resolution of the column.
        pad: Copper pad.
        outer: Outer face of the copper.
        wetted: Wetted face of the solder on it.

    Returns:
        Facets of the column under the copper, shape (t, 4).
    """
    wetted_area, outer_area = (quad_areas(parts.points, quads).sum() for quads in (wetted.quads, outer.quads))
    points, section = column_pad(column, parts.points[outer.rim], math.sqrt(wetted_area / outer_area), len(pad.rims))
    first = len(parts.points)
    parts.points = np.vstack([parts.points, points])
    return _add_column(parts, column, pad.name, _Face(first + section.quads, first + section.rim)).top


def _add_column(parts: _Parts, column: Column, name: str, face: _Face) -> ColumnMesh:
    """Continue the outer face of a pad; the facets that boxes may touch are named ``column_<side>@<joint>``."""
    mesh = grow_column(column, parts.points, face.quads, face.rim)
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
