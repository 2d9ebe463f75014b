"""Linear quasi-static thermoelasticity of one model: K u = f + (T - T0) F, factored once, solved for any load.

    F_a = sum_e V_e <grad N_a>_e C_e alpha_e                [N/K]

<.>_e is the mean over an element: incompatible modes have no mean strain, so a constant thermal strain does no work on
them and needs the mean gradients only. They are the program's own hexahedra, which do not lock in the bending of layers
that are thin (PHYSICS 3); trilinear ones would be many times too stiff.

Free rigid motions R are no part of the answer: inertia bears what is out of balance, f - M R (R^T M R)^-1 R^T f, and
the answer has no momentum, R^T M u = 0. That is symmetric, leaves the pins that make K positive definite without a
force, and makes no difference where loads are in balance.
"""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.elements.stress import symmetric
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.assembly import make_body, make_pieces
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import FactorCost, Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.statics.thermal_tables import ThermalTables
from reflowshock.materials.roles import Materials, materials_of_parts


@dataclass(frozen=True, slots=True)
class RigidSpace:
    """Free rigid motions of a model on one rank.

    Attributes:
        comm: Communicator of the model.
        fields: ``(k, n, 3)`` displacements of a unit of each.
        owned: ``(n,)`` nodes that count on this rank.
        mass: ``(n,)`` [kg].
        inverse: ``(k, k)`` of R^T M R.
    """

    comm: MPI.Comm
    fields: NDArray[np.float64]
    owned: NDArray[np.bool_]
    mass: NDArray[np.float64]
    inverse: NDArray[np.float64]

    @classmethod
    def of(cls, comm: MPI.Comm, body: Body, tables: ThermalTables) -> "RigidSpace":
        """Take the free motions of board and package; collective."""
        points, package = body.local.points, tables.package[body.local.nodes]
        fields = np.concatenate(
            [
                motions.fields(points) * mine[:, None]
                for motions, mine in zip(tables.motions, (~package, package), strict=True)
            ]
        )
        space = cls(comm, fields, body.shared.owned, body.mass, np.empty((0, 0)))
        gram = np.array([space.work(field * body.mass[:, None]) for field in fields]).reshape(len(fields), -1)
        return cls(comm, fields, body.shared.owned, body.mass, np.linalg.inv(gram))

    def work(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return R^T f ``(k,)`` of forces ``(n, 3)``, over all ranks."""
        owned = self.owned
        return np.asarray(self.comm.allreduce(np.einsum("kni,ni->k", self.fields[:, owned], force[owned])))

    def balance(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the forces with those of inertia."""
        acceleration = np.tensordot(self.inverse @ self.work(force), self.fields, 1)
        return force - self.mass[:, None] * acceleration

    def still(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement without its momentum."""
        momentum = self.work(self.mass[:, None] * displacement)
        return displacement - np.tensordot(self.inverse @ momentum, self.fields, 1)


class Thermoelastic:
    """A model on this rank, factored.

    Attributes:
        body: Nodes, elements, masses.
        space: Its free rigid motions.
        expansion: ``(n, 3)`` [N/K] F, forces that a kelvin gives.
    """

    def __init__(self, comm: MPI.Comm, mesh: MeshData | None, tables: ThermalTables, materials: Materials) -> None:
        """Distribute the mesh of rank 0 and factor; collective.

        Raises:
            AgreedError: A rank without elements, a matrix that is not positive definite, or no memory; on every rank.
        """
        local = distribute(comm, mesh)
        pieces = agreed(comm, lambda: make_pieces(local, tables, materials))
        self.body = make_body(comm, pieces, tables, np.ones(len(pieces.steps)), None)
        self.space = RigidSpace.of(comm, self.body, tables)
        _, assigned = materials_of_parts(tables.part_names, materials)
        self.expansion = expansion_force(self.body, np.array([material.expansion for material in assigned]))
        self._equations = Equations.of(comm, self.body)
        self._factor = Factorisation(self._equations.stiffness())
        self._right = self._equations.vector(self.expansion)
        self._solution = self._right.duplicate()

    @property
    def cost(self) -> FactorCost:
        """Return what the factorisation took."""
        return self._factor.cost

    @property
    def equations(self) -> int:
        """Return the number of equations."""
        return self._equations.total

    def weight(self, gravity: float) -> NDArray[np.float64]:
        """Return the forces ``(n, 3)`` [N] of gravity [m/s^2] along -z."""
        return -gravity * self.body.mass[:, None] * np.array([0.0, 0.0, 1.0])

    def displacement(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement ``(n, 3)`` [m] under forces ``(n, 3)`` [N], without rigid motions; collective."""
        self._right.array = self.space.balance(force)[self._equations.own]
        self._factor.solve(self._right, self._solution)
        result = np.empty_like(force)
        self._equations.spread(self._solution, result)
        return self.space.still(result)


def expansion_force(body: Body, expansion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the nodal forces ``(n, 3)`` [N/K] of a kelvin, over all ranks; collective.

    Args:
        body: The model.
        expansion: ``(nm, 3)`` [1/K] coefficients of each material along x, y, z.
    """
    elements, geometry = body.elements, body.geometry
    stress = symmetric(np.einsum("mij,mj->mi", elements.elasticity[:, :, :3], expansion))
    matrices = stress[elements.material] * geometry.volume[:, None, None]
    force = np.zeros_like(elements.points)
    np.add.at(force, elements.cells, geometry.gradient @ matrices)
    body.shared.add(force)
    return force
