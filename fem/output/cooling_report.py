"""What a run of cooling leaves: the state for the shock, its fields for ParaView, metrics and health."""

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
from reflowshock.fem.output.result import checked, quantity
from reflowshock.fem.output.watch_joints import STRESSES, JointWatch
from reflowshock.fem.problem.inputs import CoolingInput
from reflowshock.fem.statics.equilibrium import CONVERGED
from reflowshock.fem.statics.initial_state import Cooling

UNBALANCED_LIMIT = 1e-8  # of the shock's own force terms, over the forces that hold expansion back


@dataclass(frozen=True, slots=True)
class Unbalanced:
    """How well forces balance: after each iteration, by the shock's own terms; products, memory [B], seconds."""

    residuals: tuple[float, ...]
    of_shock: float
    products: int
    memory: float
    seconds: float


def write_cooling(
    world: MPI.Comm,
    request: CoolingInput,
    cooled: tuple[Whole | None, Cooling | None],
    model: tuple[Body, JointTables],
    unbalanced: Unbalanced,
) -> None:
    """Write ``cooling.npz``, ``residual.vtu`` and ``result.json`` on rank 0; collective.

    Args:
        world: All ranks.
        request: The input.
        cooled: Whole mesh and what was found, on rank 0.
        model: Body of this rank in the state of the shock's beginning, and its tables.
        unbalanced: How well forces balance.
    """
    body, tables = model
    yields = request.materials.solder.plasticity is not None
    joints = joint_row(world, body, tables, yields)
    cells = world.gather((body.local.cell_numbers, cell_fields(body, yields)))
    whole, cooling = cooled
    if whole is None or cooling is None or cells is None:
        return
    cooling.write(request.output / "cooling.npz")
    fields = {name: np.empty(len(whole.mesh.cells)) for name in cells[0][1]}
    for numbers, values in cells:
        for name, field in fields.items():
            field[numbers] = values[name]
    write_fields(whole.mesh, cooling, fields, request)
    record = {
        "metrics": metrics(whole.mesh, cooling, joints, unbalanced),
        "health": checked(
            {
                "cooling_force_residual": (unbalanced.residuals[-1], CONVERGED),
                "cooling_unbalanced_force": (unbalanced.of_shock, UNBALANCED_LIMIT),
            }
        ),
        "residuals": unbalanced.residuals,
        "joints": {name: joints[name].tolist() for name in joints},
        "timings": {"cooling": unbalanced.seconds},
    }
    (request.output / "result.json").write_text(json.dumps(record, indent=1), encoding="utf-8")


def joint_row(world: MPI.Comm, body: Body, tables: JointTables, yields: bool) -> dict[str, NDArray]:
    """Return names of joints, and the stresses [Pa] and plastic strain of each; collective."""
    watch = JointWatch(tables, body, yields)
    sums, maxima = watch.sample(explicit_motion(body, [], 1.0))
    total, most = np.empty_like(sums), np.empty_like(maxima)
    world.Allreduce(sums, total)
    world.Allreduce(maxima, most, MPI.MAX)
    row = watch.row(total, most)
    kept = (*STRESSES, "von_mises_max", *(("plastic_strain_max",) if yields else ()))
    labels = {name: watch.labels[name] for name in ("joints", "joint_layer")}
    return labels | {name: np.asarray(row[name]) for name in kept}


def cell_fields(body: Body, yields: bool) -> dict[str, NDArray[np.float64]]:
    """Return the residual stress of this rank's elements."""
    recovery = StressRecovery(body, np.arange(len(body.elements.cells)))
    rest = np.zeros((len(body.mass), 3))
    fields = {"von_mises": von_mises(recovery.stress(rest))}
    return fields | ({"plastic_strain": recovery.plastic_strain()} if yields else {})


def write_fields(
    mesh: MeshData, cooling: Cooling, fields: dict[str, NDArray[np.float64]], request: CoolingInput
) -> None:
    """Write ``residual.vtu``: displacement since solidification, and per cell stress [Pa], plastic strain, part."""
    import meshio

    cells = [("hexahedron", mesh.cells[:, np.argsort(TENSOR_ORDER)])]
    data = {name: [values] for name, values in (fields | {"part": mesh.part}).items()}
    meshio.Mesh(mesh.points, cells, {"displacement": cooling.displacement}, data).write(request.output / "residual.vtu")


def metrics(mesh: MeshData, cooling: Cooling, joints: dict[str, NDArray], unbalanced: Unbalanced) -> dict[str, Any]:
    """Return what cooling did, and what it took."""
    stress = np.maximum(*(joints[name] for name in STRESSES))
    worst = int(np.argmax(stress)) if len(stress) else 0
    lift = corner_lift(mesh, mesh.points[:, 2])
    found = {
        "solidified_warpage": quantity(lift, "m"),
        "room_temperature_warpage": quantity(lift + corner_lift(mesh, cooling.displacement[:, 2]), "m"),
        "cooling_iterations": quantity(len(unbalanced.residuals)),
        "cooling_products": quantity(unbalanced.products),
        "cooling_force_residual": quantity(unbalanced.residuals[-1]),
        "cooling_unbalanced_force": quantity(unbalanced.of_shock),
        "cooling_memory": quantity(unbalanced.memory, "B"),
        "cooling_seconds": quantity(unbalanced.seconds, "s"),
    }
    if not len(stress):
        return found
    found |= {
        "residual_stress_largest": quantity(float(stress[worst]), "Pa"),
        "residual_stress_joint": quantity(str(joints["joints"][worst])),
    }
    plastic = joints.get("plastic_strain_max")
    return found if plastic is None else found | {"residual_plastic_strain": quantity(float(plastic.max()))}


def corner_lift(mesh: MeshData, height: NDArray[np.float64]) -> float:
    """Return the mean height [m] of the corners of the package's underside over its centre; ``height (n,)``."""
    nodes = mesh.facet_nodes("package_side")
    if not len(nodes):
        return 0.0
    x, y = mesh.points[nodes, 0], mesh.points[nodes, 1]
    corners = {int(np.argmax(a * x + b * y)) for a in (-1.0, 1.0) for b in (-1.0, 1.0)}
    reach = np.abs(mesh.points[nodes, :2]).sum(axis=1)
    outer = [k for k in corners if reach[k] > (1.0 - 1e-6) * reach.max()]
    return float(height[nodes[outer]].mean() - height[nodes[np.argmin(reach)]])
