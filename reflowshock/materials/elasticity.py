"""Stiffness and compliance matrices of linear elasticity. Voigt order: xx, yy, zz, xy, yz, xz (engineering shear)."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.materials.parameters import EngineeringConstants, Material


def elasticity_matrix(material: Material) -> NDArray[np.float64]:
    """Return the elastic stiffness matrix of a material, in the order xx, yy, zz, xy, yz, xz (engineering shear).

    Args:
        material: Isotropic or orthotropic material.

    Returns:
        Symmetric positive definite matrix of shape (6, 6) [Pa].

    Raises:
        ValueError: The elastic constants do not give a positive strain energy.
    """
    compliance = compliance_matrix(material.engineering_constants)
    lowest = float(np.linalg.eigvalsh(compliance)[0])
    if lowest <= 0.0:
        raise ValueError(f"elastic constants of {material!r}: compliance has eigenvalue {lowest:.3e} 1/Pa, must be > 0")
    return np.linalg.inv(compliance)


def compliance_matrix(constants: EngineeringConstants) -> NDArray[np.float64]:
    """Return the compliance matrix of an orthotropic material along its axes, shape (6, 6) [1/Pa].

    Args:
        constants: Young's moduli and shear moduli [Pa] and Poisson's ratios; rows and columns have the order xx, yy,
            zz, xy, yz, xz (engineering shear).
    """
    compliance = np.diag(1.0 / np.array([*constants.young, *constants.shear]))
    for ratio, (i, j) in zip(constants.poisson, ((0, 1), (1, 2), (0, 2)), strict=True):
        compliance[i, j] = compliance[j, i] = -ratio / constants.young[i]
    return compliance
