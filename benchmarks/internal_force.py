"""Element updates per second of the internal force: this program's paths, PETSc and dolfinx in one run; memory.

    python benchmarks/internal_force.py        (one core; writes benchmarks/results/internal_force.json)

All act on a cube of 40^3 hexahedra of steel, sides in turns, medians of processor seconds. dolfinx assembles the plain
trilinear form with 2 x 2 x 2 Gauss points and the best flags of its compiler; ours have incompatible modes, which do
not lock in bending: equal work for a user, not equal numbers. ``congruent`` knows that the elements are boxes of one
shape; ``assembled`` and ``petsc_baij`` multiply by the matrix of a cube whose inner nodes were moved by up to 20 % of
an edge.
"""

import ctypes
import gc
import os
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import dolfinx.fem
import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from benchmarks.support import turns
from benchmarks.support.cube import STEEL, cube, elements_of, random_displacement
from fem import dolfinx_api
from fem.element import CHUNK, Elements, element_stiffness
from fem.force import ForceTerm, force_terms
from fem.mesh import MeshData

BEST_FLAGS = ["-O3", "-march=native", "-ffast-math"]
PAGE = os.sysconf("SC_PAGE_SIZE")


def only_term(elements: Elements) -> ForceTerm:
    (term,) = force_terms(elements, [STEEL])
    return term


def force_of(term: ForceTerm, displacement: np.ndarray) -> Callable[[], object]:
    force = np.zeros_like(displacement)
    return lambda: term.add(displacement, force)


def petsc_product(elements: Elements) -> Callable[[], object]:
    count = len(elements.points)
    matrix = PETSc.Mat().createBAIJ((3 * count, 3 * count), bsize=3, comm=MPI.COMM_SELF)
    matrix.setPreallocationNNZ(27)
    for start in range(0, len(elements.cells), CHUNK):
        some = elements.subset(np.arange(start, min(start + CHUNK, len(elements.cells))))
        for nodes, stiffness in zip(some.cells, element_stiffness(some), strict=True):
            matrix.setValuesBlocked(nodes, nodes, stiffness, addv=PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()
    source, target = matrix.createVecs()
    source.setRandom()
    return lambda: matrix.mult(source, target)


def dolfinx_assembly(mesh: MeshData) -> Callable[[], object]:
    space = dolfinx_api.vector_space(dolfinx_api.make_mesh(MPI.COMM_SELF, mesh.points, mesh.cells))
    displacement, test = dolfinx.fem.Function(space), ufl.TestFunction(space)
    displacement.x.array[:] = np.random.default_rng(0).uniform(-1, 1, len(displacement.x.array))
    young, poisson = STEEL.young_modulus, STEEL.poisson_ratio
    shear = young / (2 * (1 + poisson))
    lame = 2 * shear * poisson / (1 - 2 * poisson)
    strain = ufl.sym(ufl.grad(displacement))
    stress = lame * ufl.tr(strain) * ufl.Identity(3) + 2 * shear * strain
    measure = ufl.dx(metadata={"quadrature_degree": 2})
    form = dolfinx_api.compiled_form(ufl.inner(stress, ufl.sym(ufl.grad(test))) * measure, BEST_FLAGS)
    vector = np.zeros_like(displacement.x.array)
    return lambda: dolfinx.fem.assemble_vector(vector, form)


def resident() -> int:
    """Return the resident bytes of this process after all that is free has gone back to the system."""
    gc.collect()
    ctypes.CDLL("libc.so.6").malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def array_bytes(term: ForceTerm) -> int:
    return sum(value.nbytes for name in term.__slots__ if isinstance(value := getattr(term, name), np.ndarray))


def memory(elements: Elements) -> dict[str, float]:
    """Return the bytes an element that a term holds: counted over its arrays, and as the growth of the process."""
    warm = elements.subset(np.arange(64))
    only_term(warm)
    before = resident()
    term = only_term(elements)
    grown, count = resident() - before, len(elements.cells)
    return {"arrays": array_bytes(term) / count, "resident": grown / count}


def main() -> None:
    boxes, distorted = elements_of(cube()), elements_of(cube(distorted=True))
    memories = {"congruent": memory(boxes), "assembled": memory(distorted)}
    displacement = random_displacement(cube())
    seconds = turns.in_turns(
        {
            "congruent": turns.batch(force_of(only_term(boxes), displacement)),
            "assembled": turns.batch(force_of(only_term(distorted), displacement)),
            "petsc_baij": turns.batch(petsc_product(distorted)),
            "dolfinx": turns.batch(dolfinx_assembly(cube())),
        }
    )
    against = {name: turns.ratio(seconds, name, "dolfinx") for name in seconds}
    turns.write(
        "internal_force",
        {
            "elements": len(boxes.cells),
            "updates_per_second": turns.rates(seconds, len(boxes.cells)),
            "ratio_to_dolfinx": against,
            "bytes_an_element": memories,
            "bars": {
                "congruent_to_dolfinx": turns.bar(against["congruent"], 8.0),
                "assembled_to_dolfinx": turns.bar(against["assembled"], 4.0),
                "congruent_bytes": turns.bar(max(memories["congruent"].values()), 400.0, at_least=False),
                "assembled_bytes": turns.bar(max(memories["assembled"].values()), 2000.0, at_least=False),
            },
        },
    )


if __name__ == "__main__":
    main()
