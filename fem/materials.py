"""Elastic constants as matrices. Voigt order: xx, yy, zz, xy, yz, xz (engineering shear)."""

import numpy as np
from numpy.typing import NDArray

from fem.parameters import Isotropic, Material, Materials, Orthotropic


def elasticity_matrix(material: Material) -> NDArray[np.float64]:
    """Return the stiffness matrix of a material.

    Returns:
        ``(6, 6)`` [Pa], symmetric positive definite.

    Raises:
        ValueError: The elastic constants do not give a positive strain energy.
    """
    compliance = isotropic_compliance(material) if isinstance(material, Isotropic) else laminate_compliance(material)
    lowest = float(np.linalg.eigvalsh(compliance)[0])
    if lowest <= 0.0:
        raise ValueError(f"elastic constants of {material!r}: compliance has eigenvalue {lowest:.3e} 1/Pa, must be > 0")
    return np.linalg.inv(compliance)


def isotropic_compliance(material: Isotropic) -> NDArray[np.float64]:
    """Return the compliance ``(6, 6)`` [1/Pa] of an isotropic material."""
    young, poisson = material.young_modulus, material.poisson_ratio
    compliance = np.diag([1.0, 1.0, 1.0] + [2.0 * (1.0 + poisson)] * 3)
    compliance[:3, :3] -= poisson * (1.0 - np.eye(3))
    return compliance / young


def laminate_compliance(material: Orthotropic) -> NDArray[np.float64]:
    """Return the compliance ``(6, 6)`` [1/Pa] of a laminate with its layers normal to z."""
    in_plane, out_of_plane = material.young_modulus_in_plane, material.young_modulus_out_of_plane
    nu_xy, nu_xz = material.poisson_ratio_in_plane, material.poisson_ratio_out_of_plane
    compliance = np.diag(
        [
            1.0 / in_plane,
            1.0 / in_plane,
            1.0 / out_of_plane,
            1.0 / material.shear_modulus_in_plane,
            1.0 / material.shear_modulus_out_of_plane,
            1.0 / material.shear_modulus_out_of_plane,
        ]
    )
    compliance[0, 1] = compliance[1, 0] = -nu_xy / in_plane
    compliance[0, 2] = compliance[2, 0] = compliance[1, 2] = compliance[2, 1] = -nu_xz / in_plane
    return compliance


def wave_speeds(material: Material) -> NDArray[np.float64]:
    """Return the speeds of pressure waves along x, y, z: ``(3,)`` [m/s], sqrt(C_ii / density)."""
    return np.sqrt(np.diag(elasticity_matrix(material))[:3] / material.density)


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
