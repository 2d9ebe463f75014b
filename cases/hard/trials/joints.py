"""Joint meshes of known shape at their pad sites, and external triangulations with or without faults."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import meshio
import numpy as np

from reflowshock.cases.hard.trials.packages import MM, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel, sphere
from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.board.pads import PadSite, lift, pad_table
from reflowshock.meshing.board.parameters import JointNumerics, Warpage
from reflowshock.meshing.core.hexahedra import scaled_jacobian, volumes
from reflowshock.meshing.joint.joint_mesh import JointMesh, joint_quality
from reflowshock.meshing.joint.joint_mesh import Underside as Placed
from reflowshock.meshing.joint.solder_mesh import mesh_bridge, mesh_joint
from reflowshock.meshing.surface.closed_surface import ClosedSurface, enclosed_volume, pad_planes
from reflowshock.meshing.surface.user_surface import load_surface

PAIR = 1.0 * MM  # distance of two merged joints


@dataclass(frozen=True, slots=True)
class Underside:
    """Plane underside of a package."""

    planes: PadPlanes
    x: float
    y: float
    level: float

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height (k,) over the board's top face at points (k,), (k,) [m]."""
        return self.level + self.planes.height(x - self.x, y - self.y)


@dataclass(frozen=True, slots=True)
class Meshed:
    """Mesh, its source surface, and the plane or curved underside that its head must reach.

    The copper [m] lies between head and underside.
    """

    mesh: JointMesh
    surface: ClosedSurface
    side: Placed
    copper: float


def sites_of(surface: ClosedSurface, pair: bool) -> tuple[PadSite, ...]:
    """Return the site of a joint, or of a pair 1 mm apart."""
    planes = pad_planes(surface)
    lower = surface.points[np.unique(surface.triangles[surface.boundary == 1])]
    wetted = float(np.linalg.norm(lower[:, :2], axis=1).max())
    pad = max(0.29 * MM, wetted)
    site = PadSite(
        name="A1",
        row=0,
        column=0,
        x=0.0,
        y=0.0,
        gap=planes.gap,
        wetted_radius_board=0.24 * MM,
        wetted_radius_package=0.24 * MM,
        pad_radius_board=pad,
        pad_radius_package=pad,
        z_board=0.02 * MM,
        offset=(float(planes.offset[0]), float(planes.offset[1])),
    )
    return (replace(site, x=-0.5 * PAIR), replace(site, name="A2", x=0.5 * PAIR)) if pair else (site,)


def mesh_at(surface: ClosedSurface, sites: Sequence[PadSite], numerics: JointNumerics | None = None) -> Meshed:
    """Mesh a joint, or two merged ones, under a plane at the height of the head.

    Args:
        surface: Surface of the body.
        sites: One or two sites.
        numerics: Mesh settings; None for the settings of the package.

    Raises:
        JointMeshError: If no mesh meets its quality limits.
    """
    first = sites[0]
    whole = package() if numerics is None else package(joint_numerics=numerics.model_dump())
    middle = float(np.mean([site.x for site in sites]))
    side = Underside(pad_planes(surface), middle, first.y, first.z_board + whole.copper.thickness)
    pair = len(sites) == 2
    made = mesh_bridge(surface, sites, whole, side) if pair else mesh_joint(surface, first, whole, side)
    return Meshed(made, surface, side, whole.copper.thickness)


def mesh_warped(
    corner: float, bulge: float, discs: tuple[float, float], offset: float, numerics: JointNumerics | None = None
) -> Meshed:
    """Mesh the corner joint of a warped small package, in a shape as high as the gap at its head.

    Args:
        corner: Lift of the package over that joint [m].
        bulge: Bulge of the barrel [m].
        discs: Radii of the wetted discs on board and package [m].
        offset: Offset of the package's disc along x [m].
        numerics: Mesh settings; None for the settings of the package.

    Raises:
        JointMeshError: If no mesh meets its quality limits.
    """
    warpage, lower, upper = Warpage(corner=corner), *discs
    whole = package() if numerics is None else package(joint_numerics=numerics.model_dump())
    site = {site.name: site for site in pad_table(whole, board(), warpage)}["A4"]
    rise = float(lift(whole, warpage, site.x + offset, site.y) - lift(whole, warpage, site.x, site.y))
    site = replace(
        site,
        offset=(offset, 0.0),
        gap=site.gap + rise,
        wetted_radius_board=lower,
        wetted_radius_package=upper,
        pad_radius_board=lower,
        pad_radius_package=0.32 * MM,
    )
    surface = barrel(site.gap, bulge, lower, upper, offset)
    side = side_of(warpage, whole)
    return Meshed(mesh_joint(surface, site, whole, side), surface, side, whole.copper.thickness)


def measured(meshed: Meshed) -> dict[str, float]:
    """Return errors against the source surface, smallest scaled Jacobian, and number of solder hexahedra.

    Volume, Jacobian and head are measured independently; standoff, contact areas and deviation are reported by the
    mesher.
    """
    made = meshed.mesh
    quality = joint_quality(made)
    (solder,) = (cells for part, cells in made.cells.items() if part.startswith("solder@"))
    return {
        "volume_error": abs(float(volumes(made.points, solder).sum()) / enclosed_volume(meshed.surface) - 1.0),
        "standoff_error": quality["standoff_error"],
        "contact_area_error": quality["contact_area_error"],
        "shape_deviation": quality["shape_deviation"],
        "scaled_jacobian": float(np.min([scaled_jacobian(made.points, cells).min() for cells in made.cells.values()])),
        "head_error": head_error(meshed),
        "tries": len(quality["tries"]) + 1,
        "hexahedra": len(solder),
    }


def head_error(meshed: Meshed) -> float:
    """Return the largest distance [m] of the solder's upper face from the package's copper."""
    made = meshed.mesh
    heads = [quads for name, quads in made.facets.items() if name.startswith("pad_package@")]
    points = made.points[np.unique(np.concatenate([quads.ravel() for quads in heads]))]
    heights = meshed.side.height(points[:, 0], points[:, 1]) - meshed.copper
    return float(np.abs(points[:, 2] - heights).max())


Triangulation = tuple[np.ndarray, np.ndarray]


def no_fault(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Return the surface unchanged."""
    return points, triangles


def hole(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Remove a triangle."""
    return points, np.delete(triangles, 700, axis=0)


def flipped(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Turn one triangle inwards."""
    triangles = triangles.copy()
    triangles[700] = triangles[700, ::-1]
    return points, triangles


def inside_out(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Turn all triangles inwards."""
    return points, triangles[:, ::-1]


def doubled(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Duplicate all triangles."""
    return points, np.vstack([triangles, triangles])


def two_shells(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Add an outward surface inside the first."""
    return np.vstack([points, 0.99 * points]), np.vstack([triangles, triangles + len(points)])


def crossing(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Push a dent on one side through the other side."""
    points = points.copy()
    near = np.exp(-(((points - [0.28 * MM, 0.0, 0.5 * np.ptp(points[:, 2])]) / (0.06 * MM)) ** 2).sum(axis=1))
    points[:, 0] -= 0.7 * MM * near
    return points, triangles


def void_outside(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Add a void outside the body."""
    more, shell = sphere((1.0 * MM, 0.0, 0.1 * MM), 0.05 * MM)
    return np.vstack([points, more]), np.vstack([triangles, shell[:, ::-1] + len(points)])


def round_top(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Round the upper end."""
    points = points.copy()
    height = np.ptp(points[:, 2])
    points[:, 2] -= 0.2 * (points[:, 0] ** 2 + points[:, 1] ** 2) / (0.3 * MM) * (points[:, 2] / height)
    return points, triangles


def far_too_high(points: np.ndarray, triangles: np.ndarray) -> Triangulation:
    """Scale the body beyond its gap."""
    return points * [1.0, 1.0, 1.3], triangles


FAULTS = {
    fault.__name__: fault
    for fault in (
        no_fault,
        hole,
        flipped,
        inside_out,
        doubled,
        two_shells,
        crossing,
        void_outside,
        round_top,
        far_too_high,
    )
}


NAME = "A4"


def site() -> PadSite:
    """Return the corner joint of a small, flat package."""
    return {pad_site.name: pad_site for pad_site in pad_table(package(), board(), Warpage())}[NAME]


def load_given(fault: str, bulge: float, noise: float, turn: float) -> tuple[ClosedSurface, ClosedSurface]:
    """Write a barrel with a fault to a file and read it.

    Args:
        fault: Name in ``FAULTS``.
        bulge: Bulge of the barrel [m].
        noise: Standard deviation of the vertex noise [m].
        turn: Rotation about the x axis [rad].

    Returns:
        Surface from the file, and the exact barrel.

    Raises:
        SurfaceError: If the surface is refused.
    """
    exact = barrel(site().gap, bulge)
    points, triangles = FAULTS[fault](exact.points, exact.triangles.astype(np.int64))
    points = points + np.random.default_rng(2).normal(0.0, noise, points.shape)
    cosine, sine = np.cos(turn), np.sin(turn)
    points = points @ np.array([[1.0, 0.0, 0.0], [0.0, cosine, sine], [0.0, -sine, cosine]])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "joint.stl"
        meshio.write(path, meshio.Mesh(points / MM, [("triangle", triangles)]))
        return load_surface(path, "mm", site()), exact


def mesh_given(surface: ClosedSurface) -> Meshed:
    """Mesh a surface from a file; raise JointMeshError if no mesh meets its quality limits."""
    whole, side = package(), side_of(Warpage(), package())
    return Meshed(mesh_joint(surface, site(), whole, side), surface, side, whole.copper.thickness)
