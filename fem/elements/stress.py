"""Stress and strain from displacements; the mean gradients of an element give its average strain."""

import numpy as np
from numpy.typing import NDArray


def mean_strain(gradient: NDArray[np.float64], displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the average strain of elements, xx yy zz xy yz xz with engineering shear, shape (m, 6).

    Args:
        gradient: Mean gradients of the shape functions, shape (m, k, 3) [1/m].
        displacement: Displacement of the nodes, shape (m, k, 3) [m].
    """
    h = np.einsum("mai,maj->mij", displacement, gradient)
    return np.stack(
        [h[:, 0, 0], h[:, 1, 1], h[:, 2, 2], h[:, 0, 1] + h[:, 1, 0], h[:, 1, 2] + h[:, 2, 1], h[:, 0, 2] + h[:, 2, 0]],
        axis=1,
    )


def element_stress(
    gradient: NDArray[np.float64], elasticity: NDArray[np.float64], displacement: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the average linear elastic stress of elements, components xx yy zz xy yz xz, shape (m, 6) [Pa].

    Args:
        gradient: Mean gradients of the shape functions, shape (m, k, 3) [1/m].
        elasticity: Elasticity of each element, shape (m, 6, 6) [Pa].
        displacement: Displacement of the nodes, shape (m, k, 3) [m].
    """
    return np.einsum("mij,mj->mi", elasticity, mean_strain(gradient, displacement))


def von_mises(stress: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the von Mises stresses of several points, shape (m,), in the unit of the stresses.

    Args:
        stress: Stresses xx, yy, zz, xy, yz, xz, shape (m, 6).
    """
    xx, yy, zz, xy, yz, xz = stress.T
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2))


def principal_strains(strain: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return principal strains (m, 3), ascending, of strains xx yy zz xy yz xz (m, 6) with engineering shear."""
    return np.linalg.eigvalsh(symmetric(strain * [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]))


def symmetric(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return symmetric matrices, shape (m, 3, 3), from the components xx yy zz xy yz xz, shape (m, 6)."""
    xx, yy, zz, xy, yz, xz = values.T
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)


def voigt(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the components xx yy zz xy yz xz, shape (m, 6), of symmetric matrices, shape (m, 3, 3)."""
    return matrices[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]


def principal_strain(corners: NDArray[np.float64], displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the largest (row 0) and smallest (row 1) in-plane principal strain at facet centres, shape (2, f).

    The facets are quadrilaterals normal to z.

    Args:
        corners: In-plane corners in cyclic order, shape (f, 4, 2) [m].
        displacement: In-plane displacement of the corners, shape (f, 4, 2) [m].
    """
    tangent = np.array([[-0.25, -0.25], [0.25, -0.25], [0.25, 0.25], [-0.25, 0.25]])
    jacobian = np.einsum("fai,ad->fid", corners, tangent)
    gradient = np.einsum("fai,ad->fid", displacement, tangent) @ np.linalg.inv(jacobian)
    mean = 0.5 * (gradient[:, 0, 0] + gradient[:, 1, 1])
    radius = np.hypot(0.5 * (gradient[:, 0, 0] - gradient[:, 1, 1]), 0.5 * (gradient[:, 0, 1] + gradient[:, 1, 0]))
    return np.array([mean + radius, mean - radius])
