"""Force terms from UFL: hyperelastic or viscoelastic laws, assembled by DOLFINx on the cells of one rank.

A law is defined by its stored energy; its stress and tangent follow. Viscoelastic laws have internal variables at the
integration points, which are updated once per step. UFL serves laws that the compiled elements lack, and as a check of
those. DOLFINx takes 8 to 50 times as long as the compiled linear elements, 3 to 6 times as long as those at finite
strain (half as long as fully integrated hexahedra, which solve for their modes), with internal variables 10 to 80
times.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import dolfinx.fem
import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.fem.elements.element import Elements
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.parallel.checkpoint_state import Rows

Expression = Any  # UFL expression; the base class has different names in different versions
Internal = Mapping[str, Expression]
DEGREE = {4: 1, 8: 2, 10: 2}  # degree of the quadrature by number of nodes of a cell


@dataclass(frozen=True, slots=True)
class Law:
    """Material law in UFL, with the displacement gradient ``H = du/dX``, shape (3, 3).

    Attributes:
        energy: Function ``(H, internal)`` of the stored energy per undeformed volume [J/m^3].
        stress: Function ``(H, internal)`` of the first Piola-Kirchhoff stress, shape (3, 3) [Pa]; None for dW/dH.
        internal: Shape of each internal variable by name; all are zero at rest.
        update: Function of the new H and the internal variables before a step that returns their values after it by
            name; None without internal variables. Energy and stress receive the new values.
    """

    energy: Callable[[Expression, Internal], Expression]
    stress: Callable[[Expression, Internal], Expression] | None = None
    internal: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    update: Callable[[Expression, Internal], Internal] | None = None

    def first_piola_kirchhoff(self, gradient: Expression, internal: Internal) -> Expression:
        """Return the first Piola-Kirchhoff stress ``(3, 3)`` [Pa] at a displacement gradient ``(3, 3)``."""
        if self.stress is not None:
            return self.stress(gradient, internal)
        variable = ufl.variable(gradient)
        return ufl.diff(self.energy(variable, internal), variable)


class Space:
    """Function space on a DOLFINx mesh of the elements of one rank.

    Attributes:
        mesh: DOLFINx mesh.
        displacement: Displacement field [m].
        test: Test functions.
        dx: Measure of integrals over the undeformed cells.
        degree: Degree of the quadrature.
        order: Element of each cell of the mesh, shape (ne,).
        nodes: Node of each block of degrees of freedom, shape (m,).
        dofs: Blocks of degrees of freedom of each cell, shape (ne, k).
    """

    def __init__(self, points: NDArray[np.float64], cells: NDArray[np.integer]) -> None:
        """Build the space from cells ``(ne, k)`` and points ``(n, 3)`` [m]."""
        used, compact = np.unique(cells, return_inverse=True)
        self.mesh = dolfinx_api.make_mesh(MPI.COMM_SELF, points[used], compact.reshape(cells.shape))
        space = dolfinx_api.vector_space(self.mesh)
        self.displacement, self.test = dolfinx.fem.Function(space), ufl.TestFunction(space)
        self.degree = DEGREE[cells.shape[1]]
        self.dx = ufl.dx(domain=self.mesh, metadata={"quadrature_degree": self.degree})
        self.order = dolfinx_api.input_cells(self.mesh)
        self.dofs = dolfinx_api.cell_dofs(space)
        self.nodes = np.empty(len(self.displacement.x.array) // 3, np.int64)
        self.nodes[self.dofs] = used[dolfinx_api.input_nodes(self.mesh)[dolfinx_api.cell_nodes(self.mesh)]]

    def set(self, displacement: NDArray[np.float64]) -> None:
        """Set the displacement field from nodal values ``(n, 3)`` [m]."""
        self.displacement.x.array.reshape(-1, 3)[:] = displacement[self.nodes]


class UflElements:
    """Force term of elements with a UFL law.

    Attributes:
        numbers: Number of each element among all elements of the rank, shape (ne,).
        history: Values of the internal variables, by degree of freedom of their spaces.
    """

    def __init__(self, everything: Elements, chosen: NDArray[np.integer], law: Law) -> None:
        """Start from rest.

        Args:
            everything: All elements of a rank.
            chosen: Numbers of the elements of the term, shape (ne,).
            law: Material law of the elements.
        """
        self._space = space = Space(everything.points, everything.cells[chosen])
        self.numbers = chosen[space.order]
        gradient = ufl.grad(space.displacement)
        self._internal = _Internal(space, law) if law.update else None
        variables = self._internal.variables if self._internal else {}
        stress = variables["stress"] if self._internal else law.first_piola_kirchhoff(gradient, {})
        self._force = dolfinx.fem.form(ufl.inner(stress, ufl.grad(space.test)) * space.dx)
        self._energy = dolfinx.fem.form(law.energy(gradient, variables) * space.dx)
        self.history = {name: variable.x.array for name, variable in variables.items()}

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m]; update internal variables."""
        space = self._space
        space.set(displacement)
        if self._internal:
            self._internal.step()
        result = np.zeros_like(space.displacement.x.array)
        dolfinx.fem.assemble_vector(result, self._force)
        force[space.nodes] -= result.reshape(-1, 3)

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the stored energy at a displacement ``(n, 3)`` [m] and the viscous dissipation so far [J]."""
        self._space.set(displacement)
        stored = float(dolfinx.fem.assemble_scalar(self._energy))
        return Energy(strain=stored, plastic=self._internal.work() - stored if self._internal else 0.0)

    def state(self, cells: NDArray[np.int64]) -> dict[str, Rows]:
        """Return the internal variables by element for a checkpoint; ``cells`` are the global element numbers."""
        if not self._internal:
            return {}
        numbers = cells[self.numbers]
        return {name: Rows(numbers, values) for name, values in self._internal.by_cell().items()}

    def restore(self, state: Mapping[str, NDArray[np.float64]]) -> None:
        """Set the internal variables from the values that ``state`` returned."""
        if self._internal:
            self._internal.take(state)


class _Internal:
    """Internal variables of a law at the integration points, and the work of its stress.

    The variables of the law are followed by displacement gradient, stress [Pa] and work [J/m^3], the sum over steps of
    mean stress times change of the gradient.
    """

    def __init__(self, space: Space, law: Law) -> None:
        assert law.update is not None
        shapes = {**law.internal, "gradient": (3, 3), "stress": (3, 3), "work": ()}
        self._space = space
        spaces = {name: dolfinx_api.quadrature_space(space.mesh, space.degree, shape) for name, shape in shapes.items()}
        self.variables = {name: dolfinx.fem.Function(points) for name, points in spaces.items()}
        self._dofs = {name: dolfinx_api.cell_dofs(points) for name, points in spaces.items()}
        old, gradient = self.variables, ufl.grad(space.displacement)
        new = dict(law.update(gradient, old))
        stress = law.first_piola_kirchhoff(gradient, new)
        work = old["work"] + ufl.inner(0.5 * (stress + old["stress"]), gradient - old["gradient"])
        new |= {"gradient": gradient, "stress": stress, "work": work}
        self._update = {
            name: dolfinx_api.at_quadrature_points(space.mesh, new[name], space.degree) for name in self.variables
        }
        self._work = dolfinx.fem.form(old["work"] * space.dx)

    def step(self) -> None:
        """Update all variables by a step to the current displacement."""
        self.take({name: evaluate() for name, evaluate in self._update.items()})

    def work(self) -> float:
        """Return the work of the stress so far [J]."""
        return float(dolfinx.fem.assemble_scalar(self._work))

    def by_cell(self) -> dict[str, NDArray[np.float64]]:
        """Return a copy of the values of each variable by name, shape (ne, points * size)."""
        count = len(self._space.order)
        return {name: self._blocks(name)[self._dofs[name]].reshape(count, -1) for name in self.variables}

    def take(self, values: Mapping[str, NDArray[np.float64]]) -> None:
        """Set the values of each variable in the layout of ``by_cell``."""
        for name, dofs in self._dofs.items():
            self._blocks(name)[dofs] = values[name].reshape(*dofs.shape, -1)

    def _blocks(self, name: str) -> NDArray[np.float64]:
        """Return a view of a variable's values by integration point, ``(ne * points, size)``."""
        variable = self.variables[name]
        return variable.x.array.reshape(-1, variable.function_space.dofmap.index_map_bs)


def tangent_at_rest(elements: Elements, law: Law) -> NDArray[np.float64]:
    """Return the stiffness of each element at rest, node by node, shape (ne, 3k, 3k) [N/m].

    Internal variables of the law are updated with the displacement: the response is instantaneous.

    Args:
        elements: Elements of one kind with k nodes; their own materials are not used.
        law: Material law in UFL for all of them.
    """
    count, nodes = elements.cells.shape
    apart = np.arange(count * nodes).reshape(count, nodes)
    space = Space(elements.points[elements.cells].reshape(-1, 3), apart)
    shapes = {name: ufl.zero(*shape) if shape else ufl.zero() for name, shape in law.internal.items()}
    gradient = ufl.grad(space.displacement)
    new = law.update(gradient, shapes) if law.update else {}
    stress = law.first_piola_kirchhoff(gradient, new)
    tangent = ufl.derivative(ufl.inner(stress, ufl.grad(space.test)) * space.dx, space.displacement)
    matrix = dolfinx_api.assembled_csr(dolfinx.fem.form(tangent))
    result = np.empty((count, 3 * nodes, 3 * nodes))
    for cell, dofs in enumerate(space.dofs):
        local = np.argsort(space.nodes[dofs])  # the nodes of the cell in the order of the elements
        rows = (3 * dofs[local][:, None] + np.arange(3)).ravel()
        result[space.order[cell]] = matrix[rows][:, rows].toarray()
    return result
