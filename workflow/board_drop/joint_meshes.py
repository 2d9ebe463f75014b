"""Meshes of all joints of an array: of the real ones, and of identical ones to compare them with."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.workflow.board_drop.bridged_joints import mesh_bridges
from reflowshock.workflow.board_drop.fine_joints import needs_coarse_joints
from reflowshock.workflow.board_drop.identical_joints import PREFIX, identical_sphere
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.products import write_json

if TYPE_CHECKING:
    from reflowshock.meshing.board.package_side import PackageSide
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.meshing.joint.joint_mesh import JointMesh
    from reflowshock.meshing.surface.closed_surface import ClosedSurface


def mesh_real_joints(run: Run[PackageCase], folder: Path) -> dict[str, dict]:
    """Put the package where the solder froze and mesh the joints there; return what ``mesh_array`` does."""
    from reflowshock.meshing.board.displaced_assembly import prescribed, read_computed, write_displaced_assembly
    from reflowshock.meshing.board.pads import read_pads
    from reflowshock.meshing.surface.closed_surface import read_surface

    case, structure = run.case, run.folder / "reflow/structure.npz"
    displacement = read_computed(structure) if structure.exists() else prescribed(case.package, case.warpage)
    side = write_displaced_assembly(run.folder / "geometry/assembly.msh", displacement, folder / "assembly.msh")
    sites = {site.name: site for site in read_pads(run.folder / "reflow/pads.json")}
    surfaces = {path.stem: read_surface(path) for path in sorted((run.folder / "surface").glob("*.vtu"))}
    bodies = [(surfaces[name], site) for name, site in sites.items() if name in surfaces]
    bridged = mesh_bridges(surfaces, sites, case, side)
    found = mesh_array(bodies, side, case, folder)
    found |= {"bridged_": _write(bridged, "bridged_", case, folder)} if bridged else {}
    return {kind: quality for kind, quality in found.items() if quality}


def mesh_identical_joints(run: Run[PackageCase], folder: Path) -> dict[str, dict]:
    """Mesh truncated spheres of the solder's volume, on which nothing weighs, under a flat package at their height."""
    from reflowshock.meshing.board.displaced_assembly import raised, write_displaced_assembly
    from reflowshock.meshing.board.pads import read_pads
    from reflowshock.meshing.surface.sphere_surface import sphere_surface

    case = run.case
    sphere = identical_sphere(case)
    displacement = raised(sphere.height - case.package.standoff)
    flat, path = run.folder / "geometry/assembly.msh", folder / f"{PREFIX}assembly.msh"
    side = write_displaced_assembly(flat, displacement, path)
    drawn = read_pads(run.folder / "geometry/pads.json")
    surface = sphere_surface(sphere)
    bodies = [(surface, replace(site, gap=sphere.height)) for site in drawn]
    return mesh_array(bodies, side, case, folder, PREFIX)


def mesh_array(
    bodies: "Sequence[tuple[ClosedSurface, PadSite]]",
    side: "PackageSide",
    case: PackageCase,
    folder: Path,
    prefix: str = "",
) -> dict[str, dict]:
    """Mesh joints, once more with few hexahedra where the shock needs coarse joints.

    Args:
        bodies: closed surface and place of each joint.
        side: the package's underside.
        case: package, materials, shock.
        folder: where the products go.
        prefix: begins their names.

    Returns:
        Kind of joint mesh, which begins the names of its metrics -> joint -> quality.
    """
    from reflowshock.meshing.joint.solder_mesh import mesh_coarse_or_fine, mesh_joint

    fine = [mesh_joint(surface, site, case.package, side) for surface, site in bodies]
    kinds = {prefix: fine}
    if isinstance(case, BoardDropCase) and needs_coarse_joints(case.shock.coupling):
        kinds[f"{prefix}coarse_"] = [
            mesh_coarse_or_fine(surface, mesh, (case.package, site), side)
            for (surface, site), mesh in zip(bodies, fine, strict=True)
        ]
    return {kind: _write(meshes, kind, case, folder) for kind, meshes in kinds.items()}


def _write(meshes: "Sequence[JointMesh]", kind: str, case: PackageCase, folder: Path) -> dict[str, dict]:
    """Write meshes, the tetrahedra of those that are free-form, and their quality; return this by joint."""
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
