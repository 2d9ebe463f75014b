"""Selection of fine joints; all other joints of a package get the coarse mesh."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.errors import MeshError
from reflowshock.fem.mesh.column import COPY
from reflowshock.fem.mesh.mesh import MeshData, append, select
from reflowshock.fem.mesh.mesh_file import read_mesh, read_meshes
from reflowshock.fem.mesh.watch_table import joint_names
from reflowshock.fem.problem.inputs import PackageInput
from reflowshock.names import find_nearest

KEY = "shock.coupling.fine_joints"


def read_package(request: PackageInput) -> MeshData:
    """Read the meshes of a run as one mesh, with fine or coarse joints as ``shock.coupling.fine_joints`` requests.

    One-way coupling also appends coarse copies of the fine joints, for the model that drives the fine one.

    Args:
        request: Input with the paths of the meshes and the coupling settings.

    Raises:
        MeshError: A joint is unknown, no file has the coarse joints, or a file cannot be used (``read_mesh``).
    """
    fine = request.shock.coupling.fine_joints
    mesh = read_meshes(request.meshes)
    if request.one_way:
        coarse, names = read_coarse(request.coarse_joints), joint_names(mesh) if fine == "all" else fine
        return append([with_coarse_joints(mesh, coarse, names), copies(coarse, names)])
    if fine == "all":
        return mesh
    if isinstance(fine, str):
        raise MeshError(f'{KEY} = "{fine}" is not a joint; allowed: a list of names, or "all"')
    return with_coarse_joints(mesh, read_coarse(request.coarse_joints), fine)


def read_coarse(path: Path | None) -> MeshData:
    """Read the mesh of coarse joints.

    Args:
        path: Gmsh file of the coarse joints, None if the input names none.

    Raises:
        MeshError: The path is None, or the file cannot be read.
    """
    if path is None:
        raise MeshError(f"{KEY} leaves out some joints, and there is no file of coarse joints (coarse_joints)")
    return read_mesh(path)


def with_coarse_joints(mesh: MeshData, coarse: MeshData, fine: Collection[str]) -> MeshData:
    """Replace all joints of a mesh except the fine ones by coarse joints; the order is unchanged.

    Args:
        mesh: Mesh of board, package and all joints in fine form.
        coarse: Mesh with coarse joints of the same names.
        fine: Names of the joints that stay fine, at least one.

    Raises:
        MeshError: A joint is unknown, no joint is fine, or a joint is neither fine nor has a coarse mesh.
    """
    joints, coarse_joints = joint_names(mesh), joint_names(coarse)
    unknown = sorted(set(fine) - set(joints))
    if unknown:
        hint = find_nearest(unknown[0], joints)
        question = f"; did you mean {hint}?" if hint else ""
        raise MeshError(f"{KEY}: the mesh has no joint {unknown[0]}, allowed: {', '.join(joints)}{question}")
    if not fine:
        raise MeshError(f"{KEY} is empty: no joint would be fine, allowed: {', '.join(joints)}")
    others = [name for name in joints if name not in fine]
    missing = [name for name in others if name not in coarse_joints]
    if missing:
        available = ", ".join(coarse_joints) or "none"
        raise MeshError(f"{missing[0]} is not fine and has no coarse mesh; coarse joints: {available}")
    remaining, _ = select(mesh, lambda part: joint_of(part) not in others)
    return append([remaining, select(coarse, lambda part: joint_of(part) in others)[0]]) if others else mesh


def copies(coarse: MeshData, fine: Collection[str]) -> MeshData:
    """Return coarse copies of fine joints for the driving model of one-way coupling.

    The copies lose their pad facets, so that they are not watched; ``COPY`` replaces ``@`` in their part names.

    Args:
        coarse: Mesh with coarse joints.
        fine: Names of the fine joints to be copied.

    Raises:
        MeshError: A fine joint has no coarse mesh.
    """
    missing = sorted(set(fine) - set(joint_names(coarse)))
    if missing:
        raise MeshError(f"{missing[0]} has no coarse mesh, as shock.coupling.direction = one_way needs")
    chosen, _ = select(coarse, lambda part: joint_of(part) in fine)
    names = tuple(name.replace("@", COPY) for name in chosen.part_names)
    return replace(
        chosen, part_names=names, facets={k: v for k, v in chosen.facets.items() if not k.startswith("pad_")}
    )


def copied_joints(mesh: MeshData) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return masks of the cells of fine joints with a coarse copy, and of these copies, each of shape (ne,).

    Args:
        mesh: Mesh of a one-way run from ``read_package``; without copies both masks are False everywhere.
    """
    copy = mesh.in_parts(lambda name: COPY in name)
    copied = {joint_of(mesh.part_names[part]) for part in np.unique(mesh.part[copy])}
    return mesh.in_parts(lambda name: joint_of(name) in copied) & ~copy, copy


def joint_of(part: str) -> str:
    """Return the joint of a part named ``<role>@<joint>``, an empty string for a part without ``@``."""
    return part.partition("@")[2]
