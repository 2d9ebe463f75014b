"""Tetrahedral meshes of closed surfaces by Gmsh: the surface is remeshed to a size, the edges of pads are kept.

Gmsh runs in a separate process (``fill_in_process``), because it may crash and keeps state. Stages never load Gmsh and
DOLFINx together: on Debian 13 the PETSc inside the Gmsh wheel conflicts with the one of DOLFINx, and Gmsh aborts.
"""

import math
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

import gmsh
import numpy as np

from reflowshock.meshing.board.blocks import MILLI
from reflowshock.meshing.core.gmsh_session import gmsh_model
from reflowshock.meshing.surface.closed_surface import BOARD_PAD, FREE, PACKAGE_PAD, ClosedSurface, pad_planes
from reflowshock.processes import ProcessPool

TRIANGLE, TETRAHEDRON = 2, 4  # Gmsh's element types
TIME_LIMIT = 300.0  # s
FLAT = 1.0e-6  # of the gap: how far from a pad's plane a remeshed pad may lie
ELEMENTS_ACROSS = 3.0  # elements across a small patch, such as the surface of a void


class FreeFormError(ValueError):
    """Error for a closed surface that Gmsh cannot fill with tetrahedra."""


@dataclass(frozen=True, slots=True)
class Tetrahedra:
    """Tetrahedra of a body in its own frame.

    Attributes:
        points: Node coordinates, shape (n, 3) [m].
        cells: Nodes of the tetrahedra, positively oriented, shape (c, 4).
        triangles: Surface triangles, outward oriented, shape (t, 3).
        boundary: Label of each triangle, FREE, BOARD_PAD or PACKAGE_PAD, shape (t,).
    """

    points: np.ndarray
    cells: np.ndarray
    triangles: np.ndarray
    boundary: np.ndarray


def fill_with_tetrahedra(surface: ClosedSurface, size: float, cut_into_patches: bool) -> Tetrahedra:
    """Remesh a closed surface and fill it with tetrahedra.

    Args:
        surface: Closed surface in the body's own frame, with any number of pads and shells.
        size: Target edge length [m].
        cut_into_patches: Whether Gmsh cuts the surface into patches that it can parametrise, as closed shells need.

    Returns:
        Nodes, tetrahedra, and surface triangles with the labels FREE, BOARD_PAD or PACKAGE_PAD.

    Raises:
        FreeFormError: Gmsh cannot parametrise a patch or cannot fill the surface.
    """
    with gmsh_model("free form"):
        _add_patches(surface)
        try:
            gmsh.model.mesh.createTopology(True, False)
            if cut_into_patches:
                gmsh.model.mesh.classifySurfaces(np.pi, True, True, np.pi)
            gmsh.model.mesh.createGeometry()
            patches = [tag for _, tag in gmsh.model.getEntities(2)]
            gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(patches)])
            gmsh.model.geo.synchronize()
            _generate(size / MILLI, patches)
        except Exception as error:  # Gmsh raises plain exceptions
            raise FreeFormError(f"Gmsh: {error}") from error
        return _collect(pad_planes(surface).height, patches)


def fill_in_process(surface: ClosedSurface, size: float, cut_into_patches: bool) -> Tetrahedra:
    """Remesh a closed surface and fill it with tetrahedra, in a separate process.

    The mesh then does not depend on earlier calls of Gmsh, and a crash of Gmsh ends only that process.

    Args:
        surface: Closed surface in the body's own frame, with any number of pads and shells.
        size: Target edge length [m].
        cut_into_patches: Whether Gmsh cuts the surface into patches that it can parametrise, as closed shells need.

    Returns:
        Nodes, tetrahedra, and surface triangles with the labels FREE, BOARD_PAD or PACKAGE_PAD.

    Raises:
        FreeFormError: Gmsh cannot parametrise a patch, cannot fill the surface, crashes, or takes too long.
    """
    with ProcessPool(1) as pool:
        try:
            return pool.submit(fill_with_tetrahedra, surface, size, cut_into_patches).result(TIME_LIMIT)
        except BrokenProcessPool as error:
            raise FreeFormError("Gmsh ended without an error message") from error
        except TimeoutError as error:
            raise FreeFormError(f"Gmsh: no mesh within {TIME_LIMIT:g} s") from error


def _add_patches(surface: ClosedSurface) -> None:
    """Add the triangles of each label as a discrete surface, in mm."""
    nodes = np.arange(1, len(surface.points) + 1)
    first = 1
    for label in (FREE, BOARD_PAD, PACKAGE_PAD):
        patch = gmsh.model.addDiscreteEntity(2)
        if label == FREE:
            gmsh.model.mesh.addNodes(2, patch, nodes, (surface.points / MILLI).ravel())
        triangles = surface.triangles[surface.boundary == label] + 1
        gmsh.model.mesh.addElementsByType(patch, TRIANGLE, first + np.arange(len(triangles)), triangles.ravel())
        first += len(triangles)


def _generate(size: float, patches: list[int]) -> None:
    """Mesh the current model with an edge length [mm], finer on small patches."""
    smaller = {patch: extent for patch in patches if (extent := math.sqrt(_patch_area(patch)) / ELEMENTS_ACROSS) < size}
    for option, value in (("Min", min([size, *smaller.values()])), ("Max", size), ("FromPoints", 0)):
        gmsh.option.setNumber(f"Mesh.MeshSize{option}", value)
    gmsh.option.setNumber("Mesh.RandomSeed", 1)
    fields = [_size_field(patch, value, size) for patch, value in smaller.items()]
    if fields:
        least = gmsh.model.mesh.field.add("Min")
        gmsh.model.mesh.field.setNumbers(least, "FieldsList", fields)
        gmsh.model.mesh.field.setAsBackgroundMesh(least)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen")


def _size_field(patch: int, inside: float, elsewhere: float) -> int:
    """Add a field of one size on a patch and another elsewhere [mm]; return its tag."""
    field = gmsh.model.mesh.field.add("Constant")
    gmsh.model.mesh.field.setNumbers(field, "SurfacesList", [patch])
    gmsh.model.mesh.field.setNumber(field, "VIn", inside)
    gmsh.model.mesh.field.setNumber(field, "VOut", elsewhere)
    return field


def _patch_area(patch: int) -> float:
    """Return the area of the triangles of a discrete surface [mm^2]."""
    tags, nodes = gmsh.model.mesh.getElementsByType(TRIANGLE, patch)
    return float(gmsh.model.mesh.getElementQualities(tags, "volume").sum()) if len(nodes) else 0.0


def _collect(height: Callable[[np.ndarray, np.ndarray], np.ndarray], patches: list[int]) -> Tetrahedra:
    """Copy the mesh from Gmsh; patches in the plane of a pad are labelled as wetted."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    nodes = gmsh.model.mesh.getElementsByType(TETRAHEDRON)[1]
    if not len(nodes):
        raise FreeFormError("Gmsh: no tetrahedra")
    used, cells = np.unique(nodes, return_inverse=True)
    order = np.argsort(tags)
    points = coordinates.reshape(-1, 3)[order[np.searchsorted(tags, used, sorter=order)]] * MILLI
    tagged = [gmsh.model.mesh.getElementsByType(TRIANGLE, patch)[1].reshape(-1, 3) for patch in patches]
    triangles = [np.searchsorted(used, part) for part in tagged]
    labels = [_label(points, np.unique(part), height) for part in triangles]
    boundary = np.repeat(labels, [len(part) for part in triangles])
    return Tetrahedra(points, cells.reshape(-1, 4), np.vstack(triangles), boundary)


def _label(points: np.ndarray, nodes: np.ndarray, height: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> int:
    """Return the label of a patch; nodes of a wetted patch are moved exactly into the plane of its pad, in place."""
    z, top = points[nodes, 2], height(points[nodes, 0], points[nodes, 1])
    for label, plane in ((BOARD_PAD, np.zeros_like(z)), (PACKAGE_PAD, top)):
        if np.abs(z - plane).max() < FLAT * top.max():
            points[nodes, 2] = plane
            return label
    return FREE
