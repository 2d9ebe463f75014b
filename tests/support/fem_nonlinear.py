"""Nonlinear elements for tests, and their plain NumPy twins: one element and one point at a time, no lanes."""

import numpy as np
from scipy.linalg import polar

from reflowshock.fem.elements.kind import strain_matrix
from reflowshock.fem.elements.stress import symmetric, voigt
from reflowshock.fem.kernels.hexahedron import GAUSS, shape_derivatives
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.kernels.plasticity import plastic_constants, plastic_increment
from reflowshock.fem.materials.parameters import Material

SHEAR_TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


class PointTwin:
    """One integration point."""

    def __init__(self, material: Material, elasticity: np.ndarray, finite: bool, step: float) -> None:
        self.constants, self.elasticity = plastic_constants(material), elasticity
        self.finite, self.step = finite, step
        self.stress, self.plastic, self.stretch = np.zeros(6), 0.0, np.eye(3) if finite else np.zeros((3, 3))

    def increment(self, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return strain increment (6,), stretch and rotation of F (finite) or of the displacement gradient."""
        if not self.finite:
            strain = 0.5 * (gradient + gradient.T)
            return voigt((strain - self.stretch)[None])[0] * SHEAR_TWICE, strain, np.eye(3)
        rotation, stretch = polar(gradient)
        rate = (stretch - self.stretch) @ np.linalg.inv(0.5 * (stretch + self.stretch))
        return voigt(0.5 * (rate + rate.T)[None])[0] * SHEAR_TWICE, stretch, rotation

    def trial(self, gradient: np.ndarray) -> np.ndarray:
        """Return the elastic trial stress (6,)."""
        return self.stress + self.elasticity @ self.increment(gradient)[0]

    def move(self, gradient: np.ndarray) -> None:
        """Take the step."""
        stress = self.trial(gradient)
        self.stretch = self.increment(gradient)[1]
        matrix = symmetric(stress[None])[0]
        pressure = np.trace(matrix) / 3 * np.eye(3)
        mises = np.sqrt(1.5) * np.linalg.norm(matrix - pressure)
        flow = plastic_increment(mises, self.plastic, self.constants, self.step)
        self.stress = voigt((pressure + (matrix - pressure) * (1.0 - self.constants[0] * flow / mises))[None])[0]
        self.plastic += flow

    def nominal(self, gradient: np.ndarray, stress: np.ndarray) -> np.ndarray:
        """Return P (3, 3) of a stress (6,)."""
        matrix = symmetric(stress[None])[0]
        if not self.finite:
            return matrix
        _, stretch, rotation = self.increment(gradient)
        return rotation @ matrix @ np.linalg.inv(stretch)


class HexahedronTwin:
    """One hexahedron with incompatible modes; formulas of ``kernels_nonlinear_hexahedron``."""

    def __init__(self, corners: np.ndarray, material: Material, elasticity: np.ndarray, path: Path) -> None:
        self.finite, self.elasticity = path.finite, elasticity
        self.points = [PointTwin(material, elasticity, path.finite, path.step) for _ in range(8)]
        jacobian = np.array([corners.T @ derivatives for derivatives in shape_derivatives(GAUSS)])
        self.weight = np.linalg.det(jacobian)
        self.gradient = shape_derivatives(GAUSS) @ np.linalg.inv(jacobian)
        derivatives = shape_derivatives(np.zeros((1, 3)))[0]
        centre = corners.T @ derivatives
        self.centre = derivatives @ np.linalg.inv(centre)
        self.normal = -2.0 * np.linalg.det(centre) * np.linalg.inv(centre)
        basis, root = np.column_stack([np.ones(8), GAUSS]), np.sqrt(self.weight)[:, None]
        self.fit = basis @ np.linalg.pinv(basis * root) * root.T
        self.modes = np.zeros((3, 3))

    def force(self, displacement: np.ndarray) -> np.ndarray:
        """Return the internal force (8, 3) of the next step."""
        unit = np.eye(3) if self.finite else np.zeros((3, 3))
        compatible = unit + np.einsum("ai,gaj->gij", displacement, self.gradient)
        rotation, stretch = polar(unit + displacement.T @ self.centre) if self.finite else (np.eye(3), np.eye(3))
        shapes = GAUSS[:, :, None] * self.normal / self.weight[:, None, None]
        gradients, total = self.deformations(compatible, rotation, shapes)
        stress = np.array([p.trial(f) for p, f in zip(self.points, gradients, strict=True)])
        residual = np.einsum("g,gij,gkj->ki", self.weight, self.nominals(gradients, total, stress)[0], shapes)
        strain = strain_matrix(shapes @ np.linalg.inv(stretch).T)
        operator = np.einsum("g,gia,ij,gjb->ab", self.weight, strain, self.elasticity, strain)
        self.modes = self.modes - np.linalg.solve(operator, (residual @ rotation).ravel()).reshape(3, 3)
        gradients, total = self.deformations(compatible, rotation, shapes)
        for point, gradient in zip(self.points, gradients, strict=True):
            point.move(gradient)
        stress = np.array([p.stress for p in self.points])
        nominal, pressure = self.nominals(gradients, total, stress)
        change = self.fit @ pressure - pressure
        cofactor = np.linalg.det(compatible)[:, None, None] * np.linalg.inv(compatible).transpose(0, 2, 1)
        nominal = nominal + change[:, None, None] * (cofactor if self.finite else np.eye(3))
        return np.einsum("g,gij,gaj->ai", self.weight, nominal, self.gradient)

    def deformations(
        self, compatible: np.ndarray, rotation: np.ndarray, shapes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return what goes to the material, and the total deformation before its dilatation is changed."""
        total = compatible + np.einsum("ki,gkj->gij", self.modes @ rotation.T, shapes)
        if not self.finite:
            trace = np.trace(compatible, axis1=1, axis2=2)
            return total + (self.fit @ trace - trace)[:, None, None] / 3 * np.eye(3), total
        own = np.linalg.det(compatible)
        ratio = (np.linalg.det(total) + self.fit @ own - own) / np.linalg.det(total)
        return np.cbrt(ratio)[:, None, None] * total, total

    def nominals(self, gradients: np.ndarray, total: np.ndarray, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return P on the total deformation (8, 3, 3), and p / J' (8,)."""
        pressure = stress[:, :3].mean(axis=1)
        if not self.finite:
            return symmetric(stress), pressure
        mean = np.linalg.det(gradients)
        cube = mean / np.linalg.det(total)
        shifted = stress + np.outer(pressure / cube - pressure, [1, 1, 1, 0, 0, 0])
        points = zip(self.points, gradients, shifted, strict=True)
        plain = np.array([point.nominal(gradient, one) for point, gradient, one in points])
        return np.cbrt(cube)[:, None, None] * plain, pressure / mean
