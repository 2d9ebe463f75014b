"""Trial of a tie between faces that do not match: the constant stress of a pull across it."""

import numpy as np
from mpi4py import MPI

from reflowshock.fem.division.tables import prepare
from reflowshock.fem.elements.stress import element_stress
from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.model.assembly import make_body, make_pieces
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.trials.boxes import stiffness_matrix
from reflowshock.fem.trials.distortion import YOUNG, distorted, laminate
from reflowshock.fem.trials.grids import mesh_of, on
from reflowshock.fem.trials.parameters import Tied

SIDE, HEIGHT, LAYERS = 3e-3, 2e-3, 3  # of a block [m], and its layers of elements
PULL = 1e-3  # displacement of the upper face over the height of both blocks


def tied(given: Tied) -> dict[str, float]:
    """Return how far stresses are from the one that is the same everywhere, at worst and in the mean, and the force.

    Without lateral contraction two blocks that are pulled have one stress, whatever their moduli. Nodes that follow a
    face at points give its forces back so that their sum and moment are kept, but not those of each node: stresses next
    to the tie are wrong by what `stress_error` says, and the pull by far less.
    """
    body = body_of_blocks(given)
    displacement, top = pulled(body)
    elements = body.elements
    moduli = elements.elasticity[elements.material]
    stress = element_stress(body.geometry.gradient, moduli, displacement[elements.cells])[:, 2]
    exact = PULL * 2 * HEIGHT / (HEIGHT / YOUNG + HEIGHT * given.contrast / YOUNG)
    force = stiffness_matrix(elements) @ displacement.ravel()
    volume = body.geometry.volume
    return {
        "stress_error": float(np.abs(stress / exact - 1.0).max()),
        "mean_stress_error": float(volume @ np.abs(stress / exact - 1.0) / volume.sum()),
        "pull_error": float(force.reshape(-1, 3)[top, 2].sum() / (exact * SIDE**2) - 1.0),
    }


def body_of_blocks(given: Tied) -> Body:
    """Return both blocks as one body: the program's own tie, which it checks."""
    item = prepare(append(blocks(given)), "dns")["dns"]
    soft = laminate(0.0, young=YOUNG / given.contrast)
    pieces = make_pieces(
        distribute(MPI.COMM_SELF, item.mesh),
        item.tables,
        Materials(board=laminate(0.0), substrate=soft),
        given.element,
    )
    return make_body(MPI.COMM_SELF, pieces, item.tables, np.ones(len(pieces.steps)))


def blocks(given: Tied) -> list[MeshData]:
    """Return the lower, coarse block and the upper one, whose nodes follow the lower one's face."""
    made = []
    for name, count, low in (("board", given.coarse, 0.0), ("substrate", round(given.coarse * given.ratio), HEIGHT)):
        flat = np.linspace(0.0, SIDE, count + 1)
        lines = (flat, flat, np.linspace(low, low + HEIGHT, LAYERS + 1))
        points, cells = distorted(given.element, lines, given.quality, given.seed, faces=False)
        role = "master@tie" if low == 0.0 else "slave@tie"
        made.append(mesh_of(points, cells, name, {role: on(2, HEIGHT)}))
    return made


def pulled(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacement (n, 3) of a body whose upper face is pulled, and the nodes (k,) of that face.

    Nodes at x = 0, y = 0 and z = 0 keep that coordinate.
    """
    points = body.local.points
    count, tie = len(points), np.kron(body.tie.matrix(len(points)).toarray(), np.eye(3))
    stiffness = tie.T @ (stiffness_matrix(body.elements) @ tie)
    top = np.flatnonzero(points[:, 2] > 2 * HEIGHT - 1e-9)
    given, known = np.zeros((count, 3)), np.abs(points) < 1e-9
    given[top, 2], known[top, 2] = PULL * 2 * HEIGHT, True
    known[body.tie.slave] = True
    free = ~known.ravel()
    displacement = given.ravel()
    displacement[free] = np.linalg.solve(stiffness[np.ix_(free, free)], -(stiffness @ displacement)[free])
    result = displacement.reshape(-1, 3)
    body.tie.spread(result)
    return result, top
