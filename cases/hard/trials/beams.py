"""Bending trials of elements against Timoshenko's beam and a plastic hinge, and orders of convergence."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import trapezoid

from reflowshock.cases.hard.trials.bodies import force_of, nonlinear
from reflowshock.cases.hard.trials.boxes import KINDS, box, elements_of, laminate, mass_of, solve
from reflowshock.cases.hard.trials.elements import Bending, Hinge, Order
from reflowshock.cases.hard.trials.grids import CYCLIC
from reflowshock.fem.elements.element import critical_steps, element_geometry
from reflowshock.fem.elements.kind import ElementKind
from reflowshock.fem.elements.stress import mean_strain
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.mesh import boundary_facets
from reflowshock.materials.parameters import Isotropic, JohnsonCook, Material

YOUNG = 1e9  # Young's modulus of the beams [Pa]; without influence on the measures
CURVATURE = 6.0  # curvature of the hinge over the yield curvature
HINGE_STEPS = 4000


def bending(parameters: Bending) -> dict[str, float]:
    """Return the relative error of the tip deflection of a beam."""
    along, across, up = parameters.cells
    lines = [
        np.linspace(0, count * long, count + 1) for count, long in ((along, parameters.aspect), (across, 1), (up, 1))
    ]
    length, width, height = (float(line[-1]) for line in lines)
    deflection = tip(KINDS[parameters.element], lines, [laminate(parameters.poisson_ratio, young=YOUNG)])
    exact = beam(length, width, np.array([height]), np.array([YOUNG]), parameters.poisson_ratio)
    return {"deflection_error": abs(deflection / exact - 1.0)}


def tip(
    kind: ElementKind,
    lines: Sequence[np.ndarray],
    materials: Sequence[Material],
    layers: Callable[[np.ndarray], np.ndarray] | None = None,
    move: Callable[[np.ndarray], np.ndarray] = lambda points: points,
) -> float:
    """Return the mean deflection of the end x = L under a distributed unit load.

    The root x = 0 keeps its plane but may contract in it, as in beam theory.

    Args:
        kind: Kind of element.
        lines: Grid lines; there are nodes at half height.
        materials: Materials of the layers.
        layers: Function from heights of element centres to layers, (ne,) -> (ne,).
        move: Map of the points.
    """
    points, cells = box(kind, *lines, move=move)
    length, width, height = (line[-1] for line in lines)
    x, y, z = points.T
    number = layers(points[cells[:, : 8 if kind.nodes == 8 else 4]].mean(axis=1)[:, 2]) if layers else 0
    elements = elements_of(kind, points, cells, materials, number)
    held, root = np.zeros(points.shape, dtype=bool), x < 1e-9 * length
    held[root, 0] = True
    held[root & (np.abs(z - lines[2][len(lines[2]) // 2]) < 1e-9 * height), 2] = True
    held[root & (y < 1e-9 * width), 1] = True
    end = x > (1 - 1e-9) * length
    facets = boundary_facets(cells)[:, CYCLIC if kind.nodes == 8 else slice(None)]
    facets = facets[end[facets].all(axis=1)]
    load = np.zeros(points.shape)
    np.add.at(load[:, 2], facets, np.abs(area_vectors(points[facets])[:, :, 0]) / (width * height))
    return float(solve(elements, np.zeros(points.shape), held, load)[end, 2].mean())


def beam(length: float, width: float, heights: np.ndarray, young: np.ndarray, poisson: float = 0.0) -> float:
    """Return Timoshenko's tip deflection of a layered beam under a unit load with the exact shear stress energy."""
    z = np.concatenate([[0.0], np.cumsum(heights)])
    axis = (young @ np.diff(z**2)) / (2 * young @ heights)
    rigidity = width * young @ np.diff((z - axis) ** 3) / 3
    fine = np.linspace(0, z[-1], 20001)
    modulus = young[np.clip(np.searchsorted(z, fine, side="right") - 1, 0, len(young) - 1)]
    shear = np.cumsum(modulus * (fine - axis)) * fine[1] * width / rigidity
    flexibility = trapezoid(shear**2 * 2 * (1 + poisson) / modulus, fine) / width
    return float(length**3 / (3 * rigidity) + length * flexibility)


def hinge(parameters: Hinge) -> dict[str, float]:
    """Return the error of the moment of a beam that is bent far beyond yield."""
    return {"moment_error": bent_moment(parameters.element, parameters.layers) - 1.0}


def bent_moment(name: str, layers: int) -> float:
    """Bend a beam to six times its yield curvature; return its moment over beam theory.

    The end sections stay plane and rotate slowly; all other nodes come to rest by damping.
    """
    length = 3.0
    law = JohnsonCook(A=50e6, B=0.0, n=1.0)
    material = Isotropic(density=1000.0, young_modulus=50e9, poisson_ratio=0.3, plasticity=law)
    points, cells = box(KINDS[name], np.linspace(0, length, 7), [0, 1], np.linspace(-0.5, 0.5, layers + 1))
    elements = elements_of(KINDS[name], points, cells, [material])
    term, mass = nonlinear(elements, material, finite=False), mass_of(elements)[:, None]
    step = 0.8 * critical_steps(elements, element_geometry(points, cells).nodal_volume).min()
    x, y, z = points.T
    end, free = x > length - 1e-9, np.ones(points.shape, dtype=bool)
    free[(x < 1e-9) | end, 0], free[y < 1e-9, 1], free[(x < 1e-9) & (z < -0.5 + 1e-9), 2] = False, False, False
    displacement, velocity = np.zeros_like(points), np.zeros_like(points)
    for k in range(1, HINGE_STEPS + 1):
        force = force_of(term, displacement)
        velocity = np.where(free, 0.985 * (velocity - step * force / mass), 0.0)
        displacement += step * velocity
        turned = k / HINGE_STEPS * CURVATURE * 2 * law.A / material.young_modulus * length
        displacement[end, 0] = -turned * z[end]
    exact = law.A / 4 * (1 - 1 / (3 * CURVATURE**2))
    return abs(float(force[end, 0] @ z[end])) / exact


COUNTS = {4: (9, 13, 18), 8: (6, 9, 13), 10: (3, 5, 7)}  # boxes in each direction by nodes per element
POISSON = 0.3


def order(parameters: Order) -> dict[str, float]:
    """Return the orders in h of displacements and strains in the L2 norm."""
    of_displacement, of_strain = orders_in_h(parameters.element, parameters.poisson_ratio)
    return {"displacement_order": of_displacement, "strain_order": of_strain}


def orders_in_h(name: str, poisson: float = POISSON) -> tuple[float, float]:
    """Return the orders of displacements and strains of a kind of element on three meshes."""
    material = Isotropic(density=1.0, young_modulus=2 * (1 + poisson), poisson_ratio=poisson)
    counts = COUNTS[KINDS[name].nodes]
    errors = [errors_of(name, material, count) for count in counts]
    of_displacement, of_strain = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    return float(of_displacement), float(of_strain)


def errors_of(name: str, material: Isotropic, count: int) -> tuple[float, float]:
    """Return the L2 errors of displacements and strains with prescribed displacements on all faces."""
    kind, poisson = KINDS[name], material.poisson_ratio
    points, cells = box(kind, *[np.linspace(0, 1, count + 1)] * 3, move=wavy)
    elements = elements_of(kind, points, cells, [material])
    held = np.zeros(points.shape, dtype=bool)
    held[boundary_facets(cells)] = True
    exact = exact_displacement(points, poisson)
    displacement = solve(elements, exact, held)
    geometry = element_geometry(points, cells)
    strain = mean_strain(geometry.gradient, displacement[cells])
    centres = points[cells[:, : 8 if kind.nodes == 8 else 4]].mean(axis=1)
    of_strains = geometry.volume @ (strain - exact_strain(centres, poisson)) ** 2
    return float(np.sqrt(mass_of(elements) @ np.sum((displacement - exact) ** 2, axis=1))), float(
        np.sqrt(of_strains.sum())
    )


def exact_displacement(points: np.ndarray, poisson: float) -> np.ndarray:
    """Return u = (grad(x psi) - 4 (1 - nu) psi e_x) / 2, Papkovich-Neuber with one harmonic potential, mu = 1."""
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
    """Move the points of a cube so that no element is a box but the faces stay plane."""
    waves = np.sin(np.pi * points)
    return points + waves.prod(axis=1)[:, None] * (
        [0.08, -0.08, 0.06] + 0.05 * np.sin(2 * np.pi * points[:, [1, 2, 0]])
    )
