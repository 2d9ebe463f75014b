"""Elastic constants as matrices. Voigt order: xx, yy, zz, xy, yz, xz (engineering shear)."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.materials.parameters import EngineeringConstants, Material
from reflowshock.fem.materials.roles import Materials


def elasticity_matrix(material: Material) -> NDArray[np.float64]:
    """Return the stiffness matrix of a material.

    Returns:
        ``(6, 6)`` [Pa], symmetric positive definite.

    Raises:
        ValueError: The elastic constants do not give a positive strain energy.
    """
    compliance = compliance_matrix(material.engineering_constants)
    lowest = float(np.linalg.eigvalsh(compliance)[0])
    if lowest <= 0.0:
        raise ValueError(f"elastic constants of {material!r}: compliance has eigenvalue {lowest:.3e} 1/Pa, must be > 0")
    return np.linalg.inv(compliance)


def compliance_matrix(constants: EngineeringConstants) -> NDArray[np.float64]:
    """Return the compliance ``(6, 6)`` [1/Pa] of an orthotropic material along its axes."""
    compliance = np.diag(1.0 / np.array([*constants.young, *constants.shear]))
    for ratio, (i, j) in zip(constants.poisson, ((0, 1), (1, 2), (0, 2)), strict=True):
        compliance[i, j] = compliance[j, i] = -ratio / constants.young[i]
    return compliance


def role_of_part(part: str) -> str:
    """Return the material role of a part: its name up to ``@``, then up to ``_``."""
    return part.split("@")[0].split("_")[0]


def material_of_part(part: str, materials: Materials) -> Material:
    """Return the material of a part.

    Raises:
        ValueError: The role of the part has no material.
    """
    role = role_of_part(part)
    if role not in type(materials).model_fields:
        roles = ", ".join(type(materials).model_fields)
        raise ValueError(f"part {part!r} has the role {role!r}; materials exist for {roles}")
    material: Material = getattr(materials, role)
    return material


def materials_of_parts(
    parts: Sequence[str], materials: Materials | Mapping[str, Material]
) -> tuple[tuple[str, ...], tuple[Material, ...]]:
    """Return role and material of each part; with a mapping of parts to materials, each part is a role of its own.

    Raises:
        ValueError: A part has no material.
    """
    if isinstance(materials, Materials):
        assigned = tuple(material_of_part(part, materials) for part in parts)
        return tuple(role_of_part(part) for part in parts), assigned
    missing = [part for part in parts if part not in materials]
    if missing:
        raise ValueError(f"part {missing[0]!r} has no material; materials exist for {', '.join(materials)}")
    return tuple(parts), tuple(materials[part] for part in parts)
