"""Results of the cooling stage: initial state of the shock, fields for ParaView, metrics and health checks."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import TENSOR_ORDER
from reflowshock.fem.division.tables import JointTables
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.dynamics.participant import explicit_motion
from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.fem.output.result import make_checks, quantity
from reflowshock.fem.output.watch_joints import STRESSES, JointWatch
from reflowshock.fem.problem.inputs import CoolingInput
from reflowshock.fem.setup.models import Model
from reflowshock.fem.statics.equilibrium import CONVERGED
from reflowshock.fem.statics.initial_state import Cooling

UNBALANCED_LIMIT = 1e-8  # unbalanced force at the start of the shock, relative to the force that suppresses expansion


@dataclass(frozen=True, slots=True)
class Convergence:
    """Convergence and cost of the cooling run.

    Attributes:
        residuals: Relative residual force after each iteration.
        shock_residual: Relative unbalanced force of the force terms of the shock.
        products: Number of products with the tangent.
        memory: Memory of the factor on all ranks [B].
        seconds: Run time [s].
    """

    residuals: tuple[float, ...]
    shock_residual: float
    products: int
    memory: float
    seconds: float


@dataclass(frozen=True, slots=True)
class CooledPackage:
    """Joined mesh of a package on its board, and its displacement by cooling."""

    whole: Whole
    cooling: Cooling


def write_cooling(
    world: MPI.Comm,
    request: CoolingInput,
    cooled: CooledPackage | None,
    model: Model[JointTables],
    convergence: Convergence,
) -> None:
    """Write ``cooling.npz``, ``residual.vtu`` and ``result.json`` on rank 0; collective.

    Args:
        world: Communicator of all ranks.
        request: Input of the run.
        cooled: Joined mesh and displacement on rank 0, None elsewhere.
        model: Model on this rank in the initial state of the shock.
        convergence: Convergence and cost of the run.
    """
    body, tables = model.body, model.tables
    yields = request.materials.solder.plasticity is not None
    joints = _joint_row(world, body, tables, yields)
    cells = world.gather((body.local.cell_numbers, _cell_fields(body, yields)))
    if cooled is None or cells is None:
        return
    whole, cooling = cooled.whole, cooled.cooling
    cooling.write(request.output / "cooling.npz")
    fields = {name: np.empty(len(whole.mesh.cells)) for name in cells[0][1]}
    for numbers, values in cells:
        for name, field in fields.items():
            field[numbers] = values[name]
    _write_fields(whole.mesh, cooling, fields, request)
    record = {
        "metrics": _metrics(whole.mesh, cooling, joints, convergence),
        "health": make_checks(
            {
                "cooling_force_residual": (convergence.residuals[-1], CONVERGED),
                "cooling_unbalanced_force": (convergence.shock_residual, UNBALANCED_LIMIT),
            }
        ),
        "residuals": convergence.residuals,
        "joints": {name: joints[name].tolist() for name in joints},
        "timings": {"cooling": convergence.seconds},
    }
    (request.output / "result.json").write_text(json.dumps(record, indent=1), encoding="utf-8")


def _joint_row(world: MPI.Comm, body: Body, tables: JointTables, yields: bool) -> dict[str, NDArray]:
    """Return names, stresses [Pa] and plastic strain of the joints; collective."""
    watch = JointWatch(tables, body, yields)
    sums, maxima = watch.sample(explicit_motion(body, [], 1.0))
    total, most = np.empty_like(sums), np.empty_like(maxima)
    world.Allreduce(sums, total)
    world.Allreduce(maxima, most, MPI.MAX)
    row = watch.row(total, most)
    columns = (*STRESSES, "von_mises_max", *(("plastic_strain_max",) if yields else ()))
    labels = {name: watch.labels[name] for name in ("joints", "joint_layer")}
    return labels | {name: np.asarray(row[name]) for name in columns}


def _cell_fields(body: Body, yields: bool) -> dict[str, NDArray[np.float64]]:
    """Return residual von Mises stress [Pa] and plastic strain of this rank's elements."""
    recovery = StressRecovery(body, np.arange(len(body.elements.cells)))
    rest = np.zeros((len(body.mass), 3))
    fields = {"von_mises": von_mises(recovery.stress(rest))}
    return fields | ({"plastic_strain": recovery.plastic_strain()} if yields else {})


def _write_fields(
    mesh: MeshData, cooling: Cooling, fields: dict[str, NDArray[np.float64]], request: CoolingInput
) -> None:
    """Write ``residual.vtu`` with the displacement since solidification [m] and the fields of the cells."""
    import meshio

    cells = [("hexahedron", mesh.cells[:, np.argsort(TENSOR_ORDER)])]
    data = {name: [values] for name, values in (fields | {"part": mesh.part}).items()}
    meshio.Mesh(mesh.points, cells, {"displacement": cooling.displacement}, data).write(request.output / "residual.vtu")


def _metrics(mesh: MeshData, cooling: Cooling, joints: dict[str, NDArray], convergence: Convergence) -> dict[str, Any]:
    """Return the metrics of cooling: warpage, convergence, cost and residual stress."""
    stress = np.maximum(*(joints[name] for name in STRESSES))
    worst = int(np.argmax(stress)) if len(stress) else 0
    lift = _corner_lift(mesh, mesh.points[:, 2])
    values = {
        "solidified_warpage": quantity(lift, "m"),
        "room_temperature_warpage": quantity(lift + _corner_lift(mesh, cooling.displacement[:, 2]), "m"),
        "cooling_iterations": quantity(len(convergence.residuals)),
        "cooling_products": quantity(convergence.products),
        "cooling_force_residual": quantity(convergence.residuals[-1]),
        "cooling_unbalanced_force": quantity(convergence.shock_residual),
        "cooling_memory": quantity(convergence.memory, "B"),
        "cooling_seconds": quantity(convergence.seconds, "s"),
    }
    if not len(stress):
        return values
    values |= {
        "residual_stress_largest": quantity(float(stress[worst]), "Pa"),
        "residual_stress_joint": quantity(str(joints["joints"][worst])),
    }
    plastic = joints.get("plastic_strain_max")
    return values if plastic is None else values | {"residual_plastic_strain": quantity(float(plastic.max()))}


def _corner_lift(mesh: MeshData, height: NDArray[np.float64]) -> float:
    """Return the mean height of the package corners above its centre [m], from nodal heights, shape (n,)."""
    nodes = mesh.facet_nodes("package_side")
    if not len(nodes):
        return 0.0
    x, y = mesh.points[nodes, 0], mesh.points[nodes, 1]
    corners = {int(np.argmax(a * x + b * y)) for a in (-1.0, 1.0) for b in (-1.0, 1.0)}
    reach = np.abs(mesh.points[nodes, :2]).sum(axis=1)
    outer = [k for k in corners if reach[k] > (1.0 - 1e-6) * reach.max()]
    return float(height[nodes[outer]].mean() - height[nodes[np.argmin(reach)]])
