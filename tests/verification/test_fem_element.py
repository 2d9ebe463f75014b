"""Patch tests and bending tests that qualify the hexahedron for boards."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import dns_body
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.elements.element import Elements, element_geometry
from reflowshock.fem.elements.stress import element_stress
from reflowshock.fem.forces.force import force_terms
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4, SAC405
from reflowshock.materials.parameters import Isotropic
from tests.support.fem_bodies import dense_stiffness
from tests.support.fem_models import bar

RANDOM = np.random.default_rng(3)


def distorted_cube() -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (n, 3) and hexahedra (c, 8) of a unit cube whose inner nodes are moved."""
    points, cells = grid(*[np.linspace(0, 1, 4)] * 3)
    inner = np.all((points > 1e-9) & (points < 1 - 1e-9), axis=1)
    points[inner] += RANDOM.uniform(-0.08, 0.08, (inner.sum(), 3))
    return points, cells


@pytest.mark.parametrize("material", [FR4, SAC405.elastic])
def test_patch_of_distorted_hexahedra_carries_constant_stress(material):
    points, cells = distorted_cube()
    elements = Elements(
        points, cells, np.zeros(len(cells), np.int32), elasticity_matrix(material)[None], np.ones(len(cells))
    )
    gradient = RANDOM.uniform(-1, 1, (3, 3))
    displacement = points @ gradient.T
    force = np.zeros_like(points)
    for term in force_terms(elements, [material]):
        term.add(displacement, force)
    inner = np.all((points > 1e-9) & (points < 1 - 1e-9), axis=1)
    assert np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()

    strain = np.array([*np.diag(gradient), *(gradient + gradient.T)[[0, 1, 0], [1, 2, 2]]])
    stress = element_stress(
        element_geometry(points, cells).gradient,
        np.repeat(elements.elasticity, len(cells), axis=0),
        displacement[cells],
    )
    exact = elasticity_matrix(material) @ strain
    assert np.abs(stress - exact).max() < 1e-12 * np.abs(exact).max()


def cantilever_tip(poisson: float, size: tuple[float, float, float], counts: tuple[int, int, int]) -> float:
    """Return the tip deflection under a unit end load over the deflection of a Timoshenko beam.

    The root stays plane but can contract in its plane, as in beam theory.
    """
    young, shear_factor = 1.0e9, 5.0 / 6.0
    points, cells = grid(*(np.linspace(0, length, count + 1) for length, count in zip(size, counts, strict=True)))
    mesh = mesh_of(points, cells, "board", {"symmetry_x": on(0, 0.0), "end": on(0, size[0])})
    body, _ = dns_body(mesh, Isotropic(density=1.0, young_modulus=young, poisson_ratio=poisson))
    x, y, z = body.local.points.T
    body.free[(x < 1e-9) & (np.abs(y - size[1] / 2) <= size[1] / 2 * (counts[1] % 2 + 1e-9)), 1] = False
    body.free[(x < 1e-9) & (np.abs(z - size[2] / 2) < 1e-9), 2] = False
    stiffness, free = dense_stiffness(body), body.free.ravel()
    load = np.zeros((len(body.mass), 3))
    for quad in body.local.locate(mesh.facets["end"].ravel()).reshape(-1, 4):
        load[quad, 2] += 0.25 / len(mesh.facets["end"])
    deflection = np.zeros(len(free))
    deflection[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load.ravel()[free])
    tip = deflection.reshape(-1, 3)[np.abs(body.local.points[:, 0] - size[0]) < 1e-9, 2].mean()
    length, width, height = size
    area, inertia = width * height, width * height**3 / 12
    shear = young / (2 * (1 + poisson))
    return tip / (length**3 / (3 * young * inertia) + length / (shear_factor * shear * area))


@pytest.mark.parametrize("aspect", [2.5, 10.0, 25.0])
def test_bending_does_not_lock_with_the_aspect_of_the_elements(aspect):
    layer = 0.1e-3
    length = 16 * aspect * layer
    assert cantilever_tip(0.0, (length, layer, 4 * layer), (16, 1, 4)) == pytest.approx(1.0, abs=0.02)


def test_bending_does_not_lock_when_nearly_incompressible():
    assert cantilever_tip(0.499, (10.0, 1.0, 1.0), (16, 2, 2)) == pytest.approx(1.0, abs=0.02)


def test_bar_of_one_element_across_is_a_bar():
    body, _ = dns_body(bar(1.0, 4, 0.1), Isotropic(density=1.0, young_modulus=1.0, poisson_ratio=0.0))
    x = body.local.points[:, 0]
    stretched = np.column_stack([x, 0 * x, 0 * x])
    force = (dense_stiffness(body) @ stretched.ravel()).reshape(-1, 3)
    assert force[np.abs(x - 1.0) < 1e-9, 0].sum() == pytest.approx(0.01, rel=1e-12)
