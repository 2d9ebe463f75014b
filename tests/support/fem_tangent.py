"""Model pairs after rotation and flow: linear force terms with the tangent stiffness of the program's elements.

Each element follows its path into a state with the steps of its level; its stiffness is the tangent of one further
step. The window around this state has an amplification matrix like a linear one.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse
from mpi4py import MPI
from scipy.spatial.transform import Rotation

from reflowshock.cases.hard.trials.coupled import Coupled, models_of
from reflowshock.cases.hard.trials.pairs import FRACTION, Pair
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.forces.force import ForceTerm
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.step_levels import upper_blocks
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.parameters import JohnsonCook
from reflowshock.materials.roles import Materials

YIELD, HARDENING = 1e-3, 0.05  # yield stress and hardening modulus over Young's modulus
AXIS, ANGLE = np.array([1.0, 2.0, 0.5]) / np.linalg.norm([1.0, 2.0, 0.5]), 0.7  # [rad]
STRAIN = 3e-3 * np.array([[1.0, 0.6, 0.3], [0.6, -0.4, 0.5], [0.3, 0.5, -0.6]])  # strain at the end of the path
STEPS = 20  # steps of the path
SHIFT = 1e-7  # node shift for finite differences, over the mesh size


def yielding(pair: Pair) -> Materials:
    """Return the materials of a pair of coupled models, with plastic solder in its block."""
    materials = pair.materials()
    modulus = materials.solder.young_modulus
    law = JohnsonCook(A=YIELD * modulus, B=HARDENING * modulus)
    return materials.model_copy(update={"solder": materials.solder.model_copy(update={"plasticity": law})})


def on_path(points: np.ndarray, share: float) -> np.ndarray:
    """Return displacements on a path of uniform rotation and strain, shape (n, 3) [m].

    Args:
        points: Positions at rest, shape (n, 3) [m].
        share: Share of the path, 0 to 1.
    """
    rotation = Rotation.from_rotvec(share * ANGLE * AXIS).as_matrix()
    return points @ (rotation @ (np.eye(3) + share * STRAIN)).T - points


def tangent(term: ForceTerm, points: np.ndarray) -> AssembledElements:
    """Return linear elements with the tangent stiffness of a force term at the end of the path of ``on_path``.

    Args:
        term: Force term of nonlinear elements; its state moves to the end of the path.
        points: Nodes at rest, shape (n, 3) [m].
    """
    for step in range(1, STEPS + 1):
        term.add(on_path(points, step / STEPS), np.zeros_like(points))
    history = {name: values.copy() for name, values in term.history.items()}
    displacement, shift = on_path(points, 1.0 + 1.0 / STEPS), SHIFT * np.ptp(points)
    matrix = np.empty((points.size, points.size))
    for column in range(points.size):
        forces = []
        for sign in (1.0, -1.0):
            for name, values in history.items():
                term.history[name][...] = values
            moved, force = displacement.copy(), np.zeros_like(points)
            moved.reshape(-1)[column] += sign * shift
            term.add(moved, force)
            forces.append(force.ravel())
        matrix[:, column] = (forces[1] - forces[0]) / (2.0 * shift)
    blocks = scipy.sparse.csr_matrix(0.5 * (matrix + matrix.T)).tobsr((3, 3))
    blocks.sort_indices()
    return upper_blocks(blocks, len(points))


def flowing(body: Body) -> Body:
    """Return a body whose force terms are replaced by their tangents, as ``tangent`` returns them."""
    return replace(body, terms=[tangent(term, body.local.points) for term in body.terms])


def flowing_pair(pair: Pair, coupling: Coupling, fraction: float = FRACTION, formulation: str = "one_point") -> Coupled:
    """Return both coupled models of a pair in finite rotation with a block that flows plastically, linearised there.

    Args:
        pair: Macro and meso model: substeps, impedance ratio, shape.
        coupling: Settings of the coupling scheme.
        fraction: Time step over the critical step.
        formulation: Kind of element.
    """
    materials = yielding(pair)
    models = models_of(pair.mesh(), materials, coupling, fraction)
    response = ForceOptions("corotational", models.division.meso_step)
    bodies = {}
    for role, (rank_elements, tables) in models.parts.items():
        fresh_elements = make_rank_elements(rank_elements.local, tables, materials, formulation)
        body = make_body(MPI.COMM_SELF, fresh_elements, tables, np.ones(len(fresh_elements.steps)), response)
        bodies[role] = flowing(body)
    return Coupled(bodies, models.division.plan, scheme_of(models.division.scheme))
