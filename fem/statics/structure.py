"""Package and board while the solder is liquid: how temperature, weight and the solder's wrenches move the pads.

Everything is linear in the loads, so a state is a sum of fields that are found once (a kelvin, the weight, a force at
each corner of the die that is moved), the answer to the wrenches, and free rigid motions of the package.

The board rests on its holes and sags between them under its weight. Heights count from the mean height of its pads, and
what the solder pushes on the board in all is borne right there, in equal parts: a board that gave way as a whole, far
softer than it bends under the package, would only shift the zero (H 4.3, 200 mm between the holes: by 0.5 mm) and make
the exchange with the solder diverge. In balance that push is the package's weight, unless a tool moves the package.
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
from reflowshock.fem.statics.thermal_tables import ThermalTables, connected, die_corners, thermal_tables
from reflowshock.fem.statics.thermoelastic import Thermoelastic


@dataclass(frozen=True, slots=True)
class Corners:
    """Moved corners of a model on one rank; none where the package floats.

    Attributes:
        model: The model.
        nodes: ``(c,)`` local node of each corner, -1 where another rank owns it.
        fields: ``(c, n, 3)`` [m/N] displacement for a force upwards at each.
        motions: ``(k, n, 3)`` rigid motions of the package that the corners hold.
        held: ``(m,)`` whether they hold each of the package's motions.
        matrix: ``(c + k, c + k)`` as above.
    """

    model: Thermoelastic
    nodes: NDArray[np.int32]
    fields: NDArray[np.float64]
    motions: NDArray[np.float64]
    held: NDArray[np.bool_]
    matrix: NDArray[np.float64]

    @classmethod
    def of(cls, model: Thermoelastic, nodes: NDArray[np.int32], package: NDArray[np.float64]) -> "Corners":
        """Find what forces at corners do; collective.

        Args:
            model: The model.
            nodes: ``(c,)`` local node of each corner, -1 where this rank does not have it.
            package: ``(m, n, 3)`` free rigid motions of the package.
        """
        nodes = np.where((nodes >= 0) & model.body.shared.owned[nodes], nodes, -1)
        fields = np.array([model.displacement(push) for push in _pushes(nodes, package.shape[1])])
        fields = fields.reshape(len(nodes), *package.shape[1:])
        found = cls(model, nodes, fields, package, np.zeros(len(package), bool), np.empty((0, 0)))
        turned = np.array([found.heights(field) for field in package]).reshape(len(package), len(nodes)).T
        held = np.abs(turned).max(axis=0, initial=0.0) > 0.0
        across = turned[:, held]
        compliance = np.array([found.heights(field) for field in fields]).reshape(len(nodes), len(nodes)).T
        empty = np.zeros((across.shape[1], across.shape[1]))
        return cls(model, nodes, fields, package[held], held, np.block([[compliance, across], [across.T, empty]]))

    def heights(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far the corners move upwards in a displacement ``(n, 3)``: ``(c,)``, collective."""
        mine = np.where(self.nodes >= 0, displacement[self.nodes, 2], 0.0)
        return np.asarray(self.model.space.comm.allreduce(mine))

    def move(
        self, displacement: NDArray[np.float64], height: float, load: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bring the corners to a height; collective.

        Args:
            displacement: ``(n, 3)`` [m] without the forces.
            height: [m].
            load: ``(m,)`` forces along the package's motions.

        Returns:
            The displacement with the forces, and the forces ``(c,)`` [N].
        """
        wanted = np.concatenate([height - self.heights(displacement), -load[self.held]])
        force, rigid = np.split(np.linalg.solve(self.matrix, wanted), [len(self.nodes)])
        moved = displacement + np.tensordot(force, self.fields, 1) + np.tensordot(rigid, self.motions, 1)
        return moved, force


def _pushes(nodes: NDArray[np.int32], count: int) -> NDArray[np.float64]:
    """Return forces of 1 N upwards at each node that this rank owns: ``(c, count, 3)``."""
    pushes = np.zeros((len(nodes), count, 3))
    mine = np.flatnonzero(nodes >= 0)
    pushes[mine, nodes[mine], 2] = 1.0
    return pushes


@dataclass(frozen=True, slots=True)
class PlacedPads:
    """What rank 0 takes from the mesh, for all.

    Attributes:
        points: ``(n, 3)`` [m].
        tables: Parts, supports, free motions.
        pads: P of ``pads.pad_matrix``.
        corners: ``(c,)`` nodes of the die's corners that are moved.
    """

    points: NDArray[np.float64]
    tables: ThermalTables
    pads: scipy.sparse.csr_matrix
    corners: NDArray[np.intp]


class ThermalStructure:
    """Package and board, factored once; ``state.Structure``.

    Attributes:
        points: ``(n, 3)`` [m] nodes as drawn, each once.
        package: ``(n,)`` whether a node belongs to the package.
        rigid_modes: What free rigid motions of the package do to its pads.
    """

    def __init__(self, comm: MPI.Comm, found: PlacedPads, mesh: MeshData | None, assembly: Assembly) -> None:
        """Factor, and find what all states have in common; collective. Use ``build``."""
        self._comm, self._thermal = comm, assembly.thermal
        self.points, self.package = found.points, found.tables.package
        self._model = Thermoelastic(comm, mesh, found.tables, assembly.materials)
        local, owned = self._model.body.local, self._model.body.shared.owned
        self._nodes, self._owned = local.nodes, owned
        self._pads = found.pads[:, (3 * local.nodes[:, None] + np.arange(3)).ravel()]
        self._package = self._model.space.fields[len(found.tables.motions[0].numbers) :]
        weight = self._model.weight(assembly.gravity)
        self._weight = self._load(weight)
        self._kelvin, self._sag = (self._on_level(force) for force in (self._model.expansion, weight))
        self._corners = Corners.of(self._model, local.locate(found.corners), self._package)
        self._free = self._package[~self._corners.held]
        names = np.array(found.tables.motions[1].names)[~self._corners.held]
        motion = [self._motion(field) for field in self._free]
        shape = (len(names), *self._motion(weight).shape)
        self.rigid_modes = RigidModes(
            tuple(map(str, names)), np.reshape(motion, shape), self._weight[~self._corners.held]
        )

    @classmethod
    def build(cls, comm: MPI.Comm, assembly: Assembly) -> "ThermalStructure":
        """Read board and package and factor their stiffness; collective.

        Raises:
            AgreedError: A mesh that does not fit the pads or the materials, or no memory; on every rank.
        """
        mesh = agreed(comm, lambda: connected(read_mesh(assembly.mesh)) if comm.rank == 0 else None)
        found = agreed(comm, lambda: tabulate(mesh, assembly) if mesh else None)
        return cls(comm, comm.bcast(found), mesh, assembly)

    @property
    def cost(self) -> FactorCost:
        """Return what the factorisation took."""
        return self._model.cost

    @property
    def equations(self) -> int:
        """Return the number of equations."""
        return self._model.equations

    def solve(
        self, temperature: float, corner: float, wrenches: NDArray[np.float64], rigid: NDArray[np.float64]
    ) -> HeatedState:
        """Return the state at a temperature [K], see ``state.Structure``; collective.

        Raises:
            ValueError: Wrenches or rigid motions that are not as many as joints and free motions, or not finite.
        """
        check_loads(self.rigid_modes, wrenches, rigid)
        displacement = (temperature - self._thermal.reference) * self._kelvin + self._sag
        load = self._weight
        if self._thermal.effects.solder_force != "off" and np.any(wrenches):
            force = (self._pads.T @ borne(wrenches).ravel()).reshape(-1, 3)
            displacement += self._on_level(force)
            load = load + self._load(force)
        displacement, corner_force = self._corners.move(displacement, corner, load)
        displacement += np.tensordot(rigid, self._free, 1)
        return HeatedState(self._gathered(displacement), self._motion(displacement), corner_force)

    def _on_level(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement under forces, heights from the mean height of the board's pads; collective."""
        displacement = self._model.displacement(force)
        displacement[:, 2] -= self._motion(displacement)[:, 0, 2].mean() * ~self.package[self._nodes]
        return displacement

    def _load(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return forces along the free motions of the package, those that corners hold included; collective."""
        work = self._model.space.work(force)
        return work[len(work) - len(self._package) :]

    def _motion(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the motion of the pads ``(joints, 2, 6)``; collective."""
        mine = self._pads @ np.where(self._owned[:, None], displacement, 0.0).ravel()
        return np.asarray(self._comm.allreduce(mine)).reshape(-1, 2, 6)

    def _gathered(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement at all nodes of the mesh; collective."""
        whole = np.zeros_like(self.points)
        whole[self._nodes[self._owned]] = displacement[self._owned]
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, whole)
        return whole


def borne(wrenches: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return wrenches ``(joints, 2, 6)`` with the support of the board below its pads."""
    supported = wrenches.copy()
    supported[:, 0, 2] -= wrenches[:, 0, 2].mean()
    return supported


def tabulate(mesh: MeshData, assembly: Assembly) -> PlacedPads:
    """Read supports, pads and corners off a mesh.

    Raises:
        MeshError: Board, package, die or the sides for the pads are missing, or a pad reaches beyond its side.
    """
    centre = assembly.pads.centres[:, 1].mean(axis=0)
    corners = die_corners(mesh) if assembly.thermal.package == "moved" else np.empty(0, np.intp)
    return PlacedPads(mesh.points, thermal_tables(mesh, centre), pad_matrix(mesh, assembly.pads), corners)
