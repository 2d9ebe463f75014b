"""Element trials with uniform strain: patch tests, rotations, tension, compression, and tension across a tie."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from scipy.spatial.transform import Rotation

from reflowshock.cases.hard.trials.bodies import LINEAR_HARDENING, force_of, nonlinear
from reflowshock.cases.hard.trials.boxes import YOUNG, body_of, distorted, laminate, stiffness_matrix
from reflowshock.cases.hard.trials.elements import Compression, Patch, Tension, Tied, Turns
from reflowshock.cases.hard.trials.grids import mesh_of, on
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.elements.element import Elements, element_geometry
from reflowshock.fem.elements.stress import element_stress, symmetric
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.mesh.mesh import MeshData, append, boundary_facets
from reflowshock.fem.model.assembly import make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import Materials

AXIS = np.array([0.48, -0.6, 0.64])
LARGE = 0.3  # largest component of a finite displacement gradient


class Followed(NamedTuple):
    """State at the end of a path: co-rotated stress (3, 3), its scatter, and the force on inner nodes.

    Scatter and force are relative.
    """

    stress: np.ndarray
    scatter: float
    force: float


def patch(parameters: Patch) -> dict[str, float]:
    """Return the force on inner nodes and the stress scatter of an affine field, and the element stiffness extremes."""
    material = laminate(parameters.poisson_ratio, parameters.orthotropy)
    elements = body_of(parameters, material)
    gradient = np.random.default_rng(parameters.seed).uniform(-1.0, 1.0, (3, 3)) * LARGE
    if parameters.kinematics == "finite":
        errors = follow(nonlinear(elements, material, finite=True), lambda s: np.eye(3) + s * gradient, 1)
        force_error, stress_error = errors.force, errors.scatter
    else:
        force_error, stress_error = affine(elements, gradient)
    softest, rigid = resisted(elements)
    return {"force_error": force_error, "stress_error": stress_error, "softest_mode": softest, "rigid_mode": rigid}


def affine(elements: Elements, gradient: np.ndarray) -> tuple[float, float]:
    """Return the relative force on inner nodes and the stress error of linear elements in an affine field."""
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
    """Return the softest strain mode and the stiffest rigid mode of any element over its stiffest strain mode.

    Nodes are scaled to a cube, since a flat element is soft in bending by its shape alone.
    """
    corners = elements.points[elements.cells]
    values = np.linalg.eigvalsh(elements.kind.stiffness(corners, elements.elasticity, elements.material))
    return float((values[:, 6] / values[:, -1]).min()), float((np.abs(values[:, 5]) / values[:, -1]).max())


def inner_nodes(elements: Elements) -> np.ndarray:
    """Return the nodes (k,) inside the body."""
    return np.setdiff1d(np.arange(len(elements.points)), boundary_facets(elements.cells))


def turns(parameters: Turns) -> dict[str, float]:
    """Return force and stress over the modulus after rotations alone; both are zero in theory."""
    material = laminate(parameters.poisson_ratio, parameters.orthotropy)
    term = nonlinear(body_of(parameters, material), material, finite=True)
    points, worst = term.elements.points, 0.0
    area = float(np.ptp(points, axis=0).max()) ** 2
    modulus = float(term.elements.elasticity.max())
    for turn in np.linspace(0.0, parameters.turns, 4 * parameters.turns + 1)[1:]:
        matrix = Rotation.from_rotvec(2 * np.pi * turn * AXIS).as_matrix()
        worst = np.maximum(worst, np.abs(force_of(term, points @ matrix.T - points)).max())
    stress = term.means(np.arange(len(term.numbers))).stress
    return {"force_error": float(worst) / (modulus * area), "stress_error": float(np.abs(stress).max()) / modulus}


def tension(parameters: Tension) -> dict[str, float]:
    """Return the stress error at the end of a uniaxial path of a metal with an exact solution.

    Axial strain s / E + p, lateral -nu s / E - p / 2, s = A + B p; logarithmic for finite kinematics with a rotation of
    1.4 rad on the path.
    """
    metal, law, plastic = LINEAR_HARDENING, LINEAR_HARDENING.plasticity, parameters.plastic_strain
    assert law is not None
    stress = law.A + law.B * plastic
    elastic = stress / metal.young_modulus
    strain = np.array([elastic + plastic, *[-metal.poisson_ratio * elastic - plastic / 2] * 2])
    turn = Rotation.from_rotvec([0.3, 1.1, -0.7])

    def path(s: float) -> np.ndarray:
        if parameters.kinematics == "small":
            return np.eye(3) + s * np.diag(strain)
        return (turn**s).as_matrix() @ np.diag(np.exp(s * strain))

    history = follow(
        nonlinear(body_of(parameters, metal), metal, parameters.kinematics == "finite"), path, parameters.steps
    )
    return judged(history, np.diag([stress, 0.0, 0.0]))


def compression(parameters: Compression) -> dict[str, float]:
    """Return the stress error of a confined body against C ln U."""
    material = laminate(parameters.poisson_ratio, parameters.orthotropy)
    term = nonlinear(body_of(parameters, material), material, finite=True)
    history = follow(term, lambda s: np.diag([1.0, 1.0, parameters.stretch**s]), parameters.steps)
    return judged(history, symmetric((np.log(parameters.stretch) * term.elements.elasticity[0, :, 2])[None])[0])


def judged(history: Followed, exact: np.ndarray) -> dict[str, float]:
    """Return the errors at the end of a path against its exact stress."""
    return {
        "stress_error": float(np.abs(history.stress - exact).max() / np.abs(exact).max()),
        "stress_scatter": history.scatter,
        "force_error": history.force,
    }


def follow(term: NonlinearElements, path: Callable[[float], np.ndarray], steps: int) -> Followed:
    """Deform the body by F(s), s from 0 to 1.

    Forces and stresses are relative to the modulus if that is larger, since it multiplies the round-off of U.
    """
    elements = term.elements
    points = elements.points
    for k in range(1, steps + 1):
        force = force_of(term, points @ (path(k / steps) - np.eye(3)).T)
    means = term.means(np.arange(len(term.numbers))).stress
    left = np.abs(force[inner_nodes(elements)]).max(initial=0.0) / np.abs(force).max()
    return Followed(symmetric(means[:1])[0], float(np.abs(means - means[0]).max() / np.abs(means).max()), float(left))


SIDE, HEIGHT, LAYERS = 3e-3, 2e-3, 3  # side, height [m] and layers of a block
PULL = 1e-3  # displacement of the upper face over the total height


def tied(parameters: Tied) -> dict[str, float]:
    """Return the largest and mean stress error, and the force error, of two tied blocks under tension.

    Without lateral contraction the stress is uniform whatever the moduli. Slave nodes return their forces to the master
    face with exact sum and moment, but not for each node: stresses near the tie have the error ``stress_error``, the
    total force has a far smaller one.
    """
    body = body_of_blocks(parameters)
    displacement, top = pulled(body)
    elements = body.elements
    moduli = elements.elasticity[elements.material]
    stress = element_stress(body.geometry.gradient, moduli, displacement[elements.cells])[:, 2]
    exact = PULL * 2 * HEIGHT / (HEIGHT / YOUNG + HEIGHT * parameters.contrast / YOUNG)
    force = stiffness_matrix(elements) @ displacement.ravel()
    volume = body.geometry.volume
    return {
        "stress_error": float(np.abs(stress / exact - 1.0).max()),
        "mean_stress_error": float(volume @ np.abs(stress / exact - 1.0) / volume.sum()),
        "pull_error": float(force.reshape(-1, 3)[top, 2].sum() / (exact * SIDE**2) - 1.0),
    }


def body_of_blocks(parameters: Tied) -> Body:
    """Return both blocks as one body with the program's own tie and its checks."""
    item = prepare(append(blocks(parameters)), "dns")["dns"]
    soft = laminate(0.0, young=YOUNG / parameters.contrast)
    rank_elements = make_rank_elements(
        distribute(MPI.COMM_SELF, item.mesh),
        item.tables,
        Materials(board=laminate(0.0), substrate=soft),
        parameters.element,
    )
    return make_body(MPI.COMM_SELF, rank_elements, item.tables, np.ones(len(rank_elements.steps)))


def blocks(parameters: Tied) -> list[MeshData]:
    """Return the lower, coarse block and the upper, tied one."""
    made = []
    for name, count, low in (
        ("board", parameters.coarse, 0.0),
        ("substrate", round(parameters.coarse * parameters.ratio), HEIGHT),
    ):
        flat = np.linspace(0.0, SIDE, count + 1)
        lines = (flat, flat, np.linspace(low, low + HEIGHT, LAYERS + 1))
        points, cells = distorted(parameters.element, lines, parameters.quality, parameters.seed, faces=False)
        role = "master@tie" if low == 0.0 else "slave@tie"
        made.append(mesh_of(points, cells, name, {role: on(2, HEIGHT)}))
    return made


def pulled(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacement (n, 3) of a body under tension, and the nodes (k,) of the pulled face.

    Nodes at x = 0, y = 0 and z = 0 keep that coordinate.
    """
    points = body.local.points
    count, tie = len(points), np.kron(body.tie.matrix(len(points)).toarray(), np.eye(3))
    stiffness = tie.T @ (stiffness_matrix(body.elements) @ tie)
    top = np.flatnonzero(points[:, 2] > 2 * HEIGHT - 1e-9)
    prescribed, is_prescribed = np.zeros((count, 3)), np.abs(points) < 1e-9
    prescribed[top, 2], is_prescribed[top, 2] = PULL * 2 * HEIGHT, True
    is_prescribed[body.tie.slave] = True
    free = ~is_prescribed.ravel()
    displacement = prescribed.ravel()
    displacement[free] = np.linalg.solve(stiffness[np.ix_(free, free)], -(stiffness @ displacement)[free])
    result = displacement.reshape(-1, 3)
    body.tie.spread(result)
    return result, top
