"""Linear quasi-static thermoelasticity of one model, K u = f + (T - T0) F, factored once for all loads.

    F_a = sum_e V_e <grad N_a>_e C_e alpha_e                [N/K]

<.>_e is the mean over an element. Incompatible modes have no mean strain, so a constant thermal strain does no work on
them, and the mean gradients suffice. These hexahedra do not lock in the bending of thin layers; trilinear ones would be
many times too stiff.

The solution contains no free rigid-body motions R: inertia balances the unbalanced load, f - M R (R^T M R)^-1 R^T f,
and the solution has no momentum, R^T M u = 0. This is symmetric, leaves the pins that make K positive definite without
a reaction, and does not change the solution for balanced loads.
"""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.elements.stress import symmetric
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.assembly import make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import FactorCost, Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.statics.thermal_tables import ThermalTables
from reflowshock.materials.roles import Materials, materials_of_parts


@dataclass(frozen=True, slots=True)
class RigidSpace:
    """Free rigid-body motions R of a model on one rank.

    Attributes:
        comm: Communicator of the model.
        fields: Displacement for a unit of each motion, shape (k, n, 3).
        owned: Whether this rank owns a node, shape (n,).
        mass: Nodal mass, shape (n,) [kg].
        inverse: Inverse of R^T M R, shape (k, k).
    """

    comm: MPI.Comm
    fields: NDArray[np.float64]
    owned: NDArray[np.bool_]
    mass: NDArray[np.float64]
    inverse: NDArray[np.float64]

    @classmethod
    def of(cls, comm: MPI.Comm, body: Body, tables: ThermalTables) -> "RigidSpace":
        """Return the space of the free motions of board and package; collective."""
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
        """Return R^T f, shape (k,), of nodal forces, shape (n, 3); collective."""
        owned = self.owned
        return np.asarray(self.comm.allreduce(np.einsum("kni,ni->k", self.fields[:, owned], force[owned])))

    def balance(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return nodal forces plus the inertia forces that balance them, shape (n, 3) [N]; collective."""
        acceleration = np.tensordot(self.inverse @ self.work(force), self.fields, 1)
        return force - self.mass[:, None] * acceleration

    def still(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a displacement without its rigid-body part, shape (n, 3) [m]; collective."""
        momentum = self.work(self.mass[:, None] * displacement)
        return displacement - np.tensordot(self.inverse @ momentum, self.fields, 1)


class Thermoelastic:
    """Factored thermoelastic model on one rank.

    Attributes:
        body: Nodes, elements and masses.
        space: Free rigid-body motions.
        expansion: Nodal forces F of thermal expansion, shape (n, 3) [N/K].
    """

    def __init__(self, comm: MPI.Comm, mesh: MeshData | None, tables: ThermalTables, materials: Materials) -> None:
        """Distribute the mesh of rank 0 and factor; collective.

        Raises:
            AgreedError: A rank has no elements, the matrix is not positive definite, or memory ran out; on every rank.
        """
        local = distribute(comm, mesh)
        rank_elements = agreed(comm, lambda: make_rank_elements(local, tables, materials))
        self.body = make_body(comm, rank_elements, tables, np.ones(len(rank_elements.steps)), None)
        self.space = RigidSpace.of(comm, self.body, tables)
        _, assigned = materials_of_parts(tables.part_names, materials)
        self.expansion = _expansion_force(self.body, np.array([material.expansion for material in assigned]))
        self._equations = Equations.of(comm, self.body)
        self._factor = Factorisation(self._equations.stiffness())
        self._right = self._equations.vector(self.expansion)
        self._solution = self._right.duplicate()

    @property
    def cost(self) -> FactorCost:
        """Cost of the factorisation."""
        return self._factor.cost

    @property
    def equations(self) -> int:
        """Number of equations."""
        return self._equations.total

    def weight(self, gravity: float) -> NDArray[np.float64]:
        """Return the nodal forces of gravity [m/s^2] along -z, shape (n, 3) [N]."""
        return -gravity * self.body.mass[:, None] * np.array([0.0, 0.0, 1.0])

    def displacement(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement, shape (n, 3) [m], under nodal forces, shape (n, 3) [N]; collective."""
        self._right.array = self.space.balance(force)[self._equations.owned]
        self._factor.solve(self._right, self._solution)
        result = np.empty_like(force)
        self._equations.spread(self._solution, result)
        return self.space.still(result)


def _expansion_force(body: Body, expansion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the nodal forces of thermal expansion per kelvin, shape (n, 3) [N/K]; collective.

    Args:
        body: Model on this rank.
        expansion: Expansion coefficients of each material along x, y, z, shape (nm, 3) [1/K].
    """
    elements, geometry = body.elements, body.geometry
    stress = symmetric(np.einsum("mij,mj->mi", elements.elasticity[:, :, :3], expansion))
    matrices = stress[elements.material] * geometry.volume[:, None, None]
    force = np.zeros_like(elements.points)
    np.add.at(force, elements.cells, geometry.gradient @ matrices)
    body.shared.add(force)
    return force
