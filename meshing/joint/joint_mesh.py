"""A joint's mesh in its place: solder and copper pads, named facets, quality; what exceeds a limit is an error.

Its place is that of its pad on the board, its head laid on the package's underside.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.board.pads import PadSite, has_rim
from reflowshock.meshing.core.hexahedra import quad_areas, scaled_jacobian, shortest_lengths, volumes
from reflowshock.meshing.core.quadratic_tetrahedra import QuadraticTetrahedra, tetrahedra_quality
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
    """A copper pad: name of its joint, radius [m], and the nodes of its edge where it is wider than its solder."""

    name: str
    radius: float
    rim: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=np.int64))


@dataclass(slots=True)
class _Parts:
    """A joint while its parts are put on each other."""

    points: np.ndarray
    cells: dict[str, np.ndarray]
    facets: dict[str, np.ndarray]


def build_joint(solder: Solder, sites: Sequence[PadSite], copper: float | None, place: JointPlace) -> JointMesh:
    """Put a body of solder in its place and copper pads on its wetted faces.

    Args:
        solder: in its own frame.
        sites: of the joints whose pads it wets: a face lies on the pad that is nearest.
        copper: thickness of the pads [m]; none where solder sits on plates, or fills the place of copper.
        place: from the own frame to the assembly.

    Raises:
        JointMeshError: a scaled Jacobian is too small.
    """
    own, pads = solder.points, []
    for face in solder.faces:
        pad = _pad_of(solder, face, sites, place)
        rim = np.empty((0, 3)) if copper is None else _rim(solder, face, pad.radius)
        pads.append(replace(pad, rim=np.arange(len(own), len(own) + len(rim))))
        own = np.vstack([own, rim])
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
    return _Pad(site.name, site.pad_radius_board if face.side == "board" else site.pad_radius_package)


def _rim(solder: Solder, face: WettedFace, pad_radius: float) -> np.ndarray:
    """Return the nodes (r, 3) of a copper pad's edge in its plane, none where the solder covers the pad."""
    wetted_radius = math.sqrt(quad_areas(solder.points, face.quads).sum() / math.pi)
    if not has_rim(pad_radius, wetted_radius):
        return np.empty((0, 3))
    outline = solder.points[face.rim]
    centre = outline.mean(axis=0)
    rim = centre + pad_radius / wetted_radius * (outline - centre)
    rim[:, 2] = 0.0 if face.side == "board" else solder.planes.height(rim[:, 0], rim[:, 1])
    return rim


def _add_pad(parts: _Parts, face: WettedFace, pad: _Pad, copper: float | None) -> None:
    """Name a wetted face, and put copper on it as wide as its rim reaches."""
    board, quads = face.side == "board", face.quads
    end = "foot" if board else "head"
    facets = {f"pad_{face.side}@{pad.name}": quads, f"{end}@{pad.name}": quads}
    if copper is not None:
        if len(pad.rim):
            around = np.column_stack([face.rim, pad.rim, np.roll(pad.rim, -1), np.roll(face.rim, -1)])
            quads = np.vstack([quads, around])
        nodes, local = np.unique(quads, return_inverse=True)
        beyond = len(parts.points) + local.reshape(quads.shape)
        step = [0.0, 0.0, -copper if board else copper]
        parts.points = np.vstack([parts.points, parts.points[nodes] + step])
        parts.cells[f"copper_{face.side}@{pad.name}"] = np.hstack([beyond, quads] if board else [quads, beyond])
        facets[f"{end}@{pad.name}"] = beyond
    parts.facets |= {name: faces[:, ::-1] if board else faces for name, faces in facets.items()}


def _check_quality(points: np.ndarray, cells: dict[str, np.ndarray]) -> None:
    for part, hexahedra in cells.items():
        worst = float(scaled_jacobian(points, hexahedra).min())
        if worst <= MINIMUM_SCALED_JACOBIAN:
            raise JointMeshError(f"{part}: smallest scaled Jacobian {worst:.3f}, allowed > {MINIMUM_SCALED_JACOBIAN}")
