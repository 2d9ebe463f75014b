"""Trials of elements that bend: a beam's end against Timoshenko's, and the moment of a plastic hinge."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import trapezoid

from reflowshock.fem.elements.element import critical_steps, element_geometry
from reflowshock.fem.elements.kind import ElementKind
from reflowshock.fem.materials.parameters import Isotropic, JohnsonCook, Material
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.mesh import boundary_facets
from reflowshock.fem.trials.bodies import force_of, nonlinear
from reflowshock.fem.trials.boxes import KINDS, box, elements_of, mass_of, solve
from reflowshock.fem.trials.distortion import laminate
from reflowshock.fem.trials.grids import CYCLIC
from reflowshock.fem.trials.parameters import Bending, Hinge

YOUNG = 1e9  # of beams [Pa]; nothing depends on it
CURVATURE = 6.0  # of the hinge, over that at which the beam yields
HINGE_STEPS = 4000


def bending(given: Bending) -> dict[str, float]:
    """Return the error of the deflection of the end of a beam, over the exact one."""
    along, across, up = given.cells
    lines = [np.linspace(0, count * long, count + 1) for count, long in ((along, given.aspect), (across, 1), (up, 1))]
    length, width, height = (float(line[-1]) for line in lines)
    found = tip(KINDS[given.element], lines, [laminate(given.poisson_ratio, young=YOUNG)])
    exact = beam(length, width, np.array([height]), np.array([YOUNG]), given.poisson_ratio)
    return {"deflection_error": abs(found / exact - 1.0)}


def tip(
    kind: ElementKind,
    lines: Sequence[np.ndarray],
    materials: Sequence[Material],
    layers: Callable[[np.ndarray], np.ndarray] | None = None,
    move: Callable[[np.ndarray], np.ndarray] = lambda points: points,
) -> float:
    """Mean deflection of the end x = L under a unit load that is spread over it.

    The root x = 0 keeps its plane but may contract in it, as a beam's does.

    Args:
        kind: Of element.
        lines: Of the grid; there are nodes half way up.
        materials: Of the layers.
        layers: Layer of elements by the height of their centre, (ne,) -> (ne,).
        move: Of the points.
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
    """Timoshenko's tip deflection of a layered beam under a unit load, shear energy of the exact shear stress."""
    z = np.concatenate([[0.0], np.cumsum(heights)])
    axis = (young @ np.diff(z**2)) / (2 * young @ heights)
    rigidity = width * young @ np.diff((z - axis) ** 3) / 3
    fine = np.linspace(0, z[-1], 20001)
    modulus = young[np.clip(np.searchsorted(z, fine, side="right") - 1, 0, len(young) - 1)]
    shear = np.cumsum(modulus * (fine - axis)) * fine[1] * width / rigidity
    flexibility = trapezoid(shear**2 * 2 * (1 + poisson) / modulus, fine) / width
    return float(length**3 / (3 * rigidity) + length * flexibility)


def hinge(given: Hinge) -> dict[str, float]:
    """Return the error of the moment of a beam that is bent far beyond yield."""
    return {"moment_error": bent_moment(given.element, given.layers) - 1.0}


def bent_moment(name: str, layers: int) -> float:
    """Bend a beam to six times its yield curvature; return its moment over that of beam theory.

    The end planes keep their plane and turn slowly; everything else finds its rest, damped.
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
