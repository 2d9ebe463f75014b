"""The only place that knows versions of DOLFINx: 0.5 (Debian 12) and 0.9 (Debian 13)."""

from collections.abc import Callable
from pathlib import Path

import dolfinx
import dolfinx.fem
import dolfinx.fem.petsc
import dolfinx.io
import dolfinx.mesh
import numpy as np
import scipy.sparse
import ufl
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.cell_shape import SHAPES

OLD = tuple(int(part) for part in dolfinx.__version__.split(".")[:2]) < (0, 8)
# Cell and degree of the geometry by the number of nodes; the program's own shapes, and quadratic hexahedra for oracles.
GEOMETRIES = {shape.nodes: (shape.cell, shape.degree) for shape in SHAPES.values()} | {27: ("hexahedron", 2)}


def make_mesh(
    comm: MPI.Comm,
    points: NDArray[np.float64],
    cells: NDArray[np.integer],
    ranks: NDArray[np.int32] | None = None,
) -> dolfinx.mesh.Mesh:
    """Create a distributed mesh without ghost cells; the arrays of all ranks together are the input; collective.

    Args:
        comm: Communicator of the model.
        points: This rank's share of the nodes in input order, shape (n, 3) [m].
        cells: Input node numbers of this rank's share of the cells, shape (ne, k); k, equal on all ranks, gives their
            shape.
        ranks: Rank that gets each of these cells, shape (ne,); None on all ranks lets DOLFINx partition the mesh.
    """
    cells, geometry = np.ascontiguousarray(cells, np.int64), GEOMETRIES[cells.shape[1]]
    ghosts = dolfinx.mesh.GhostMode.none

    def partitioner(*_: object) -> dolfinx.cpp.graph.AdjacencyList_int32:
        return dolfinx.cpp.graph.AdjacencyList_int32(ranks, np.arange(len(cells) + 1, dtype=np.int32))

    if OLD:
        domain = ufl.Mesh(ufl.VectorElement("Lagrange", *geometry))
        chosen = dolfinx.cpp.mesh.create_cell_partitioner() if ranks is None else partitioner
        return dolfinx.mesh.create_mesh(comm, cells, points, domain, ghost_mode=ghosts, partitioner=chosen)
    import basix.ufl

    domain = ufl.Mesh(basix.ufl.element("Lagrange", *geometry, shape=(3,)))
    chosen = dolfinx.mesh.create_cell_partitioner(ghosts) if ranks is None else partitioner
    return dolfinx.mesh.create_mesh(comm, cells, points, domain, partitioner=chosen)


def cell_nodes(mesh: dolfinx.mesh.Mesh) -> NDArray[np.int32]:
    """Return the nodes of the cells of this rank, in local numbers and in the node order of the input, shape (ne, k).

    Args:
        mesh: Mesh distributed by ``make_mesh``.
    """
    dofmap = mesh.geometry.dofmap
    if OLD:
        return np.asarray(dofmap.array, np.int32).reshape(-1, mesh.geometry.cmap.create_dof_layout().num_dofs)
    return np.asarray(dofmap, np.int32)


def degree(mesh: dolfinx.mesh.Mesh) -> int:
    """Return the polynomial degree of the geometry of a mesh: 1 for straight edges, 2 for curved ones.

    Args:
        mesh: Mesh of DOLFINx.
    """
    return GEOMETRIES[cell_nodes(mesh).shape[1]][1]


def input_nodes(mesh: dolfinx.mesh.Mesh) -> NDArray[np.int64]:
    """Return the number that each node of this rank has in the input of ``make_mesh``, shape (n,).

    Args:
        mesh: Mesh distributed by ``make_mesh``; nodes are in the order of its local numbers.
    """
    return np.asarray(mesh.geometry.input_global_indices, np.int64)


def input_cells(mesh: dolfinx.mesh.Mesh) -> NDArray[np.int64]:
    """Return the number that each cell of this rank has in the input of ``make_mesh``, shape (ne,).

    Args:
        mesh: Mesh distributed by ``make_mesh``; cells are in the order of its local numbers.
    """
    return np.asarray(mesh.topology.original_cell_index, np.int64)


def vector_space(mesh: dolfinx.mesh.Mesh) -> dolfinx.fem.FunctionSpace:
    """Return the function space of vector fields with a value (three components) at each node of a mesh.

    Args:
        mesh: Mesh of DOLFINx.
    """
    if OLD:
        return dolfinx.fem.VectorFunctionSpace(mesh, ("Lagrange", degree(mesh)))
    return dolfinx.fem.functionspace(mesh, ("Lagrange", degree(mesh), (3,)))


def cell_space(mesh: dolfinx.mesh.Mesh) -> dolfinx.fem.FunctionSpace:
    """Return the function space of scalars that are constant in each cell.

    Args:
        mesh: Mesh of DOLFINx; degree of freedom i belongs to its local cell i.
    """
    return dolfinx.fem.FunctionSpace(mesh, ("DG", 0)) if OLD else dolfinx.fem.functionspace(mesh, ("DG", 0))


def cell_dofs(space: dolfinx.fem.FunctionSpace) -> NDArray[np.int32]:
    """Return the degrees of freedom of each cell of this rank, shape (ne, k); a vector counts as one.

    Args:
        space: Function space of DOLFINx.
    """
    dofs = space.dofmap.list
    cells = space.mesh.topology.index_map(3)
    array = np.asarray(dofs.array if OLD else dofs, np.int32)
    return array.reshape(cells.size_local + cells.num_ghosts, -1)


def quadrature_space(mesh: dolfinx.mesh.Mesh, degree: int, shape: tuple[int, ...]) -> dolfinx.fem.FunctionSpace:
    """Return the function space of tensors given at the points of a quadrature rule in each cell.

    Args:
        mesh: Mesh of DOLFINx.
        degree: Polynomial degree that the rule integrates exactly.
        shape: Tensor shape of the values, () for scalars.
    """
    if OLD:
        element = ufl.FiniteElement("Quadrature", mesh.ufl_cell(), degree=degree, quad_scheme="default")
        if len(shape) == 1:
            element = ufl.VectorElement(element, dim=shape[0])
        elif shape:
            element = ufl.TensorElement(element, shape=shape)
        return dolfinx.fem.FunctionSpace(mesh, element)
    import basix.ufl

    element = basix.ufl.quadrature_element(mesh.basix_cell(), value_shape=shape, degree=degree)
    return dolfinx.fem.functionspace(mesh, element)


def at_quadrature_points(
    mesh: dolfinx.mesh.Mesh, expression: ufl.core.expr.Expr, degree: int
) -> Callable[[], NDArray[np.float64]]:
    """Return a function that evaluates a UFL expression at the integration points of all local cells.

    The function takes no arguments and returns current values, shape (ne, points * size), point by point. ``degree`` is
    the degree of the quadrature rule.

    Each test function of their space is one at its own point and zero at all others, so that the integral of the
    expression times it is the value there times the weight.
    """
    shape = expression.ufl_shape
    space, dx = quadrature_space(mesh, degree, shape), ufl.dx(domain=mesh, metadata={"quadrature_degree": degree})
    test, dofs = ufl.TestFunction(space), cell_dofs(space)
    ones = ufl.as_tensor(np.ones(shape).tolist()) if shape else ufl.as_ufl(1.0)
    integral, weight = (dolfinx.fem.form(ufl.inner(item, test) * dx) for item in (expression, ones))
    weights = np.array(dolfinx.fem.assemble_vector(weight).array)

    def evaluate() -> NDArray[np.float64]:
        vector = dolfinx.fem.assemble_vector(integral)
        values = (vector.array / weights).reshape(-1, int(np.prod(shape)))
        return values[dofs].reshape(len(dofs), -1)

    return evaluate


def assembled_csr(form) -> scipy.sparse.csr_matrix:  # its type has another name in each version
    """Assemble the matrix of a bilinear form as a sparse matrix; only on a single rank.

    Args:
        form: Form compiled by DOLFINx, such as the result of ``compiled_form``.
    """
    matrix = dolfinx.fem.petsc.assemble_matrix(form)
    matrix.assemble()
    pointers, columns, values = matrix.getValuesCSR()
    result = scipy.sparse.csr_matrix((values, columns, pointers), shape=matrix.getSize())
    matrix.destroy()
    return result


def compiled_form(form: ufl.Form, flags: list[str]):  # its type has another name in each version
    """Compile a UFL form to machine code.

    Args:
        form: Form in UFL.
        flags: Options of the C compiler, such as ``["-O3"]``.

    Returns:
        Form of DOLFINx, ready for assembly.
    """
    if OLD:
        return dolfinx.fem.form(form, jit_params={"cffi_extra_compile_args": flags})
    return dolfinx.fem.form(form, jit_options={"cffi_extra_compile_args": flags})


def compile_ahead(corners: NDArray[np.float64] | None) -> None:
    """Let one rank compile the elements of the output before two communicators wait for one cache entry.

    Args:
        corners: ``(k, 3)`` [m] nodes of a cell on that rank, None on the others.
    """
    if corners is not None:
        mesh = make_mesh(MPI.COMM_SELF, corners, np.arange(len(corners))[None, :])
        vector_space(mesh)
        cell_space(mesh)


class FieldFile:
    """A time series of functions for ParaView (PVD with pieces per rank)."""

    def __init__(self, comm: MPI.Comm, path: Path) -> None:
        """Open ``path`` (``.pvd``); collective."""
        self._comm, self._path = comm, path
        self._file = dolfinx.io.VTKFile(comm, str(path), "w")

    def write(self, functions: list[dolfinx.fem.Function], time: float) -> None:
        """Append functions of one mesh at a time [s]; collective."""
        self._file.write_function(functions, time)

    def close(self) -> None:
        """Close the file; collective."""
        self._file.close()
        self._comm.Barrier()
        if self._comm.rank == 0:
            for parallel_file in self._path.parent.glob(f"{self._path.stem}[0-9]*.pvtu"):
                _name_each_piece_once(parallel_file)


def _name_each_piece_once(parallel_file: Path) -> None:
    """Remove repeated pieces: DOLFINx 0.5 lists each piece once per function, and readers show copies of the mesh."""
    lines = parallel_file.read_text(encoding="utf-8").splitlines()
    first = {line: k for k, line in reversed(list(enumerate(lines)))}
    unique = [line for k, line in enumerate(lines) if "<Piece " not in line or first[line] == k]
    parallel_file.write_text("\n".join(unique) + "\n", encoding="utf-8")
