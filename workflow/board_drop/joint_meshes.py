"""Surfaces and meshes of all joints of an array: real, bridged and identical joints."""

import itertools
import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.workflow.board_drop.identical_joints import PREFIX, identical_sphere
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.products import read_json, write_json
from reflowshock.workflow.reflow.joints import refuse_joints_without_mesh

if TYPE_CHECKING:
    from reflowshock.meshing.board.package_side import PackageSide
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.meshing.board.parameters import Board, Package
    from reflowshock.meshing.joint.joint_mesh import JointMesh
    from reflowshock.meshing.surface.closed_surface import ClosedSurface
    from reflowshock.particles.steps.shape import JointShape


def write_surfaces(run: Run[PackageCase], folder: Path) -> dict[str, dict]:
    """Write the closed surface of each joint; return the measures of the surfaces.

    Args:
        run: Case, and run folder from which the products of the reflow are read.
        folder: Folder into which ``<joint>.vtu`` is written, one file for a bridged pair ("A9+A10.vtu").

    Returns:
        Measures by joint name: ``volume`` [m^3] and other sizes, with ``volume_error``, the relative error against the
        reflow; for a user's surface ``given`` (file) and ``volume_change``.

    Raises:
        ReflowError: A joint is open.
    """
    from reflowshock.meshing.board.pads import read_pads
    from reflowshock.meshing.surface.closed_surface import measure, write_surface
    from reflowshock.meshing.surface.user_surface import file_volume, load_surface
    from reflowshock.particles.scenes.orientation import Orientation, orient
    from reflowshock.particles.scenes.products import read_shapes

    package, joints = run.case.package, read_json(run.folder / "reflow/joints.json")
    sites = {site.name: site for site in read_pads(run.folder / "reflow/pads.json")}
    flowed = {name: joint for name, joint in joints.items() if name not in package.surfaces}
    refuse_joints_without_mesh(flowed, ("open",))
    shapes = read_shapes(run.folder / "reflow/shapes.h5")
    bodies = {name: shape for name, shape in shapes.items() if BETWEEN in name}
    for name, joint in flowed.items():
        if joint["verdict"] != "bridged":
            bodies[name] = orient(shapes[joint["shape"]], Orientation(joint["turn"], joint["mirror"]))
    measures: dict[str, dict] = {}
    for name, shape in bodies.items():
        closed = _closed(shape)
        write_surface(folder / f"{name}.vtu", closed)
        size = measure(closed)
        measures[name] = {**size, "volume_error": size["volume"] / shape.metrics["volume"][0] - 1.0}
    for name, path in package.surfaces.items():
        closed = load_surface(Path(path), package.surface_unit, sites[name])
        write_surface(folder / f"{name}.vtu", closed)
        size = measure(closed)
        change = size["volume"] / file_volume(Path(path), package.surface_unit) - 1.0
        measures[name] = {**size, "given": path, "volume_change": change}
    return measures


def _closed(shape: "JointShape"):
    """Close the free surface of a shape on all its pads."""
    from reflowshock.meshing.surface.closed_surface import close_rings

    return close_rings(shape.surface_points, shape.triangles, shape.rings)


logger = logging.getLogger(__name__)

BETWEEN = "+"  # separator in the names of bridged pairs
IMAGE = "_image"  # suffix of the name of a joint behind a plane of symmetry


def mesh_real_joints(
    case: PackageCase, run_folder: Path, folder: Path, *, coarse: bool, flat: Path | None = None
) -> dict[str, dict]:
    """Place the package at its position after solidification and mesh the joints; return their quality.

    Args:
        case: Case of a package.
        run_folder: Run folder with the products of the preceding stages.
        folder: Folder into which assembly, joint meshes and qualities are written.
        coarse: Whether each joint is also meshed coarse.
        flat: Mesh of flat board and package; None for that of the stage geometry.

    Returns:
        Quality by kind of mesh (prefix of files and metrics), then by joint; kinds without joints are left out.
    """
    from reflowshock.meshing.board.displaced_assembly import (
        prescribed_displacement,
        read_displacement,
        write_displaced_assembly,
    )
    from reflowshock.meshing.board.pads import read_pads
    from reflowshock.meshing.surface.closed_surface import read_surface

    structure = run_folder / "reflow/structure.npz"
    displacement = (
        read_displacement(structure) if structure.exists() else prescribed_displacement(case.package, case.warpage)
    )
    flat = flat or run_folder / "geometry/assembly.msh"
    side = write_displaced_assembly(flat, displacement, folder / "assembly.msh")
    sites = {site.name: site for site in read_pads(run_folder / "reflow/pads.json")}
    surfaces = {path.stem: read_surface(path) for path in sorted((run_folder / "surface").glob("*.vtu"))}
    bodies = [(surfaces[name], site) for name, site in sites.items() if name in surfaces]
    bridges = mesh_bridges(surfaces, sites, case, side)
    meshes = mesh_array(bodies, side, case.package, case.board, coarse=coarse)
    qualities = {kind: _write(joints, kind, case, folder) for kind, joints in meshes.items()}
    qualities |= {"bridged_": _write(bridges, "bridged_", case, folder)} if bridges else {}
    return {kind: quality for kind, quality in qualities.items() if quality}


def mesh_identical_joints(run: Run[BoardDropCase], folder: Path, *, coarse: bool) -> dict[str, dict]:
    """Mesh unloaded truncated spheres of the solder volume under a flat package; return their quality.

    Args:
        run: Case, and run folder with the flat assembly.
        folder: Folder into which assembly, joint meshes and qualities are written.
        coarse: Whether each joint is also meshed coarse.

    Returns:
        Quality by kind of mesh (prefix of files and metrics), then by joint.
    """
    from reflowshock.meshing.board.displaced_assembly import uniform_lift, write_displaced_assembly
    from reflowshock.meshing.board.pads import read_pads
    from reflowshock.meshing.surface.sphere_surface import sphere_surface

    case = run.case
    sphere = identical_sphere(case)
    displacement = uniform_lift(sphere.height - case.package.standoff)
    flat, path = run.folder / "geometry/assembly.msh", folder / f"{PREFIX}assembly.msh"
    side = write_displaced_assembly(flat, displacement, path)
    drawn = read_pads(run.folder / "geometry/pads.json")
    surface = sphere_surface(sphere)
    bodies = [(surface, replace(site, gap=sphere.height)) for site in drawn]
    meshes = mesh_array(bodies, side, case.package, case.board, coarse=coarse)
    return {PREFIX + kind: _write(joints, PREFIX + kind, case, folder) for kind, joints in meshes.items()}


def mesh_array(
    bodies: "Sequence[tuple[ClosedSurface, PadSite]]",
    side: "PackageSide",
    package: "Package",
    board: "Board",
    *,
    coarse: bool,
) -> "dict[str, list[JointMesh]]":
    """Mesh all joints of an array fine, and on request also coarse.

    Args:
        bodies: Closed surface and pad site of each joint.
        side: Underside of the package.
        package: Parameters of the package.
        board: Parameters of the board.
        coarse: Whether each joint is also meshed coarse.

    Returns:
        Joint meshes by kind, ``""`` for fine ones and ``"coarse_"``; the kind is a prefix of file and metric names.
    """
    from reflowshock.meshing.joint.column import columns_of
    from reflowshock.meshing.joint.solder_mesh import mesh_coarse_or_fine, mesh_joint

    fine = [
        mesh_joint(surface, site, package, side, columns_of(site, package, board, side)) for surface, site in bodies
    ]
    meshes = {"": fine}
    if coarse:
        meshes["coarse_"] = [
            mesh_coarse_or_fine(surface, mesh, site, package, side)
            for (surface, site), mesh in zip(bodies, fine, strict=True)
        ]
    return meshes


def _write(meshes: "Sequence[JointMesh]", kind: str, case: PackageCase, folder: Path) -> dict[str, dict]:
    """Write joint meshes, tetrahedra of free-form joints and quality; return the quality by joint."""
    from reflowshock.meshing.core.quadratic_tetrahedra import write_tetrahedra
    from reflowshock.meshing.joint.joints_file import write_joints
    from reflowshock.meshing.joint.solder_mesh import joint_quality
    from reflowshock.workflow.board_drop.forecast import with_critical_step

    write_joints(list(meshes), folder / f"{kind}joints.msh")
    for mesh in meshes:
        if mesh.tetrahedra is not None:
            write_tetrahedra(folder / f"free_form_{mesh.name}.msh", mesh.name, mesh.tetrahedra)
    quality = {mesh.name: with_critical_step(joint_quality(mesh), case.materials) for mesh in meshes}
    write_json(folder / f"{kind}quality.json", quality)
    return quality


@dataclass(frozen=True, slots=True)
class MirroredSide:
    """Underside of a quarter package and its mirror images at x = 0 and y = 0."""

    quarter: "PackageSide"

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height over the top face of the board at points x, y, all of shape (k,) [m]."""
        return self.quarter.height(np.abs(x), np.abs(y))


def mesh_bridges(
    surfaces: "Mapping[str, ClosedSurface]", sites: "Mapping[str, PadSite]", case: PackageCase, side: "PackageSide"
) -> "list[JointMesh]":
    """Mesh bridged joints, for use in other codes; the shock does not support them.

    Args:
        surfaces: Closed surfaces by name; a bridged pair has both names.
        sites: Pad sites of all joints by name.
        case: Case with package and symmetry.
        side: Underside of the package.

    Returns:
        Mesh of each bridged pair; pairs that cannot be meshed are left out with a warning.
    """
    from reflowshock.meshing.joint.solder_mesh import JointMeshError, mesh_bridge

    quarter = case.board.symmetry == "quarter"
    meshes = []
    for name in (name for name in surfaces if BETWEEN in name):
        first, second = (sites[joint] for joint in name.split(BETWEEN))
        pair = (first, _nearest_image(first, second)) if quarter else (first, second)
        try:
            meshes.append(mesh_bridge(surfaces[name], pair, case.package, MirroredSide(side) if quarter else side))
        except JointMeshError as error:  # the mesh is not needed for the verdict
            logger.warning("%s are bridged, but their common body was not meshed: %s", name, error)
    return meshes


def _nearest_image(first: "PadSite", second: "PadSite") -> "PadSite":
    """Return the second site or its mirror image, whichever is nearest to the first site."""
    images = [second]
    for along_x, along_y in itertools.product((1.0, -1.0), repeat=2):
        if (along_x, along_y) != (1.0, 1.0):
            images.append(replace(second, name=second.name + IMAGE, x=along_x * second.x, y=along_y * second.y))
    apart = [site for site in images if math.dist((site.x, site.y), (first.x, first.y)) > 0.0]
    return min(apart, key=lambda site: math.dist((site.x, site.y), (first.x, first.y)))
