"""Elastic package and board while the solder is liquid: pad motion under temperature, weight and solder wrenches.

The problem is linear, so a state is a sum of precomputed fields (for one kelvin, the weight, a force at each moved die
corner), the response to the wrenches, and free rigid-body motions of the package.

The board rests on its holes and sags between them under its weight. Heights count from the mean height of its pads, and
the resultant push of the solder on the board is supported directly below the pads, in equal parts. Without this support
the board would deflect as a whole, much more than it bends under the package (H 4.3, 200 mm between the holes: 0.5 mm);
that would only shift the zero and make the iteration with the solder diverge. In equilibrium the push is the package's
weight, unless a tool moves the package.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.model.factorisation import FactorCost
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.statics.pads import pad_matrix
from reflowshock.fem.statics.state import Assembly, HeatedState, RigidModes, check_loads
from reflowshock.fem.statics.thermal_tables import ThermalTables, connect_board, find_die_corners, thermal_tables
from reflowshock.fem.statics.thermoelastic import Thermoelastic


@dataclass(frozen=True, slots=True)
class Corners:
    """Die corners with prescribed height on one rank; none if the package floats.

    Attributes:
        model: Thermoelastic model.
        nodes: Local node of each corner, -1 if another rank owns it, shape (c,).
        fields: Displacement for a unit upward force at each corner, shape (c, n, 3) [m/N].
        motions: Rigid-body motions of the package that the corners fix, shape (k, n, 3).
        held: Whether the corners fix each rigid-body motion of the package, shape (m,).
        matrix: Saddle-point matrix of corner compliance and fixed motions, shape (c + k, c + k).
    """

    model: Thermoelastic
    nodes: NDArray[np.int32]
    fields: NDArray[np.float64]
    motions: NDArray[np.float64]
    held: NDArray[np.bool_]
    matrix: NDArray[np.float64]

    @classmethod
    def of(cls, model: Thermoelastic, nodes: NDArray[np.int32], package: NDArray[np.float64]) -> "Corners":
        """Compute the response to corner forces; collective.

        Args:
            model: Thermoelastic model.
            nodes: Local node of each corner, -1 if it is not on this rank, shape (c,).
            package: Free rigid-body motions of the package, shape (m, n, 3).
        """
        nodes = np.where((nodes >= 0) & model.body.shared.owned[nodes], nodes, -1)
        fields = np.array([model.displacement(push) for push in _pushes(nodes, package.shape[1])])
        fields = fields.reshape(len(nodes), *package.shape[1:])
        corners = cls(model, nodes, fields, package, np.zeros(len(package), bool), np.empty((0, 0)))
        lifts = np.array([corners.heights(field) for field in package]).reshape(len(package), len(nodes)).T
        held = np.abs(lifts).max(axis=0, initial=0.0) > 0.0
        held_lifts = lifts[:, held]
        compliance = np.array([corners.heights(field) for field in fields]).reshape(len(nodes), len(nodes)).T
        zeros = np.zeros((held_lifts.shape[1], held_lifts.shape[1]))
        matrix = np.block([[compliance, held_lifts], [held_lifts.T, zeros]])
        return cls(model, nodes, fields, package[held], held, matrix)

    def heights(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the upward displacement of the corners, shape (c,), in a displacement, shape (n, 3); collective."""
        mine = np.where(self.nodes >= 0, displacement[self.nodes, 2], 0.0)
        return np.asarray(self.model.space.comm.allreduce(mine))

    def move(
        self, displacement: NDArray[np.float64], height: float, load: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Move the corners to a height; collective.

        Args:
            displacement: Displacement without corner forces, shape (n, 3) [m].
            height: Upward displacement of the corners [m].
            load: Forces along the rigid-body motions of the package, shape (m,) [N, N m].

        Returns:
            Displacement with the corner forces, shape (n, 3) [m], and the corner forces, shape (c,) [N].
        """
        right_side = np.concatenate([height - self.heights(displacement), -load[self.held]])
        force, rigid = np.split(np.linalg.solve(self.matrix, right_side), [len(self.nodes)])
        moved = displacement + np.tensordot(force, self.fields, 1) + np.tensordot(rigid, self.motions, 1)
        return moved, force


def _pushes(nodes: NDArray[np.int32], count: int) -> NDArray[np.float64]:
    """Return an upward force of 1 N at each node that this rank owns, shape (c, count, 3)."""
    pushes = np.zeros((len(nodes), count, 3))
    mine = np.flatnonzero(nodes >= 0)
    pushes[mine, nodes[mine], 2] = 1.0
    return pushes


@dataclass(frozen=True, slots=True)
class PlacedPads:
    """Tables of the mesh that rank 0 computes for all ranks.

    Attributes:
        points: Nodes of the mesh, shape (n, 3) [m].
        tables: Parts, supports and free rigid-body motions.
        pads: Matrix P of ``pads.pad_matrix``.
        corners: Nodes of the moved die corners, shape (c,).
    """

    points: NDArray[np.float64]
    tables: ThermalTables
    pads: scipy.sparse.csr_matrix
    corners: NDArray[np.intp]


class ThermalStructure:
    """Elastic package and board, factored once, as a ``HeatedStructure``.

    Attributes:
        points: Nodes in the undeformed state, shape (n, 3) [m].
        package: Whether a node belongs to the package, shape (n,).
        rigid_modes: Free rigid-body motions of the package.
    """

    def __init__(self, comm: MPI.Comm, placed: PlacedPads, mesh: MeshData | None, assembly: Assembly) -> None:
        """Factor and compute the load-independent fields; collective; use ``build`` instead."""
        self._comm, self._thermal = comm, assembly.thermal
        self.points, self.package = placed.points, placed.tables.package
        self._model = Thermoelastic(comm, mesh, placed.tables, assembly.materials)
        local, owned = self._model.body.local, self._model.body.shared.owned
        self._nodes, self._owned = local.nodes, owned
        self._pads = placed.pads[:, (3 * local.nodes[:, None] + np.arange(3)).ravel()]
        self._package = self._model.space.fields[len(placed.tables.motions[0].numbers) :]
        weight = self._model.weight(assembly.gravity)
        self._weight = self._load(weight)
        self._kelvin, self._sag = (self._levelled(force) for force in (self._model.expansion, weight))
        self._corners = Corners.of(self._model, local.locate(placed.corners), self._package)
        self._free = self._package[~self._corners.held]
        names = np.array(placed.tables.motions[1].names)[~self._corners.held]
        motion = [self._motion(field) for field in self._free]
        shape = (len(names), *self._motion(weight).shape)
        self.rigid_modes = RigidModes(
            tuple(map(str, names)), np.reshape(motion, shape), self._weight[~self._corners.held]
        )

    @classmethod
    def build(cls, comm: MPI.Comm, assembly: Assembly) -> "ThermalStructure":
        """Read board and package and factor their stiffness; collective.

        Raises:
            AgreedError: The mesh does not fit the pads or the materials, or memory ran out; on every rank.
        """
        mesh = agreed(comm, lambda: connect_board(read_mesh(assembly.mesh)) if comm.rank == 0 else None)
        placed = agreed(comm, lambda: _tabulate(mesh, assembly) if mesh else None)
        return cls(comm, comm.bcast(placed), mesh, assembly)

    @property
    def cost(self) -> FactorCost:
        """Cost of the factorisation."""
        return self._model.cost

    @property
    def equations(self) -> int:
        """Number of equations."""
        return self._model.equations

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state at a temperature [K], see ``HeatedStructure.solve``; collective.

        Raises:
            ValueError: Wrenches or rigid motions have a wrong shape or are not finite.
        """
        check_loads(self.rigid_modes, wrenches, rigid)
        displacement = (temperature - self._thermal.reference) * self._kelvin + self._sag
        load = self._weight
        if self._thermal.effects.solder_force != "off" and np.any(wrenches):
            force = (self._pads.T @ _with_board_support(wrenches).ravel()).reshape(-1, 3)
            displacement += self._levelled(force)
            load = load + self._load(force)
        displacement, corner_force = self._corners.move(displacement, corner, load)
        displacement += np.tensordot(rigid, self._free, 1)
        return HeatedState(self._gathered(displacement), self._motion(displacement), corner_force)

    def _levelled(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement under nodal forces, relative to the mean height of the board's pads; collective."""
        displacement = self._model.displacement(force)
        displacement[:, 2] -= self._motion(displacement)[:, 0, 2].mean() * ~self.package[self._nodes]
        return displacement

    def _load(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the forces along all rigid-body motions of the package; collective."""
        work = self._model.space.work(force)
        return work[len(work) - len(self._package) :]

    def _motion(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the motion of the pads, shape (joints, 2, 6); collective."""
        mine = self._pads @ np.where(self._owned[:, None], displacement, 0.0).ravel()
        return np.asarray(self._comm.allreduce(mine)).reshape(-1, 2, 6)

    def _gathered(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement at all nodes of the mesh, shape (n, 3) [m]; collective."""
        whole = np.zeros_like(self.points)
        whole[self._nodes[self._owned]] = displacement[self._owned]
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, whole)
        return whole


def _with_board_support(wrenches: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return wrenches, shape (joints, 2, 6), plus the supporting force below the board's pads."""
    supported = wrenches.copy()
    supported[:, 0, 2] -= wrenches[:, 0, 2].mean()
    return supported


def _tabulate(mesh: MeshData, assembly: Assembly) -> PlacedPads:
    """Determine supports, pads and corners of a mesh.

    Raises:
        MeshError: Board, package, die or a pad side is missing, or a pad extends beyond its side.
    """
    centre = assembly.pads.centres[:, 1].mean(axis=0)
    corners = find_die_corners(mesh) if assembly.thermal.package == "moved" else np.empty(0, np.intp)
    return PlacedPads(mesh.points, thermal_tables(mesh, centre), pad_matrix(mesh, assembly.pads), corners)
