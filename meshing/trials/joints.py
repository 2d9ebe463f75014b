"""A joint of known shape is meshed in its place, and the mesh measured again: its volume, elements and head."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.board.pads import PadSite, lift, pad_table
from reflowshock.meshing.board.parameters import JointNumerics, Warpage
from reflowshock.meshing.core.hexahedra import scaled_jacobian, volumes
from reflowshock.meshing.joint.joint_mesh import JointMesh, joint_quality
from reflowshock.meshing.joint.joint_mesh import Underside as Placed
from reflowshock.meshing.joint.solder_mesh import mesh_bridge, mesh_joint
from reflowshock.meshing.surface.closed_surface import ClosedSurface, enclosed_volume, pad_planes
from reflowshock.meshing.trials.models import MM, board, package, side_of
from reflowshock.meshing.trials.surfaces import barrel

PAIR = 1.0 * MM  # distance of two joints that are one body


@dataclass(frozen=True, slots=True)
class Underside:
    """A package's underside that is one plane."""

    planes: PadPlanes
    x: float
    y: float
    level: float

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height (k,) over the board's top face at points (k,), (k,) [m]."""
        return self.level + self.planes.height(x - self.x, y - self.y)


@dataclass(frozen=True, slots=True)
class Meshed:
    """A mesh, the surface that it fills in its own frame, and the plane or curved underside that its head must reach.

    The copper [m] is between head and underside.
    """

    mesh: JointMesh
    surface: ClosedSurface
    side: Placed
    copper: float


def sites_of(surface: ClosedSurface, pair: bool) -> tuple[PadSite, ...]:
    """The site of a joint, or the two of a pair that is 1 mm apart."""
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
    """Mesh a joint, or two that are one body, under a plane that is where its head is.

    Args:
        surface: of the body.
        sites: one or two.
        numerics: how finely; None for the package's own.

    Raises:
        JointMeshError: no mesh meets its bars.
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
    """Mesh the corner joint of a small package that is warped, in a shape as high as the package is over its head.

    Args:
        corner: lift of the package over that joint [m].
        bulge: of the barrel [m].
        discs: radii of the wetted discs on board and package [m].
        offset: of the package's disc along x [m].
        numerics: how finely; None for the package's own.

    Raises:
        JointMeshError: no mesh meets its bars.
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
    """Measure a mesh: errors against the surface that it fills, smallest scaled Jacobian, hexahedra of solder.

    Volume, Jacobian and head are measured anew; standoff, contact areas and deviation are what the mesher found.
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
    """Largest distance [m] of the solder's upper face from the package's copper."""
    made = meshed.mesh
    heads = [quads for name, quads in made.facets.items() if name.startswith("pad_package@")]
    points = made.points[np.unique(np.concatenate([quads.ravel() for quads in heads]))]
    place = meshed.side.height(points[:, 0], points[:, 1]) - meshed.copper
    return float(np.abs(points[:, 2] - place).max())
