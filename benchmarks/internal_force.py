"""Element updates per second of the internal force: this program's two paths, PETSc, and dolfinx, in one run.

    python benchmarks/internal_force.py        (one core; writes benchmarks/results/internal_force.json)

All act on the same board of 8-node hexahedra of FR4 and on the same displacement. dolfinx assembles the plain trilinear
form (degree 2 quadrature), the others the element with incompatible modes: equal work for a user, not equal numbers.
"""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import dolfinx.fem
import dolfinx.fem.petsc
import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from fem import dolfinx_api
from fem.element import Elements, element_stiffness
from fem.force_assembled import AssembledElements
from fem.force_congruent import CongruentElements
from fem.materials import elasticity_matrix
from fem.mesh import MeshData
from fem.parameters import FR4
from tests.support.fem_models import grid, mesh_of

COUNTS, SIZE = (40, 30, 4), (0.5e-3, 0.5e-3, 0.25e-3)
SECONDS = 1.0


def rate(work: Callable[[], object], elements: int) -> float:
    """Return element updates per second, best of five batches."""
    work()
    begin = time.perf_counter()
    work()
    repeats = max(1, int(SECONDS / 5 / (time.perf_counter() - begin)))
    best = np.inf
    for _ in range(5):
        begin = time.perf_counter()
        for _ in range(repeats):
            work()
        best = min(best, (time.perf_counter() - begin) / repeats)
    return elements / best


def board() -> MeshData:
    points, cells = grid(*(np.arange(count + 1) * size for count, size in zip(COUNTS, SIZE, strict=True)))
    return mesh_of(points, cells, "board", {})


def petsc_product(elements: Elements) -> Callable[[], object]:
    count = len(elements.points)
    matrix = PETSc.Mat().createBAIJ((3 * count, 3 * count), bsize=3, comm=MPI.COMM_SELF)
    matrix.setPreallocationNNZ(27)
    for nodes, stiffness in zip(elements.cells, element_stiffness(elements), strict=True):
        matrix.setValuesBlocked(nodes, nodes, stiffness, addv=PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()
    source, target = matrix.createVecs()
    source.setRandom()
    return lambda: matrix.mult(source, target)


def dolfinx_assembly(mesh: MeshData) -> Callable[[], object]:
    space = dolfinx_api.vector_space(dolfinx_api.hexahedral_mesh(MPI.COMM_SELF, mesh.points, mesh.cells))
    displacement, test = dolfinx.fem.Function(space), ufl.TestFunction(space)
    displacement.x.array[:] = np.random.default_rng(0).uniform(-1, 1, len(displacement.x.array))
    elasticity = ufl.as_matrix(elasticity_matrix(FR4).tolist())

    def strain(field):
        e = ufl.sym(ufl.grad(field))
        return ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[0, 2]])

    measure = ufl.dx(metadata={"quadrature_degree": 2})
    form = dolfinx.fem.form(ufl.inner(elasticity * strain(displacement), strain(test)) * measure)
    vector = dolfinx.fem.petsc.create_vector(form)
    return lambda: dolfinx.fem.petsc.assemble_vector(vector, form)


def main() -> None:
    mesh = board()
    count = len(mesh.cells)
    elements = Elements(mesh.points, mesh.cells, mesh.part, elasticity_matrix(FR4)[None], np.full(count, FR4.density))
    displacement = np.random.default_rng(0).uniform(-1, 1, mesh.points.shape)
    force = np.zeros_like(displacement)
    congruent, assembled = CongruentElements.build(elements), AssembledElements.build(elements)
    rates = {
        "congruent": rate(lambda: congruent.add(displacement, force), count),
        "assembled": rate(lambda: assembled.add(displacement, force), count),
        "petsc_baij": rate(petsc_product(elements), count),
        "dolfinx_assemble_vector": rate(dolfinx_assembly(mesh), count),
    }
    base = rates["dolfinx_assemble_vector"]
    result = {
        "elements": count,
        "updates_per_second": rates,
        "ratio_to_dolfinx": {name: value / base for name, value in rates.items()},
    }
    path = Path(__file__).parent / "results" / "internal_force.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(result, indent=1))
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
