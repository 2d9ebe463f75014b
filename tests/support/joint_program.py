"""The program's own elements, ties and steps on the scene of ``joint_patch.py``, for comparison with the oracle.

The joint is a separate mesh, tied to matching faces of board and substrate or to boxes that ignore the joint. Section
forces sum the element forces on the slaves of either tie. Layer averages are weighted over the integration points of
fully integrated hexahedra.
"""

import json
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.elements.stress import von_mises
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.mesh.mesh import MeshData, append, without_unused_nodes
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.model.global_matrix import Equations, tied_stiffness
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.problem.inputs import INPUT, StructureInput
from reflowshock.fem.run.dynamics import make_participants
from reflowshock.fem.run.structure import StructureDynamics
from reflowshock.materials.parameters import JohnsonCook
from tests.support.fem_models import write_msh
from tests.support.joint_patch import Fineness, JointPatch, mesh_patch

Floats = NDArray[np.float64]
ENDS = {"foot": -1.0, "head": 1.0}
TOUCH = 1e-9  # m
NO_YIELD = JohnsonCook(A=1e15)
PARTS = ("board", "copper", "solder", "substrate")


def matching_mesh(patch: JointPatch, fineness: Fineness) -> MeshData:
    """Return the mesh of a patch with pads imprinted in board and substrate, in hexahedra with 8 nodes."""
    lattice = mesh_patch(patch, fineness, 1)
    hexahedra = {part: cells.astype(np.int32) for part, cells in lattice.cells.items()}
    return _assembled(patch, lattice.points, hexahedra)


def box_mesh(patch: JointPatch, fineness: Fineness, size: float, layers: tuple[int, int]) -> MeshData:
    """Return the mesh of a joint between non-matching boxes, to which it will be tied.

    Args:
        patch: Dimensions and materials.
        fineness: Numbers of elements and grid lines of the joint.
        size: Edge length of the boxes in plan [m].
        layers: Numbers of box layers of board and substrate.
    """
    lattice = mesh_patch(patch, fineness, 1)
    points, hexahedra = lattice.points, {part: lattice.cells[part].astype(np.int32) for part in ("copper", "solder")}
    x = np.linspace(-0.5, 0.5, round(patch.side / size) + 1) * patch.side
    top = patch.faces[-1]
    for part, low, high, count in (
        ("board", -patch.board, 0.0, layers[0]),
        ("substrate", top, top + patch.substrate, layers[1]),
    ):
        box_points, cells = grid(x, x[x > -1e-9], np.linspace(low, high, count + 1))
        hexahedra[part] = cells + np.int32(len(points))
        points = np.concatenate([points, box_points])
    return _assembled(patch, points, hexahedra)


def _assembled(patch: JointPatch, points: Floats, hexahedra: dict[str, NDArray[np.int32]]) -> MeshData:
    """Split a mesh into board, joint and substrate, with facet sets for ties, supports and motions."""
    half, top = 0.5 * patch.side, patch.faces[-1]
    plane = {"y_min": on(1, 0.0)}
    sets = {
        "board": {"board_held": on(0, -half), "board_moved": on(0, half), "master@foot": on(2, 0.0), **plane},
        "joint": {"slave@foot": on(2, 0.0), "slave@head": on(2, top), **plane},
        "substrate": {
            "substrate_held": lambda c: np.abs(np.abs(c[:, 0]) - half) < 1e-9,
            "master@head": on(2, top),
            **plane,
        },
    }
    meshes = []
    for name, facets in sets.items():
        parts = [part for part in hexahedra if part == name or (name == "joint" and part in ("copper", "solder"))]
        cells = np.concatenate([hexahedra[part] for part in parts])
        labels = np.repeat(np.array(parts, dtype=object), [len(hexahedra[part]) for part in parts])
        meshes.append(without_unused_nodes(mesh_of(points, cells, labels.astype(str), facets))[0])
    return append(meshes)


@dataclass(frozen=True, slots=True)
class Course:
    """Course of a run: the side of the board moves out and back as a haversine.

    Attributes:
        duration: Duration [s].
        yields: Whether the solder yields.
        mass_scaled: Parts with mass scaled to the step of the others.
    """

    duration: float = 0.2e-3
    yields: bool = False
    mass_scaled: tuple[str, ...] = ()


def request_of(patch: JointPatch, mesh: MeshData, course: Course, directory: Path) -> StructureInput:
    """Write mesh and motion of a patch, and return the input of an explicit run.

    Args:
        patch: Dimensions, materials and full motion.
        mesh: Mesh of the patch.
        course: Duration of the motion, and whether the solder yields.
        directory: Folder of the files and of the results.
    """
    write_msh(mesh, directory / "patch.msh")
    times = np.linspace(0.0, course.duration, 401)
    loads = {}
    for axis, full in zip("xz", patch.full_motion[[0, 2]], strict=True):
        speed = full * np.pi / course.duration * np.sin(2.0 * np.pi * times / course.duration)
        rows = "\n".join(f"{1e6 * time:.9g}, {value:.12g}" for time, value in zip(times, speed, strict=True))
        table = directory / f"{axis}.csv"
        table.write_text(f"time [us], velocity [m/s]\n{rows}\n")
        loads[f"move_{axis}"] = {"kind": "motion", "on": "board_moved", "component": axis, "table": str(table)}
    materials = dict(patch.materials)
    if not course.yields:
        materials["solder"] = materials["solder"].model_copy(update={"plasticity": NO_YIELD})
    held = {"hold": ["x", "y", "z"]}
    tables = {
        "mode": "structure",
        "mesh": str(directory / "patch.msh"),
        "output": str(directory),
        "solver": "explicit",
        "structure": {
            "length": patch.side,
            "width": patch.side,
            "cells": [1, 1],
            "layers": {part: {"material": f"{part}_here", "thickness": 1e-3} for part in PARTS},
        },
        "materials": {f"{part}_here": materials[part].model_dump(mode="json") for part in PARTS},
        "supports": {
            "board": {"on": "board_held", **held},
            "substrate": {"on": "substrate_held", **held},
            "side": {"on": "board_moved", "hold": ["y"]},
            "plane": {"on": "y_min", "hold": ["y"]},
        },
        "loads": loads,
        "dynamics": {
            "duration": course.duration,
            "numerics": {"history_samples": 200, "mass_scaled": course.mass_scaled},
        },
    }
    request = INPUT.validate_json(json.dumps(tables))
    assert isinstance(request, StructureInput)
    return request


class Measures:
    """Section resultants and layer averages of the joint in a body, with the names and signs of the oracle."""

    def __init__(self, patch: JointPatch, body: Body) -> None:
        """Find the slaves of both ends and the integration points of the solder layers."""
        self._patch, self._body = patch, body
        z = body.local.points[body.tie.slave][:, 2]
        self._ends = {"foot": z < 0.5 * patch.standoff, "head": z > 0.5 * patch.standoff}
        (self._solder,) = [term for term in body.terms if isinstance(term, NonlinearElements)]
        elements = self._solder.elements
        self._height = elements.points[elements.cells].mean(axis=1)[self._solder.lanes.element][..., 2]

    def take(self, slave_force: Floats) -> dict[str, float]:
        """Return the measures for the latest element forces on the slaves [N], shape (ns, 3)."""
        result, x = {}, self._body.local.points[self._body.tie.slave][:, 0]
        for end, sign in ENDS.items():
            force = -2.0 * sign * slave_force * self._ends[end][:, None]
            axial = float(force[:, 2].sum())
            result |= {f"axial@{end}": axial, f"shear@{end}": float(force[:, 0].sum())}
            result |= {f"moment@{end}": -float(x @ force[:, 2]), f"peel@{end}": axial / self._patch.pad_area}
        _, low, high, _ = self._patch.faces
        for depth in (12.5e-6, 25e-6, 50e-6):
            for end, bounds in (("foot", (low, low + depth)), ("head", (high - depth, high))):
                means = self._means(bounds)
                result |= {f"{name}@{end}:{1e6 * depth:g}um": value for name, value in means.items()}
        return result

    def _means(self, bounds: tuple[float, float]) -> dict[str, float]:
        blocks, lanes = self._solder.blocks, self._solder.lanes
        chosen = lanes.valid & (self._height > bounds[0]) & (self._height < bounds[1])
        state = lanes.view(blocks.state)[chosen]
        weight = lanes.view(blocks.weight)[blocks.pattern][chosen][..., 0]
        mises = von_mises(state[..., :6].reshape(-1, 6)).reshape(weight.shape)
        return {
            "von_mises": float(np.average(mises, weights=weight)),
            "plastic_strain": float(np.average(state[..., 6], weights=weight)),
            "plastic_work": float(blocks.plastic_work[chosen].sum() / weight.sum()),
        }


class ProgramPatch:
    """Explicit run of a patch by the program, step by step."""

    def __init__(self, patch: JointPatch, mesh: MeshData, course: Course) -> None:
        """Build the run at rest."""
        self.patch = patch
        with tempfile.TemporaryDirectory() as directory:
            problem = StructureDynamics.read(MPI.COMM_SELF, request_of(patch, mesh, course, Path(directory)))
            comms = Communicators(MPI.COMM_SELF, problem.place(MPI.COMM_SELF).placement)
            models, steps = problem.build(comms, {})
        self.participant = make_participants(comms, problem, models, steps).participants["structure"]
        self.plan, self.body = self.participant.plan, models["structure"].body
        self.motion: Motion = self.participant.motion
        self.measures = Measures(patch, self.body)

    def run(self, samples: int, share: float = 1.0) -> list[dict[str, float]]:
        """Run a share of the course; return about ``samples`` measures."""
        windows, history = round(share * self.plan.windows), []
        stride = max(1, windows // samples)
        for window in range(1, windows + 1):
            self.participant.begin_window()
            self.participant.finish_window()
            if window % stride == 0 or window == windows:
                history.append({"time": self.motion.time, **self.measures.take(self.motion.slave_force)})
        return history

    def at_rest(self) -> dict[str, float]:
        """Return the measures of linear elastic equilibrium at the full motion."""
        body, x, z = self.body, self.body.local.points[:, 0], self.body.local.points[:, 2]
        moved = (z < TOUCH) & (np.abs(x - 0.5 * self.patch.side) < TOUCH)
        displacement = moved[:, None] * self.patch.full_motion
        equations = Equations.of(MPI.COMM_SELF, replace(body, free=body.free & ~moved[:, None]))
        right = equations.vector(-(tied_stiffness(body) @ displacement.ravel()).reshape(-1, 3))
        factor, solution, change = Factorisation(equations.stiffness()), right.duplicate(), np.empty_like(displacement)
        factor.solve(right, solution)
        equations.spread(solution, change)
        factor.free()
        displacement += change
        force = np.zeros_like(displacement)
        for term in body.terms:
            term.add(displacement, force)
        return self.measures.take(force[body.tie.slave])
