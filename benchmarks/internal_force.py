"""Element updates per second of the internal force by this program, PETSc and DOLFINx, and memory per element.

    PYTHONPATH=. python benchmarks/internal_force.py  (a minute, one core; writes results/internal_force.json)

All run on a cube of 40^3 hexahedra, in turns; figures are medians of processor seconds. DOLFINx assembles the trilinear
form of linear elasticity with 2 x 2 x 2 Gauss points and the best flags of its compiler. Our elements have incompatible
modes and do not lock in bending, so that the comparison is equal work for a user, not equal numbers.
- ``congruent``: boxes of one shape; ``turning``: the same in corotational kinematics; ``turning_any``: elements of any
  shape.
- ``assembled`` and ``petsc_baij``: product with the matrix of a cube whose inner nodes are moved by up to 20 % of an
  edge.
- ``yielding``: return mapping of a rate-dependent solder at nearly every point of every call, at a strain rate of
  100 1/s; ``below_yield``: the same law at small strains. All Gauss points or one, on boxes, at small or finite strain.
- Tetrahedra: each distorted hexahedron is cut into six; rates count tetrahedra.
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

from benchmarks.support import results, turns
from benchmarks.support.cube import SOLDER, STEEL, cube, elements_of, random_displacement
from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.fem import dolfinx_api
from reflowshock.fem.elements.element import CHUNK, Elements, element_stiffness
from reflowshock.fem.forces.force import ForceTerm, Kinematics, force_terms
from reflowshock.fem.mesh.mesh import MeshData

KINDS = ("incompatible_modes", "one_point")
PLASTIC = [f"{name}_{kind}_small" for name in ("below_yield", "yielding") for kind in KINDS]
BARS = {"congruent": 8.0, "assembled": 4.0, "turning": 8.0, "turning_any": 2.0} | dict.fromkeys(PLASTIC, 1.5)
BYTES = {"congruent": 400.0, "assembled": 2000.0}
STRAINS = {"below_yield": 1e-5, "yielding": 1e-2}
STEP, RATE = 1e-8, 100.0  # [s], [1/s]
BEST_FLAGS = ["-O3", "-march=native", "-ffast-math"]
PAGE = os.sysconf("SC_PAGE_SIZE")


def only_term(elements: Elements) -> ForceTerm:
    """Return the single force term of elements of steel that all have the same kind."""
    (term,) = force_terms(elements, [STEEL])
    return term


def linear_force(elements: Elements) -> Callable[[], object]:
    """Return a function that evaluates the internal force of linear elements at a random displacement."""
    term, displacement = only_term(elements), random_displacement(elements.points)
    force = np.zeros_like(displacement)
    return lambda: term.add(displacement, force)


def corotational_force(elements: Elements) -> Callable[[], object]:
    """Return a function that evaluates the force of elastic hexahedra at a strain of 1e-3 and a rotation of 0.1 rad."""
    (term,) = force_terms(elements, [STEEL], "corotational")
    turn = np.array([[np.cos(0.1), -np.sin(0.1), 0.0], [np.sin(0.1), np.cos(0.1), 0.0], [0.0, 0.0, 1.0]])
    moved = elements.points + random_displacement(elements.points, 1e-3)
    displacement, force = moved @ turn.T - elements.points, np.zeros_like(moved)
    return lambda: term.add(displacement, force)


def plastic_force(elements: Elements, kinematics: Kinematics, strain: float) -> Callable[[], object]:
    """Return a function that evaluates the internal force of solder elements at a strain that grows from call to call.

    Args:
        elements: Hexahedra of solder.
        kinematics: "small" or "finite" strain.
        strain: Strain at the first call.
    """
    (term,) = force_terms(elements, [SOLDER], kinematics, STEP)
    state, growth = (random_displacement(elements.points, part) for part in (strain, STEP * RATE))
    force = np.zeros_like(state)

    def work() -> None:
        np.add(state, growth, out=state)
        term.add(state, force)

    return work


def petsc_product(elements: Elements) -> Callable[[], object]:
    """Return a function that multiplies the elements' stiffness, a blocked matrix of PETSc, by a displacement."""
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
    """Return a function that assembles the internal force of linear elastic hexahedra by DOLFINx."""
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


def resident_bytes() -> int:
    """Return the resident bytes of this process after returning free memory to the system."""
    gc.collect()
    ctypes.CDLL("libc.so.6").malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def array_bytes(term: ForceTerm) -> int:
    """Return the bytes of all arrays of a force term."""
    return sum(value.nbytes for name in term.__slots__ if isinstance(value := getattr(term, name), np.ndarray))


def measure_memory(elements: Elements) -> dict[str, float]:
    """Return the bytes per element of a force term: ``arrays``, counted, and ``resident``, growth of the process."""
    warm = elements.subset(np.arange(64))
    only_term(warm)
    before = resident_bytes()
    term = only_term(elements)
    grown, count = resident_bytes() - before, len(elements.cells)
    return {"arrays": array_bytes(term) / count, "resident": grown / count}


def model_bytes(mesh: MeshData) -> float:
    """Return the bytes per element of a whole model, including nodal vectors and the DOLFINx mesh."""
    before = resident_bytes()
    model = motion_of(dns_body(mesh, STEEL)[0], STEP)
    grown = resident_bytes() - before
    return grown / len(model.body.elements.cells)


def make_sides() -> tuple[dict[str, Callable[[], object]], dict[str, int]]:
    """Prepare the works that are compared.

    Returns:
        Name of a side -> function that evaluates the force once, and name of a side -> number of its elements.
    """
    boxes, mesh = cube(), cube(distorted=True)
    linear_elements = {
        "congruent": elements_of(boxes),
        "assembled": elements_of(mesh),
        "tetrahedra": elements_of(mesh, "tetrahedron"),
        "quadratic_tetrahedra": elements_of(mesh, "tetrahedron_quadratic"),
    }
    plastic_elements = {kind: elements_of(boxes, kind, SOLDER) for kind in KINDS}
    works = {name: linear_force(elements) for name, elements in linear_elements.items()}
    works |= {
        "turning": corotational_force(linear_elements["congruent"]),
        "turning_any": corotational_force(linear_elements["assembled"]),
    }
    counts = {name: len(elements.cells) for name, elements in linear_elements.items()}
    for kind, elements in plastic_elements.items():
        for kinematics in ("small", "finite"):
            for name, strain in STRAINS.items():
                works[f"{name}_{kind}_{kinematics}"] = plastic_force(elements, kinematics, strain)
    works["petsc_baij"] = petsc_product(linear_elements["assembled"])
    works["petsc_baij_tetrahedra"] = petsc_product(linear_elements["tetrahedra"])
    works["dolfinx"] = dolfinx_assembly(mesh)
    counts["petsc_baij_tetrahedra"] = counts["tetrahedra"]
    return works, dict.fromkeys(works, len(mesh.cells)) | counts


def main() -> None:
    """Measure speed and memory of all sides; store and print rates, ratios and limits."""
    meshes = {"congruent": cube(), "assembled": cube(distorted=True)}
    motion_of(dns_body(cube(edge=4), STEEL)[0], STEP)  # compiles
    memories = {name: measure_memory(elements_of(mesh)) for name, mesh in meshes.items()}
    models = {name: model_bytes(mesh) for name, mesh in meshes.items()}
    works, counts = make_sides()
    seconds = turns.measure_in_turns({name: turns.make_batch(work) for name, work in works.items()})
    hexahedra = [name for name in works if counts[name] == counts["dolfinx"]]
    against = {name: turns.speed_ratio(seconds, name, "dolfinx") for name in hexahedra}
    bars = {f"{name} / dolfinx": turns.bar(against[name], limit) for name, limit in BARS.items()}
    bars |= {
        f"{name} bytes an element": turns.bar(max(memories[name].values()), limit, at_least=False)
        for name, limit in BYTES.items()
    }
    results.write_and_print(
        "internal_force",
        {
            "elements": counts,
            "updates_per_second": turns.rates(seconds, counts),
            "ratio_to_dolfinx": against,
            "tetrahedra / petsc_baij": turns.speed_ratio(seconds, "tetrahedra", "petsc_baij_tetrahedra"),
            "bytes_an_element": memories,
            "bytes_an_element_of_the_whole_model": models,
            "bars": bars,
        },
    )


if __name__ == "__main__":
    main()
