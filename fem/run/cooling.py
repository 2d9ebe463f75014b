"""One run of cooling, from meshes to the state in which a shock begins: what every rank does, in order."""

import time
from dataclasses import replace

import numpy as np
import scipy.linalg
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.division.fine_joints import read_package
from reflowshock.fem.division.tables import JointTables, ModelInput, joined, model_inputs
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.dynamics.participant import explicit_motion
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.supports import SYMMETRY
from reflowshock.fem.model.assembly import ForceOptions, Pieces, make_body, make_pieces
from reflowshock.fem.model.body import Body
from reflowshock.fem.output.cooling_report import Unbalanced, write_cooling
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.parallel.whereabouts import HERE
from reflowshock.fem.problem.inputs import CoolingInput
from reflowshock.fem.statics.equilibrium import Equilibrium, Statics
from reflowshock.fem.statics.initial_state import Cooling, begun

RANK = 1e-9  # of the largest singular value: below it a rigid motion is not held


def run_cooling(world: MPI.Comm, request: CoolingInput) -> None:
    """Cool the whole model and write displacement, stress and result; collective over ``world``.

    The board lies free: only planes of symmetry hold it, and pins that bear nothing. So what it is screwed to
    afterwards holds it as it then is.

    Raises:
        AgreedError: Input or mesh that does not fit, or no equilibrium; on every rank.
    """
    start = time.perf_counter()
    pinned = agreed(world, lambda: pinned_package(request) if world.rank == 0 else None)
    tables: JointTables = world.bcast(pinned[1].tables if pinned else None)
    HERE.slow = "cools the model"
    pieces = distributed(world, pinned[1].mesh if pinned else None, tables, request)
    ones = np.ones(len(pieces.steps))
    body = make_body(world, pieces, tables, ones, ForceOptions())
    statics = Statics(world, body, pieces.materials, request.change)
    found, memory = statics.solve(), statics.memory
    statics.free()
    loaded = begun(body, pieces.materials, found.displacement, request.change, path=True)
    rest, seconds = unbalanced_force(world, loaded, statics.scale), time.perf_counter() - start
    unbalanced = Unbalanced(found.residuals, rest, found.products, memory, seconds)
    whole = pinned[0] if pinned else None
    displacement = whole_displacement(world, body, found, pinned)
    cooling = Cooling(whole.mesh.points, displacement, request.change) if whole and displacement is not None else None
    write_cooling(world, request, (whole, cooling), (loaded, tables), unbalanced)
    agreed(world, lambda: None)


Pinned = tuple[Whole, ModelInput[JointTables]]


def pinned_package(request: CoolingInput) -> Pinned:
    """Read all meshes as one model on its planes of symmetry, its other rigid motions pinned."""
    whole = joined(read_package(request))
    return whole, pinned(model_inputs(whole, "dns", SYMMETRY)["dns"])


def pinned(item: ModelInput[JointTables]) -> ModelInput[JointTables]:
    """Return a model whose rigid motions that nothing holds are pinned."""
    tables = item.tables
    held, usable = np.zeros((tables.nodes, 3), dtype=bool), np.zeros(tables.nodes, dtype=bool)
    held[tables.held_nodes] = tables.held
    usable[item.mesh.cells] = True
    usable[tables.tie.slave] = False
    held[pins(item.mesh.points, held, usable)] = True
    nodes = np.flatnonzero(held.any(axis=1))
    return replace(item, tables=replace(tables, held_nodes=nodes, held=held[nodes]))


def distributed(world: MPI.Comm, mesh: MeshData | None, tables: JointTables, request: CoolingInput) -> Pieces:
    """Give each rank its elements; collective."""
    dolfinx_api.compile_ahead(world, mesh.points[mesh.cells[0]] if mesh else None)
    local = distribute(world, mesh)
    formulation = request.shock.numerics.formulation
    return agreed(world, lambda: make_pieces(local, tables, request.materials, formulation))


def unbalanced_force(world: MPI.Comm, body: Body, scale: float) -> float:
    """Return what forces of the shock's own terms are out of balance at its beginning, over a scale [N]; collective."""
    motion = explicit_motion(body, [], 1.0)
    motion.update_force()
    own = body.free & body.shared.owned[:, None]
    square = world.allreduce(float(np.sum(motion.force[own] ** 2)))
    return float(np.sqrt(square)) / scale if scale > 0.0 else 0.0


def whole_displacement(
    world: MPI.Comm, body: Body, found: Equilibrium, pinned: Pinned | None
) -> NDArray[np.float64] | None:
    """Return the displacement ``(n, 3)`` [m] of all nodes of the whole mesh on rank 0, None elsewhere; collective."""
    owned = body.shared.owned
    parts = world.gather((body.local.nodes[owned], found.displacement[owned]))
    if parts is None or pinned is None:
        return None
    whole, item = pinned
    own, result = np.zeros((item.tables.nodes, 3)), np.zeros_like(whole.mesh.points)
    for nodes, values in parts:
        own[nodes] = values
    result[whole.mesh.cells[item.cells]] = own[item.mesh.cells]
    return result


def pins(
    points: NDArray[np.float64], held: NDArray[np.bool_], usable: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Choose components whose hold is statically determinate: a load in balance has no reaction there.

    Of the rigid motions that leave all held components at rest, the pivots of a QR factorisation are the components
    that tell them apart best.

    Args:
        points: ``(n, 3)`` [m].
        held: ``(n, 3)`` components that are held already.
        usable: ``(n,)`` nodes that may be pinned.

    Returns:
        Nodes and components, one for each rigid motion that is left.
    """
    motions = rigid_motions(points)
    _, values, right = np.linalg.svd(motions[held], full_matrices=True)
    rank = int(np.sum(values > RANK * len(points) ** 0.5)) if held.any() else 0
    left = np.where((usable[:, None] & ~held)[:, :, None], motions, 0.0).reshape(-1, 6) @ right[rank:].T
    _, _, pivots = scipy.linalg.qr(left.T, mode="economic", pivoting=True)
    chosen = np.sort(pivots[: 6 - rank])
    return chosen // 3, chosen % 3


def rigid_motions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return translations along and rotations about x, y, z ``(n, 3, 6)``; lengths in units of the body's size."""
    scaled = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    motions = np.zeros((len(points), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], scaled)
    return motions
