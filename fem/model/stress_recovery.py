"""Mean stress, strain and plastic strain of elements, from the displacement or from the stored loading history."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.stress import element_stress, mean_strain, symmetric, voigt, von_mises
from reflowshock.fem.forces.force_corotational import Corotational
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.local_mesh import positions


class StressRecovery:
    """Element averages for selected elements of a rank.

    Linear elements follow their elastic law plus their initial stress. With finite kinematics, stress is the Cauchy
    stress, rotated by R of the mean deformation gradient F = R U of the element, and strain is U - 1.
    """

    def __init__(self, body: Body, chosen: NDArray[np.integer]) -> None:
        """Select elements of a body by their numbers, shape (k,)."""
        elements = body.elements.subset(chosen)
        self._cells, self._gradient = elements.cells, body.geometry.gradient[chosen]
        self._elasticity = elements.elasticity[elements.material]
        self._initial = 0.0 if body.initial_stress is None else body.initial_stress[chosen]
        self._stored: list[tuple[NonlinearElements, NDArray[np.int64], NDArray[np.int32]]] = []
        self._finite, self._turning = np.zeros((2, len(chosen)), dtype=bool)
        for term in body.terms:
            if isinstance(term, NonlinearElements):
                index = positions(term.numbers, chosen)
                rows = np.flatnonzero(index >= 0)
                self._stored.append((term, rows, index[rows]))
                self._finite[rows] = term.finite
            elif isinstance(term, Corotational):
                self._turning |= positions(term.numbers, chosen) >= 0
        self._finite |= self._turning

    def stress(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean stresses, shape (k, 6) [Pa], at a displacement, shape (n, 3) [m]."""
        result, finite = self._unrotated_stress(displacement), self._finite
        if finite.any():
            deformation = np.eye(3) + self._displacement_gradient(displacement, finite)
            rotation, stretch = polar(deformation)
            result[self._turning] = self._corotational_stress(stretch[self._turning[finite]])
            rotated = rotation @ symmetric(result[finite]) @ rotation.transpose(0, 2, 1)
            result[finite] = voigt(rotated / np.linalg.det(deformation)[:, None, None])
        return result

    def mises(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the von Mises stresses, shape (k,) [Pa], at a displacement, shape (n, 3) [m]."""
        result, finite = von_mises(self._unrotated_stress(displacement)), self._finite
        if finite.any():
            result[finite] /= np.linalg.det(np.eye(3) + self._displacement_gradient(displacement, finite))
        return result

    def _unrotated_stress(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the stresses, for finite kinematics Kirchhoff stresses in element frames, shape (k, 6) [Pa]."""
        result = element_stress(self._gradient, self._elasticity, displacement[self._cells]) + self._initial
        for term, rows, places in self._stored:
            result[rows] = term.means(places).stress
        return result

    def strain(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the strains with engineering shear, shape (k, 6), at a displacement, shape (n, 3) [m]."""
        local = displacement[self._cells]
        result = mean_strain(self._gradient, local)
        finite = self._finite
        if finite.any():
            deformation = np.eye(3) + self._displacement_gradient(displacement, finite)
            _, stretch = polar(deformation)
            result[finite] = voigt(stretch - np.eye(3)) * [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]
        return result

    def neglected_strain(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the largest strain that small kinematics neglects, shape (k,), zero with finite kinematics.

        It is the largest eigenvalue of h^T h / 2, the part of the Green strain that is quadratic in the displacement
        gradient h: the stretch of a rotating body with fixed ends. For corotational boxes, whose stress is linear in
        U - 1, it is half the largest squared principal value of U - 1.
        """
        result = np.zeros(len(self._cells))
        small, turning = ~self._finite, self._turning
        if small.any():
            gradient = self._displacement_gradient(displacement, small)
            result[small] = 0.5 * np.linalg.eigvalsh(gradient.transpose(0, 2, 1) @ gradient)[:, -1]
        if turning.any():
            stretches = np.linalg.svd(np.eye(3) + self._displacement_gradient(displacement, turning), compute_uv=False)
            result[turning] = 0.5 * np.abs(stretches - 1.0).max(axis=1) ** 2
        return result

    def _corotational_stress(self, stretch: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unrotated stresses, shape (r, 6) [Pa], of corotational boxes with stretches, shape (r, 3, 3)."""
        strain = voigt(stretch - np.eye(3)) * [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]
        elastic = np.einsum("kij,kj->ki", self._elasticity[self._turning], strain)
        return np.asarray(elastic + np.broadcast_to(self._initial, (len(self._cells), 6))[self._turning])

    def _displacement_gradient(self, displacement: NDArray[np.float64], rows: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the mean displacement gradients of selected elements, shape (r, 3, 3)."""
        return np.einsum("kai,kaj->kij", displacement[self._cells[rows]], self._gradient[rows])

    def plastic_strain(self) -> NDArray[np.float64]:
        """Return the equivalent plastic strains, zero for elastic materials, shape (k,)."""
        result = np.zeros(len(self._cells))
        for term, rows, places in self._stored:
            result[rows] = term.means(places).plastic_strain
        return result

    def plastic_work(self) -> NDArray[np.float64]:
        """Return the plastic work densities, zero for elastic materials, shape (k,) [J/m^3]."""
        result = np.zeros(len(self._cells))
        for term, rows, places in self._stored:
            result[rows] = term.means(places).plastic_work
        return result


def polar(deformation: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rotations R and stretches U, shape (k, 3, 3) each, of deformation gradients F = R U.

    Args:
        deformation: Deformation gradients F with positive determinants, shape (k, 3, 3).
    """
    left, values, right = np.linalg.svd(deformation)
    return left @ right, right.transpose(0, 2, 1) @ (values[:, :, None] * right)
