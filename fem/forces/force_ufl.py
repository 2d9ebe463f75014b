"""Force terms from UFL: any hyperelastic or viscoelastic law, assembled by DOLFINx on the rank's own cells.

A law is given by its stored energy; its stress and its tangent follow. Viscoelastic laws have internal variables at the
integration points, which change once a step. This is for laws that the program's own elements do not have, and to check
them. DOLFINx takes 8 to 50 times as long as own linear elements, 3 to 6 times as long as own ones at finite strain (but
half as long as fully integrated hexahedra, whose modes are solved for), with internal variables 10 to 80 times.
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

Expression = Any  # of UFL, whose classes have no common name in all versions
Internal = Mapping[str, Expression]
DEGREE = {4: 1, 8: 2, 10: 2}  # of the quadrature, by the nodes of a cell


@dataclass(frozen=True, slots=True)
class Law:
    """A material law in UFL. ``H = du/dX`` is the gradient of the displacement, ``(3, 3)``.

    Attributes:
        energy: ``(H, internal)`` -> stored energy per undeformed volume [J/m^3].
        stress: ``(H, internal)`` -> first Piola-Kirchhoff stress ``(3, 3)`` [Pa]; without it that of the energy, dW/dH.
        internal: Name -> shape of each internal variable, zero at rest.
        update: ``(H, internal)`` -> name -> value after a step, from the new H and the values before the step. Energy
            and stress are given the new values.
    """

    energy: Callable[[Expression, Internal], Expression]
    stress: Callable[[Expression, Internal], Expression] | None = None
    internal: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    update: Callable[[Expression, Internal], Internal] | None = None

    def first_piola_kirchhoff(self, gradient: Expression, internal: Internal) -> Expression:
        """Return the stress ``(3, 3)`` [Pa] at a gradient of the displacement."""
        if self.stress is not None:
            return self.stress(gradient, internal)
        variable = ufl.variable(gradient)
        return ufl.diff(self.energy(variable, internal), variable)


class Space:
    """Elements as a mesh of DOLFINx's, of this rank alone.

    Attributes:
        mesh: The mesh.
        displacement: A field on it.
        test: Test functions.
        dx: Measure of integrals over the undeformed cells.
        degree: Of the quadrature.
        order: ``(ne,)`` the element that each cell of the mesh is.
        nodes: ``(m,)`` node of the elements that each block of the field's degrees of freedom belongs to.
        dofs: ``(ne, k)`` these blocks by cell.
    """

    def __init__(self, points: NDArray[np.float64], cells: NDArray[np.integer]) -> None:
        """Take cells ``(ne, k)`` of points ``(n, 3)`` [m]."""
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
        """Take a displacement ``(n, 3)`` [m]."""
        self.displacement.x.array.reshape(-1, 3)[:] = displacement[self.nodes]


class UflElements:
    """Elements whose stress is a law in UFL: a force term.

    Attributes:
        numbers: ``(ne,)`` their numbers among all elements of the rank.
        history: Values of the internal variables, by degree of freedom of their spaces.
    """

    def __init__(self, everything: Elements, chosen: NDArray[np.integer], law: Law) -> None:
        """Start from rest.

        Args:
            everything: The elements of a rank.
            chosen: ``(ne,)`` which of them.
            law: Their material.
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
        """Subtract the internal force ``(n, 3)`` [N]; internal variables go on by a step."""
        space = self._space
        space.set(displacement)
        if self._internal:
            self._internal.step()
        result = np.zeros_like(space.displacement.x.array)
        dolfinx.fem.assemble_vector(result, self._force)
        force[space.nodes] -= result.reshape(-1, 3)

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the stored energy at a displacement ``(n, 3)`` [m] and what viscous flow has dissipated [J]."""
        self._space.set(displacement)
        stored = float(dolfinx.fem.assemble_scalar(self._energy))
        return Energy(strain=stored, plastic=self._internal.work() - stored if self._internal else 0.0)

    def state(self, cells: NDArray[np.int64]) -> dict[str, Rows]:
        """Return the internal variables by element, for a checkpoint; ``cells`` are input numbers of all elements."""
        if not self._internal:
            return {}
        numbers = cells[self.numbers]
        return {name: Rows(numbers, values) for name, values in self._internal.by_cell().items()}

    def restore(self, state: Mapping[str, NDArray[np.float64]]) -> None:
        """Continue from the values of what ``state`` returned."""
        if self._internal:
            self._internal.take(state)


class _Internal:
    """Internal variables of a law at the integration points, and the work of its stress.

    Besides those of the law: gradient of the displacement, stress [Pa], and work [J/m^3], summed over steps: the mean
    stress times the change of the gradient.
    """

    def __init__(self, space: Space, law: Law) -> None:
        assert law.update is not None
        shapes = {**law.internal, "gradient": (3, 3), "stress": (3, 3), "work": ()}
        self._space = space
        spaces = {name: dolfinx_api.quadrature_space(space.mesh, space.degree, shape) for name, shape in shapes.items()}
        self.variables = {name: dolfinx.fem.Function(own) for name, own in spaces.items()}
        self._dofs = {name: dolfinx_api.cell_dofs(own) for name, own in spaces.items()}
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
        """Replace all values by those after a step to the present displacement."""
        self.take({name: evaluate() for name, evaluate in self._update.items()})

    def work(self) -> float:
        """Return the work that the stress has taken up [J]."""
        return float(dolfinx.fem.assemble_scalar(self._work))

    def by_cell(self) -> dict[str, NDArray[np.float64]]:
        """Return a copy of the values of each variable, ``(ne, points * size)``."""
        count = len(self._space.order)
        return {name: self._blocks(name)[self._dofs[name]].reshape(count, -1) for name in self.variables}

    def take(self, values: Mapping[str, NDArray[np.float64]]) -> None:
        """Set values of each variable, as ``by_cell`` returns them."""
        for name, dofs in self._dofs.items():
            self._blocks(name)[dofs] = values[name].reshape(*dofs.shape, -1)

    def _blocks(self, name: str) -> NDArray[np.float64]:
        """Return a view of a variable's values by integration point, ``(ne * points, size)``."""
        variable = self.variables[name]
        return variable.x.array.reshape(-1, variable.function_space.dofmap.index_map_bs)


def tangent_at_rest(elements: Elements, law: Law) -> NDArray[np.float64]:
    """Return the stiffness ``(ne, 3k, 3k)`` [N/m] of each element at rest against a sudden step, node by node."""
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
