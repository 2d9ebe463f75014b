"""Trials of elements whose nodes all move as one field says: patch tests, turns, tension and compression."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from reflowshock.fem.elements.element import Elements, element_geometry
from reflowshock.fem.elements.stress import element_stress, symmetric
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.mesh.mesh import boundary_facets
from reflowshock.fem.trials.bodies import force_of, nonlinear
from reflowshock.fem.trials.distortion import body_of, laminate
from reflowshock.fem.trials.metals import LINEAR_HARDENING
from reflowshock.fem.trials.parameters import Compression, Patch, Tension, Turns

AXIS = np.array([0.48, -0.6, 0.64])
LARGE = 0.3  # largest component of a displacement gradient of finite strain


class Followed(NamedTuple):
    """The end of a path: stress (3, 3) in the frame that turns along, its scatter, the force on inner nodes.

    Scatter and force are relative.
    """

    stress: np.ndarray
    scatter: float
    force: float


def patch(given: Patch) -> dict[str, float]:
    """Return what an affine field leaves on inner nodes, how its stress scatters, and what elements resist by."""
    material = laminate(given.poisson_ratio, given.orthotropy)
    elements = body_of(given, material)
    gradient = np.random.default_rng(given.seed).uniform(-1.0, 1.0, (3, 3)) * LARGE
    if given.kinematics == "finite":
        found = follow(nonlinear(elements, material, finite=True), lambda s: np.eye(3) + s * gradient, 1)
        force_error, stress_error = found.force, found.scatter
    else:
        force_error, stress_error = affine(elements, gradient)
    softest, rigid = resisted(elements)
    return {"force_error": force_error, "stress_error": stress_error, "softest_mode": softest, "rigid_mode": rigid}


def affine(elements: Elements, gradient: np.ndarray) -> tuple[float, float]:
    """Return the force on inner nodes, over the largest, and the error of the stress, of linear elements."""
    displacement = elements.points @ gradient.T
    force = np.zeros_like(displacement)
    for term in linear_terms(elements):
        term.add(displacement, force)
    strain = np.array([*np.diag(gradient), *(gradient + gradient.T)[[0, 1, 0], [1, 2, 2]]])
    exact = elements.elasticity[0] @ strain
    mean = element_geometry(elements.points, elements.cells).gradient
    elasticity = np.repeat(elements.elasticity, len(elements.cells), axis=0)
    stress = element_stress(mean, elasticity, displacement[elements.cells])
    left = np.abs(force[inner_nodes(elements)]).max(initial=0.0) / np.abs(force).max()
    return float(left), float(np.abs(stress - exact).max() / np.abs(exact).max())


def resisted(elements: Elements) -> tuple[float, float]:
    """Return the softest strain of any element and its stiffest rigid motion, over its stiffest strain.

    Nodes are scaled to a cube: a flat element is soft in bending because it is flat.
    """
    corners = elements.points[elements.cells]
    values = np.linalg.eigvalsh(elements.kind.stiffness(corners, elements.elasticity, elements.material))
    return float((values[:, 6] / values[:, -1]).min()), float((np.abs(values[:, 5]) / values[:, -1]).max())


def inner_nodes(elements: Elements) -> np.ndarray:
    """Return the nodes (k,) on no face of the body."""
    return np.setdiff1d(np.arange(len(elements.points)), boundary_facets(elements.cells))


def turns(given: Turns) -> dict[str, float]:
    """Return force and stress, over the modulus, that turning alone has made: none, exactly."""
    material = laminate(given.poisson_ratio, given.orthotropy)
    term = nonlinear(body_of(given, material), material, finite=True)
    points, worst = term.elements.points, 0.0
    area = float(np.ptp(points, axis=0).max()) ** 2
    modulus = float(term.elements.elasticity.max())
    for turn in np.linspace(0.0, given.turns, 4 * given.turns + 1)[1:]:
        matrix = Rotation.from_rotvec(2 * np.pi * turn * AXIS).as_matrix()
        worst = np.maximum(worst, np.abs(force_of(term, points @ matrix.T - points)).max())
    stress = term.means(np.arange(len(term.numbers))).stress
    return {"force_error": float(worst) / (modulus * area), "stress_error": float(np.abs(stress).max()) / modulus}


def tension(given: Tension) -> dict[str, float]:
    """Return the error of the stress at the end of a uniaxial path of a metal, where its law gives it exactly.

    Axial strain s / E + p, lateral -nu s / E - p / 2, s = A + B p; of finite kinematics these are logarithmic, and the
    body turns by 1.4 rad on the way.
    """
    metal, law, plastic = LINEAR_HARDENING, LINEAR_HARDENING.plasticity, given.plastic_strain
    assert law is not None
    stress = law.A + law.B * plastic
    elastic = stress / metal.young_modulus
    strain = np.array([elastic + plastic, *[-metal.poisson_ratio * elastic - plastic / 2] * 2])
    turn = Rotation.from_rotvec([0.3, 1.1, -0.7])

    def path(s: float) -> np.ndarray:
        if given.kinematics == "small":
            return np.eye(3) + s * np.diag(strain)
        return (turn**s).as_matrix() @ np.diag(np.exp(s * strain))

    found = follow(nonlinear(body_of(given, metal), metal, given.kinematics == "finite"), path, given.steps)
    return judged(found, np.diag([stress, 0.0, 0.0]))


def compression(given: Compression) -> dict[str, float]:
    """Return the error of the stress of a confined body, C ln U exactly."""
    material = laminate(given.poisson_ratio, given.orthotropy)
    term = nonlinear(body_of(given, material), material, finite=True)
    found = follow(term, lambda s: np.diag([1.0, 1.0, given.stretch**s]), given.steps)
    return judged(found, symmetric((np.log(given.stretch) * term.elements.elasticity[0, :, 2])[None])[0])


def judged(found: Followed, exact: np.ndarray) -> dict[str, float]:
    """Compare the end of a path with its exact stress."""
    return {
        "stress_error": float(np.abs(found.stress - exact).max() / np.abs(exact).max()),
        "stress_scatter": found.scatter,
        "force_error": found.force,
    }


def follow(term: NonlinearElements, path: Callable[[float], np.ndarray], steps: int) -> Followed:
    """Deform all by F(s), s from 0 to 1.

    Round-off of U is multiplied by the modulus, which forces and stresses are over where that is more.
    """
    elements = term.elements
    points = elements.points
    for k in range(1, steps + 1):
        force = force_of(term, points @ (path(k / steps) - np.eye(3)).T)
    means = term.means(np.arange(len(term.numbers))).stress
    left = np.abs(force[inner_nodes(elements)]).max(initial=0.0) / np.abs(force).max()
    return Followed(symmetric(means[:1])[0], float(np.abs(means - means[0]).max() / np.abs(means).max()), float(left))
