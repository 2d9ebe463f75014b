"""Tetrahedra in any closed surface by Gmsh: surface remeshed to a size, edges of pads kept.

Gmsh runs in a process of its own (``fill_apart``), because it may crash and keeps state. Stages never load Gmsh and
DOLFINx together: on Debian 13 the PETSc inside Gmsh's wheel does not start beside DOLFINx, and Gmsh aborts.
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
LONGEST = 300.0  # seconds
FLAT = 1.0e-6  # of the gap: how far from a pad's plane a remeshed pad may lie
ACROSS = 3.0  # elements across a patch of its own, as a small void


class FreeFormError(ValueError):
    """A surface in which Gmsh makes no tetrahedra."""


@dataclass(frozen=True, slots=True)
class Tetrahedra:
    """Tetrahedra of a body in its own frame.

    Attributes:
        points: (n, 3) [m].
        cells: (c, 4), positively oriented.
        triangles: (t, 3) of its surface, outward oriented.
        boundary: (t,) FREE, BOARD_PAD or PACKAGE_PAD.
    """

    points: np.ndarray
    cells: np.ndarray
    triangles: np.ndarray
    boundary: np.ndarray


def fill_with_tetrahedra(surface: ClosedSurface, size: float, cut_into_patches: bool) -> Tetrahedra:
    """Remesh a closed surface and fill it.

    Args:
        surface: the body in its own frame, with any number of pads and of shells.
        size: of the elements [m].
        cut_into_patches: whether Gmsh may cut the surface into patches that it can lay flat, as closed shells need.

    Raises:
        FreeFormError: Gmsh cannot lay a patch flat, or cannot fill the surface.
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
        except Exception as error:  # what Gmsh raises
            raise FreeFormError(f"Gmsh: {error}") from error
        return _collect(pad_planes(surface).height, patches)


def fill_apart(surface: ClosedSurface, size: float, cut_into_patches: bool) -> Tetrahedra:
    """As ``fill_with_tetrahedra``, in a process of its own.

    The mesh does not depend on what Gmsh made before, and a surface on which it fails takes nothing else with it.
    """
    with ProcessPool(1) as pool:
        try:
            return pool.submit(fill_with_tetrahedra, surface, size, cut_into_patches).result(LONGEST)
        except BrokenProcessPool as error:
            raise FreeFormError("Gmsh ended without a word") from error
        except TimeoutError as error:
            raise FreeFormError(f"Gmsh: no mesh within {LONGEST:g} s") from error


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
    """Mesh the current model with a size [mm], small patches finer."""
    smaller = {patch: extent for patch in patches if (extent := math.sqrt(_patch_area(patch)) / ACROSS) < size}
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
    """Area of the triangles of a discrete surface [mm^2]."""
    tags, nodes = gmsh.model.mesh.getElementsByType(TRIANGLE, patch)
    return float(gmsh.model.mesh.getElementQualities(tags, "volume").sum()) if len(nodes) else 0.0


def _collect(height: Callable[[np.ndarray, np.ndarray], np.ndarray], patches: list[int]) -> Tetrahedra:
    """Take the mesh from Gmsh; patches in the plane of a pad are wetted."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    nodes = gmsh.model.mesh.getElementsByType(TETRAHEDRON)[1]
    if not len(nodes):
        raise FreeFormError("Gmsh: no tetrahedra")
    used, cells = np.unique(nodes, return_inverse=True)
    order = np.argsort(tags)
    points = coordinates.reshape(-1, 3)[order[np.searchsorted(tags, used, sorter=order)]] * MILLI
    found = [gmsh.model.mesh.getElementsByType(TRIANGLE, patch)[1].reshape(-1, 3) for patch in patches]
    triangles = [np.searchsorted(used, part) for part in found]
    labels = [_label(points, np.unique(part), height) for part in triangles]
    boundary = np.repeat(labels, [len(part) for part in triangles])
    return Tetrahedra(points, cells.reshape(-1, 4), np.vstack(triangles), boundary)


def _label(points: np.ndarray, nodes: np.ndarray, height: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> int:
    """Say what a patch with these nodes is; those of a pad are laid exactly into its plane, in place."""
    z, top = points[nodes, 2], height(points[nodes, 0], points[nodes, 1])
    for label, plane in ((BOARD_PAD, np.zeros_like(z)), (PACKAGE_PAD, top)):
        if np.abs(z - plane).max() < FLAT * top.max():
            points[nodes, 2] = plane
            return label
    return FREE
