"""Run of the cooling stage, from meshes to the stressed initial state of a shock."""

import time
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.division.fine_joints import read_package
from reflowshock.fem.division.tables import JointTables, ModelInput, join_meshes, model_inputs
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.dynamics.participant import explicit_motion
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.supports import SYMMETRY
from reflowshock.fem.model.assembly import ForceOptions, RankElements, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.output.cooling_report import Convergence, CooledPackage, write_cooling
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.parallel.waiting import wait_for_all
from reflowshock.fem.problem.inputs import CoolingInput
from reflowshock.fem.setup.models import Model
from reflowshock.fem.statics.equilibrium import Equilibrium, Statics
from reflowshock.fem.statics.initial_state import Cooling, with_initial_stress

RANK = 1e-9  # relative singular value below which a rigid-body motion is unconstrained


def run_cooling(world: MPI.Comm, request: CoolingInput) -> None:
    """Cool the undivided model and write its residual stress; collective over ``world``.

    The output folder receives ``cooling.npz`` (displacement and stress), ``residual.vtu`` and ``result.json``. Only
    symmetry planes and statically determinate pins, which have no reaction, support the board while it cools. The
    supports of the drop test then fix it in its deformed shape.

    Args:
        world: Communicator of all ranks.
        request: Input with meshes, materials, temperatures and output folder.

    Raises:
        AgreedError: The input or a mesh does not fit, or equilibrium is not reached; on every rank.
    """
    start = time.perf_counter()
    package = agreed(world, lambda: _read_pinned_package(request) if world.rank == 0 else None)
    tables: JointTables = world.bcast(package.model.tables if package else None)
    ACTIVITY.slow = "cools the model"
    rank_elements = _distribute_model(world, package.model.mesh if package else None, tables, request)
    ones = np.ones(len(rank_elements.steps))
    body = make_body(world, rank_elements, tables, ones, ForceOptions())
    statics = Statics(world, body, rank_elements.materials, request.change)
    equilibrium, memory = statics.solve(), statics.memory
    statics.free()
    loaded = with_initial_stress(body, rank_elements.materials, equilibrium.displacement, request.change, path=True)
    residual, seconds = _measure_unbalanced_force(world, loaded, statics.scale), time.perf_counter() - start
    convergence = Convergence(equilibrium.residuals, residual, equilibrium.products, memory, seconds)
    displacement = _gather_displacement(world, body, equilibrium, package)
    cooled = None
    if package and displacement is not None:
        cooled = CooledPackage(package.whole, Cooling(package.whole.mesh.points, displacement, request.change))
    write_cooling(world, request, cooled, Model(tables, loaded), convergence)
    agreed(world, lambda: None)


@dataclass(frozen=True, slots=True)
class PinnedPackage:
    """Package on its board before cooling.

    Attributes:
        whole: Joined mesh of board, packages and joints.
        model: Mesh and tables of the single model whose rigid-body motions are fixed.
    """

    whole: Whole
    model: ModelInput[JointTables]


def _read_pinned_package(request: CoolingInput) -> PinnedPackage:
    """Read all meshes as one model on its symmetry planes, with all other rigid-body motions pinned."""
    whole = join_meshes(read_package(request))
    return PinnedPackage(whole, add_pins(model_inputs(whole, "dns", SYMMETRY)["dns"]))


def add_pins(item: ModelInput[JointTables]) -> ModelInput[JointTables]:
    """Return a model with pins (fixed displacement components) against every unconstrained rigid-body motion.

    The pins are statically determinate, so that a load in equilibrium has no reaction at them.

    Args:
        item: Mesh and tables of one model before distribution; its mesh is unchanged.

    Returns:
        The same mesh with tables that have more fixed components.
    """
    tables = item.tables
    held, usable = np.zeros((tables.nodes, 3), dtype=bool), np.zeros(tables.nodes, dtype=bool)
    held[tables.held_nodes] = tables.held
    usable[item.mesh.cells] = True
    usable[tables.tie.slave] = False
    held[choose_pins(item.mesh.points, held, usable)] = True
    nodes = np.flatnonzero(held.any(axis=1))
    return replace(item, tables=replace(tables, held_nodes=nodes, held=held[nodes]))


def _distribute_model(
    world: MPI.Comm, mesh: MeshData | None, tables: JointTables, request: CoolingInput
) -> RankElements:
    """Distribute the mesh and assign materials to the elements of each rank; collective."""
    dolfinx_api.compile_ahead(mesh.points[mesh.cells[0]] if mesh else None)
    wait_for_all(world)
    local = distribute(world, mesh)
    formulation = request.shock.numerics.formulation
    return agreed(world, lambda: make_rank_elements(local, tables, request.materials, formulation))


def _measure_unbalanced_force(world: MPI.Comm, body: Body, scale: float) -> float:
    """Return the norm of the unbalanced force at the start of the shock, relative to ``scale`` [N]; collective."""
    motion = explicit_motion(body, [], 1.0)
    motion.update_force()
    owned = body.free & body.shared.owned[:, None]
    square = world.allreduce(float(np.sum(motion.force[owned] ** 2)))
    return float(np.sqrt(square)) / scale if scale > 0.0 else 0.0


def _gather_displacement(
    world: MPI.Comm, body: Body, equilibrium: Equilibrium, package: PinnedPackage | None
) -> NDArray[np.float64] | None:
    """Return the displacement of all nodes of the joined mesh, shape (n, 3) [m], on rank 0, else None; collective."""
    owned = body.shared.owned
    parts = world.gather((body.local.nodes[owned], equilibrium.displacement[owned]))
    if parts is None or package is None:
        return None
    whole, model = package.whole, package.model
    at_model_nodes, result = np.zeros((model.tables.nodes, 3)), np.zeros_like(whole.mesh.points)
    for nodes, values in parts:
        at_model_nodes[nodes] = values
    result[whole.mesh.cells[model.cells]] = at_model_nodes[model.mesh.cells]
    return result


def choose_pins(
    points: NDArray[np.float64], held: NDArray[np.bool_], usable: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Choose displacement components that make the support statically determinate.

    A load in equilibrium has no reaction at these pins. They are the pivots of a QR factorisation of the rigid-body
    motions that leave all fixed components at rest.

    Args:
        points: Nodes, shape (n, 3) [m].
        held: Whether each component is already fixed, shape (n, 3).
        usable: Whether each node may be pinned, shape (n,).

    Returns:
        Node and component (0, 1, 2 for x, y, z) of each pin, shape (k,) each, with one pin for each unconstrained
        rigid-body motion; empty if there is none.
    """
    motions = rigid_motions(points)
    _, values, right = np.linalg.svd(motions[held], full_matrices=True)
    rank = int(np.sum(values > RANK * len(points) ** 0.5)) if held.any() else 0
    unconstrained = np.where((usable[:, None] & ~held)[:, :, None], motions, 0.0).reshape(-1, 6) @ right[rank:].T
    _, _, pivots = scipy.linalg.qr(unconstrained.T, mode="economic", pivoting=True)
    chosen = np.sort(pivots[: 6 - rank])
    return chosen // 3, chosen % 3


def rigid_motions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return translations along and rotations about x, y, z as nodal displacements, shape (n, 3, 6).

    The last axis has the three translations first. Lengths are in units of the body's size, so that all are alike.

    Args:
        points: Nodes, shape (n, 3) [m].
    """
    scaled = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    motions = np.zeros((len(points), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], scaled)
    return motions
