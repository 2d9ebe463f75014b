"""Trial of the order at which elements converge on distorted meshes, against an exact solution."""

import numpy as np

from reflowshock.fem.elements.element import element_geometry
from reflowshock.fem.elements.stress import mean_strain
from reflowshock.fem.materials.parameters import Isotropic
from reflowshock.fem.mesh.mesh import boundary_facets
from reflowshock.fem.trials.boxes import KINDS, box, elements_of, mass_of, solve
from reflowshock.fem.trials.parameters import Order

COUNTS = {4: (9, 13, 18), 8: (6, 9, 13), 10: (3, 5, 7)}  # of boxes each way, by the nodes of an element
POISSON = 0.3


def order(given: Order) -> dict[str, float]:
    """Return the orders in h of displacements and strains in the L2 norm."""
    of_displacement, of_strain = orders_in_h(given.element, given.poisson_ratio)
    return {"displacement_order": of_displacement, "strain_order": of_strain}


def orders_in_h(name: str, poisson: float = POISSON) -> tuple[float, float]:
    """Return the orders of displacements and strains of a kind of element on three meshes."""
    material = Isotropic(density=1.0, young_modulus=2 * (1 + poisson), poisson_ratio=poisson)
    counts = COUNTS[KINDS[name].nodes]
    errors = [errors_of(name, material, count) for count in counts]
    of_displacement, of_strain = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    return float(of_displacement), float(of_strain)


def errors_of(name: str, material: Isotropic, count: int) -> tuple[float, float]:
    """Return the errors of displacements and strains in the L2 norm, the displacement of all faces given."""
    kind, poisson = KINDS[name], material.poisson_ratio
    points, cells = box(kind, *[np.linspace(0, 1, count + 1)] * 3, move=wavy)
    elements = elements_of(kind, points, cells, [material])
    held = np.zeros(points.shape, dtype=bool)
    held[boundary_facets(cells)] = True
    exact = exact_displacement(points, poisson)
    found = solve(elements, exact, held)
    geometry = element_geometry(points, cells)
    strain = mean_strain(geometry.gradient, found[cells])
    centres = points[cells[:, : 8 if kind.nodes == 8 else 4]].mean(axis=1)
    of_strains = geometry.volume @ (strain - exact_strain(centres, poisson)) ** 2
    return float(np.sqrt(mass_of(elements) @ np.sum((found - exact) ** 2, axis=1))), float(np.sqrt(of_strains.sum()))


def exact_displacement(points: np.ndarray, poisson: float) -> np.ndarray:
    """Papkovich and Neuber with one harmonic potential psi e_x, mu = 1: u = (grad(x psi) - 4 (1 - nu) psi e_x) / 2."""
    a, b = 1.3, 0.8
    x, y, z = points.T
    psi = np.sin(a * x) * np.sin(b * y + 0.4) * np.exp(np.hypot(a, b) * z)
    along_x = a * np.cos(a * x) * np.sin(b * y + 0.4) * np.exp(np.hypot(a, b) * z)
    gradient = np.stack([along_x, psi * b / np.tan(b * y + 0.4), psi * np.hypot(a, b)], axis=1)
    result = x[:, None] * gradient
    result[:, 0] += psi - 4.0 * (1.0 - poisson) * psi
    return 0.5 * result


def exact_strain(points: np.ndarray, poisson: float) -> np.ndarray:
    """Return the strain (n, 6) of the exact displacement, by central differences."""
    step = 1e-5
    sides = [step * axis for axis in np.eye(3)]
    h = [exact_displacement(points + s, poisson) - exact_displacement(points - s, poisson) for s in sides]
    x, y, z = (column / (2 * step) for column in h)
    return np.stack([x[:, 0], y[:, 1], z[:, 2], x[:, 1] + y[:, 0], y[:, 2] + z[:, 1], x[:, 2] + z[:, 0]], axis=1)


def wavy(points: np.ndarray) -> np.ndarray:
    """Return points of a cube moved so that no element is a box, its faces flat."""
    waves = np.sin(np.pi * points)
    return points + waves.prod(axis=1)[:, None] * (
        [0.08, -0.08, 0.06] + 0.05 * np.sin(2 * np.pi * points[:, [1, 2, 0]])
    )
