"""Models on one rank from meshes in memory, through the program's own chain."""

import numpy as np
from mpi4py import MPI

from fem.body import Body, Pieces, make_body, make_pieces
from fem.local_mesh import distribute
from fem.materials.library import FR4
from fem.materials.parameters import Isotropic
from fem.materials.roles import Materials
from fem.mesh import MeshData
from fem.motion import Motion
from fem.scene import Tables, prepare

STEEL = Isotropic(density=8000.0, young_modulus=200e9, poisson_ratio=0.0)


def dns_pieces(mesh: MeshData, materials: Materials) -> tuple[Pieces, Tables]:
    """Return the elements of all parts on one rank."""
    item = prepare(mesh, "dns")["dns"]
    return make_pieces(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials), item.tables


def dns_body(mesh: MeshData, board=FR4, materials: Materials | None = None) -> tuple[Body, float]:
    """Return a body of all parts, and its smallest element critical step [s]; ``materials`` go before ``board``."""
    pieces, tables = dns_pieces(mesh, materials or Materials(board=board))
    return make_body(MPI.COMM_SELF, pieces, tables, np.ones(len(pieces.steps))), float(pieces.steps.min())


def motion_of(body: Body, step: float, loads=(), held=()) -> Motion:
    """Return the motion of a body from rest."""
    return Motion(body, loads, step, np.array(held, np.int32), np.zeros(len(body.mass)))


def dense_stiffness(body: Body) -> np.ndarray:
    """Return the stiffness of a body, (3n, 3n), column by column from its own force terms, tie included."""
    count = len(body.mass)
    columns = np.empty((3 * count, 3 * count))
    for k in range(3 * count):
        displacement, force = np.zeros((count, 3)), np.zeros((count, 3))
        displacement.flat[k] = 1.0
        body.tie.spread(displacement)
        for term in body.terms:
            term.add(displacement, force)
        body.tie.gather(force)
        columns[:, k] = -force.ravel()
    return columns
