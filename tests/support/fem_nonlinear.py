"""Nonlinear elements for tests and their plain NumPy twins, which process one element and one point at a time."""

import numpy as np
from scipy.linalg import polar

from reflowshock.fem.elements.kind import strain_matrix
from reflowshock.fem.elements.stress import symmetric, voigt
from reflowshock.fem.kernels.hexahedron import GAUSS, shape_derivatives
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.kernels.plasticity import plastic_increment
from reflowshock.materials.parameters import Material
from reflowshock.materials.plasticity import plastic_constants

SHEAR_TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


class PointTwin:
    """Integration point in plain NumPy."""

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

    def move(self, gradient: np.ndarray) -> None:
        """Take a step to a displacement gradient."""
        increment, self.stretch, _ = self.increment(gradient)
        self.take(increment)

    def take(self, increment: np.ndarray) -> None:
        """Take a step by a strain increment (6,) with engineering shear."""
        stress = self.stress + self.elasticity @ increment
        matrix = symmetric(stress[None])[0]
        pressure = np.trace(matrix) / 3 * np.eye(3)
        mises = np.sqrt(1.5) * np.linalg.norm(matrix - pressure)
        flow = plastic_increment(mises, self.plastic, self.constants, self.step)
        self.stress = voigt((pressure + (matrix - pressure) * (1.0 - self.constants[0] * flow / mises))[None])[0]
        self.plastic += flow

    def nominal(self, gradient: np.ndarray, stress: np.ndarray) -> np.ndarray:
        """Return the nominal stress P (3, 3) of a stress (6,)."""
        matrix = symmetric(stress[None])[0]
        if not self.finite:
            return matrix
        _, stretch, rotation = self.increment(gradient)
        return rotation @ matrix @ np.linalg.inv(stretch)


class HexahedronTwin:
    """Hexahedron with incompatible modes in plain NumPy; formulas of ``kernels.nonlinear_hexahedron``."""

    def __init__(self, corners: np.ndarray, material: Material, elasticity: np.ndarray, path: Path) -> None:
        self.finite, self.elasticity, self.corners = path.finite, elasticity, corners
        self.points = [PointTwin(material, elasticity, False, path.step) for _ in range(8)]
        self.derivatives, self.centre = shape_derivatives(GAUSS), shape_derivatives(np.zeros((1, 3)))[0]
        self.weight = np.linalg.det(np.einsum("ai,gad->gid", corners, self.derivatives))
        basis, root = np.column_stack([np.ones(8), GAUSS]), np.sqrt(self.weight)[:, None]
        self.fit = basis @ np.linalg.pinv(basis * root) * root.T
        self.place = corners

    def force(self, displacement: np.ndarray) -> np.ndarray:
        """Return the internal force (8, 3) of the next step."""
        position, rotation = self.corners + displacement, np.eye(3)
        if self.finite:
            rotation = polar(position.T @ self.centre @ np.linalg.inv(self.corners.T @ self.centre))[0]
        position = position @ rotation
        middle = 0.5 * (position + self.place) if self.finite else self.corners
        strain = self.compatible(middle, position - self.place)
        self.place = position
        for point, increment in zip(self.points, strain + self.modes(middle, strain), strict=True):
            point.take(increment)
        stress = np.array([point.stress for point in self.points])
        pressure = stress[:, :3].mean(axis=1)
        loads = symmetric(stress + np.outer(self.fit @ pressure - pressure, [1, 1, 1, 0, 0, 0]))
        gradients = self.gradients(position if self.finite else self.corners)
        return np.einsum("g,gij,gaj->ai", self.weight, loads, gradients) @ rotation.T

    def gradients(self, position: np.ndarray) -> np.ndarray:
        """Return the gradients (8, 8, 3) of the shape functions at the Gauss points of a deformed element."""
        return self.derivatives @ np.linalg.inv(np.einsum("ai,gad->gid", position, self.derivatives))

    def compatible(self, middle: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return strain increments (8, 6) with averaged dilatation, engineering shear."""
        rate = np.einsum("ai,gaj->gij", change, self.gradients(middle))
        trace = np.trace(rate, axis1=1, axis2=2)
        rate = rate + (self.fit @ trace - trace)[:, None, None] / 3 * np.eye(3)
        return voigt(0.5 * (rate + rate.transpose(0, 2, 1))) * SHEAR_TWICE

    def modes(self, middle: np.ndarray, strain: np.ndarray) -> np.ndarray:
        """Return the strain increments (8, 6) of the incompatible modes: one Newton step from an elastic trial."""
        normal = np.linalg.inv(middle.T @ self.centre)
        shapes = strain_matrix(GAUSS[:, :, None] * normal / self.weight[:, None, None])
        trial = np.array([point.stress for point in self.points]) + strain @ self.elasticity
        residual = np.einsum("g,gia,gi->a", self.weight, shapes, trial)
        operator = np.einsum("g,gia,ij,gjb->ab", self.weight, shapes, self.elasticity, shapes)
        return -shapes @ np.linalg.solve(operator, residual)
