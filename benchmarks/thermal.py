"""Warpage of a heated package: error against cost of the program's hexahedra and of DOLFINx elements.

    PYTHONPATH=. python benchmarks/thermal.py [--quick]   (one core, a minute or two; writes results/thermal.json)

The package of bga_drop (quarter: FR4 11 x 11 x 0.4 mm under silicon 8 x 8 x 0.4 mm) is heated by 175 K. Errors are of
the corner height over the centre, against quadratic hexahedra (27 nodes) on the finest mesh.
``meshes``: kind x cells x layers: ``incompatible_modes`` by this program, ``trilinear`` and ``quadratic`` assembled by
DOLFINx from UFL forms as independent codes. Times are processor seconds from the mesh to the solution.
``boards``: the same package above a whole board: cells, factor, memory, seconds and gaps.
"""

import argparse
import os
import tempfile
from pathlib import Path
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import dolfinx.fem.petsc
import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from benchmarks.support import results
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem import dolfinx_api
from reflowshock.fem.mesh.mesh import MeshData, append, without_unused_nodes
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.pads import Pads
from reflowshock.fem.statics.state import Assembly
from reflowshock.fem.statics.structure import ThermalStructure
from reflowshock.fem.statics.thermal_tables import thermal_tables
from reflowshock.fem.statics.thermoelastic import Thermoelastic
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4, SILICON
from reflowshock.materials.roles import ELASTIC
from reflowshock.meshing.board.assembly import write_assembly, write_heated_assembly
from reflowshock.meshing.board.pads import pad_table
from reflowshock.workflow.pipeline.reader import read_case

NAME = "thermal"
CASE = Path(__file__).parents[1] / "cases" / "bga_drop" / "case.toml"
RISE, SUBSTRATE, DIE, THICKNESS = 175.0, 5.5e-3, 4e-3, 0.4e-3

MESHES = {
    "trilinear": [(11, 1), (11, 2), (22, 2), (22, 4), (44, 4)],
    "incompatible_modes": [(11, 1), (11, 2), (22, 1), (22, 2), (22, 4), (44, 4)],
    "quadratic": [(11, 1), (11, 2)],
}
REFERENCE = (22, 3)
BOARDS = {"as meshed for the shock, 0.5 mm": 0.5e-3, "as meshed for the shock, 2 mm": 2e-3, "heated": None}


def mesh_package(cells: int, layers: int) -> MeshData:
    """Return the quarter package in hexahedra: ``cells`` along the substrate, ``layers`` through each layer."""
    x = np.linspace(0.0, SUBSTRATE, cells + 1)
    points, hexahedra = grid(x, x, np.linspace(0.0, 2.0 * THICKNESS, 2 * layers + 1))
    centre = points[hexahedra].mean(axis=1)
    upper = centre[:, 2] > THICKNESS
    is_filled = ~upper | (centre[:, :2] < DIE).all(axis=1)
    part = np.where(upper, "die", "substrate")[is_filled]
    planes = {"symmetry_x": on(0, 0.0), "symmetry_y": on(1, 0.0), "package_side": on(2, 0.0)}
    return without_unused_nodes(mesh_of(points, hexahedra[is_filled], part, planes))[0]


def warpage(points: np.ndarray, displacement: np.ndarray) -> float:
    """Return the rise of the corner of the package's lower face over its centre [m].

    Args:
        points: Nodes, shape (n, 3) [m].
        displacement: Displacements of the nodes, shape (n, 3) [m].
    """
    ends = [np.argmin(np.linalg.norm(points - corner, axis=1)) for corner in ([SUBSTRATE, SUBSTRATE, 0.0], [0.0] * 3)]
    return float(displacement[ends[0], 2] - displacement[ends[1], 2])


def solve_by_program(mesh: MeshData) -> tuple[float, dict]:
    """Heat a package in the program's hexahedra, with a detached cell of board that the program requires.

    Args:
        mesh: Quarter of the package.

    Returns:
        Warpage [m], and the costs ``equations`` and ``factor_bytes``.
    """
    board = mesh_of(*grid([0.0, SUBSTRATE], [0.0, SUBSTRATE], [-2e-3, -1e-3]), "board", {"symmetry_x": on(0, 0.0)})
    both = append([board, mesh])
    model = Thermoelastic(MPI.COMM_SELF, both, thermal_tables(both, np.zeros(3)), ELASTIC)
    moved = np.empty_like(both.points)
    moved[model.body.local.nodes] = RISE * model.displacement(model.expansion)
    costs = {"equations": model.equations, "factor_bytes": model.cost.memory}
    return warpage(mesh.points, moved[len(board.points) :]), costs


def solve_by_dolfinx(mesh: MeshData, degree: int) -> tuple[float, dict]:
    """Heat a package in Lagrange hexahedra of a polynomial degree that DOLFINx assembles.

    Args:
        mesh: Quarter of the package.
        degree: Polynomial degree of the elements.

    Returns:
        Warpage [m], and the costs ``equations`` and ``factor_bytes``.
    """
    domain = dolfinx_api.make_mesh(MPI.COMM_SELF, mesh.points, mesh.cells)
    kind = ("Lagrange", degree)
    old = dolfinx_api.OLD
    space = dolfinx.fem.VectorFunctionSpace(domain, kind) if old else dolfinx.fem.functionspace(domain, (*kind, (3,)))
    in_die = dolfinx.fem.Function(dolfinx_api.cell_space(domain))
    in_die.x.array[:] = mesh.part[dolfinx_api.input_cells(domain)] == mesh.part_names.index("die")
    trial, test, quadrature = ufl.TrialFunction(space), ufl.TestFunction(space), {"quadrature_degree": 2 * degree}
    work, load = 0.0, 0.0
    for share, material in ((in_die, SILICON), (1.0 - in_die, FR4)):
        elasticity = ufl.as_matrix(elasticity_matrix(material).tolist())
        free = ufl.as_vector([RISE * value for value in material.expansion] + [0.0] * 3)
        work += share * ufl.inner(elasticity * strain(trial), strain(test)) * ufl.dx(metadata=quadrature)
        load += share * ufl.inner(elasticity * free, strain(test)) * ufl.dx(metadata=quadrature)
    held = symmetry_conditions(domain, space)
    matrix = dolfinx.fem.petsc.assemble_matrix(dolfinx.fem.form(work), held)
    matrix.assemble()
    right = dolfinx.fem.petsc.assemble_vector(dolfinx.fem.form(load))
    dolfinx.fem.petsc.set_bc(right, held)
    solution, factor = right.duplicate(), Factorisation(matrix)
    factor.solve(right, solution)
    warpage_value = warpage(space.tabulate_dof_coordinates(), solution.array.reshape(-1, 3))
    return warpage_value, {"equations": matrix.size[0], "factor_bytes": factor.cost.memory}


def strain(field: ufl.core.expr.Expr) -> ufl.core.expr.Expr:
    """Return the strain of a displacement as a UFL vector: xx, yy, zz, xy, yz, xz with engineering shear."""
    e = ufl.sym(ufl.grad(field))
    return ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[0, 2]])


def symmetry_conditions(domain: dolfinx.mesh.Mesh, space: dolfinx.fem.FunctionSpace) -> list:
    """Return the DOLFINx boundary conditions of the planes x = 0 and y = 0, and of the fixed height of the origin."""
    held = []
    for axis in range(3):
        part = space.sub(axis).collapse()[0]
        tests = [
            lambda x: np.isclose(x[0], 0.0),
            lambda x: np.isclose(x[1], 0.0),
            lambda x: np.isclose(x, 0.0).all(axis=0),
        ]
        dofs = dolfinx.fem.locate_dofs_geometrical((space.sub(axis), part), tests[axis])
        value = dolfinx.fem.Function(part)
        held.append(dolfinx.fem.dirichletbc(value, dofs, space.sub(axis)))
    return held


SOLVERS = {
    "incompatible_modes": solve_by_program,
    "trilinear": lambda mesh: solve_by_dolfinx(mesh, 1),
    "quadratic": lambda mesh: solve_by_dolfinx(mesh, 2),
}


def solve_on_mesh(kind: str, cells: int, layers: int) -> dict:
    """Heat the package on one mesh.

    Args:
        kind: Kind of element, a key of ``SOLVERS``.
        cells: Number of cells along the substrate.
        layers: Number of cells through substrate and die each.

    Returns:
        ``kind``, ``cells``, ``layers``, ``warpage_um``, ``seconds`` (processor time), ``equations`` and
        ``factor_bytes``.
    """
    mesh = mesh_package(cells, layers)
    begin = process_time()
    warpage_value, costs = SOLVERS[kind](mesh)
    seconds = process_time() - begin
    return {
        "kind": kind,
        "cells": cells,
        "layers": layers,
        "warpage_um": 1e6 * warpage_value,
        "seconds": seconds,
        **costs,
    }


def compare_meshes(quick: bool) -> list[dict]:
    """Return the rows of ``solve_on_mesh`` of every kind and mesh with their relative ``error``, the reference last.

    Fewer meshes are solved if ``quick``.
    """
    for kind in SOLVERS:
        solve_on_mesh(kind, 5, 1)  # compiles
    exact = solve_on_mesh("quadratic", *((11, 2) if quick else REFERENCE))
    rows = []
    for kind, sizes in MESHES.items():
        for cells, layers in sizes[: 3 if quick else None]:
            row = solve_on_mesh(kind, cells, layers)
            row["error"] = row["warpage_um"] / exact["warpage_um"] - 1.0
            print(
                "{kind:>18} {cells:3} x {layers} {equations:7} equations {seconds:7.2f} s  {error:+.2e}".format(**row)
            )
            rows.append(row)
    return [*rows, exact]


def compare_boards(quick: bool) -> list[dict]:
    """Return the rows ``board``, ``elements`` and figures of ``measure_board`` of boards of different mesh size.

    The finest board is left out if ``quick``.
    """
    case = read_case(CASE, ['warpage.corner="0 mm"', "board.numerics.layers=6"], oversubscribe=True)
    pads = pads_of(pad_table(case.package, case.board, case.warpage))
    rows = []
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "assembly.msh"
        for name, size in list(BOARDS.items())[1 if quick else 0 :]:
            numerics = case.board.numerics.model_copy(update={"coarse_size": size or case.board.numerics.coarse_size})
            board = case.board.model_copy(update={"numerics": numerics})
            write = write_assembly if size else write_heated_assembly
            elements = sum(write(case.package, board, path).values())
            rows.append(
                {"board": name, "elements": elements} | measure_board(Assembly(path, pads, ELASTIC, Thermal(), 9.81))
            )
            print(
                "{board:>32} {elements:7} elements {equations:7} equations {factor_mb:6.0f} MB".format(**rows[-1]),
                end=" ",
            )
            print("{build_seconds:6.1f} s + {solve_seconds:.3f} s, corner {corner_gap_um:.4f} um".format(**rows[-1]))
    return rows


def pads_of(sites: list) -> Pads:
    """Return names, positions [m] and wetted radii [m] of the pads in a table of ``PadSite``, for the thermal model."""
    lower = np.array([(site.x, site.y, site.z_board) for site in sites])
    upper = lower + np.array([(0.0, 0.0, site.gap) for site in sites])
    radii = np.array([(site.wetted_radius_board, site.wetted_radius_package) for site in sites])
    return Pads([site.name for site in sites], np.stack([lower, upper], axis=1), radii)


def measure_board(assembly: Assembly) -> dict:
    """Assemble a heated package on its board and solve it with random wrenches on the pads.

    Args:
        assembly: Mesh file, pads, materials and heating.

    Returns:
        ``equations``, ``factor_mb``, ``factor_operations``, ``build_seconds``, ``solve_seconds``, and
        ``corner_gap_um``, by which heating without wrenches opens the gap of the corner joint.
    """
    begin = process_time()
    structure = ThermalStructure.build(MPI.COMM_SELF, assembly)
    built = process_time()
    count = len(assembly.pads.names)
    wrenches = 1e-4 * np.random.default_rng(0).normal(size=(count, 2, 6)) * ([1.0] * 3 + [1e-4] * 3)
    structure.solve(298.15 + RISE, 0.0, wrenches, np.zeros(1))
    done = process_time()
    motion = structure.solve(298.15 + RISE, 0.0, 0.0 * wrenches, np.zeros(1)).pad_motion
    gap = motion[:, 1, 2] - motion[:, 0, 2]
    return {
        "equations": structure.equations,
        "factor_mb": 1e-6 * structure.cost.memory,
        "factor_operations": structure.cost.operations,
        "build_seconds": built - begin,
        "solve_seconds": done - built,
        "corner_gap_um": 1e6 * float(gap[list(assembly.pads.names).index("A10")]),
    }


def main() -> None:
    """Run both tables and store the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer and smaller meshes")
    quick = parser.parse_args().quick
    print(f"PETSc {PETSc.Sys.getVersion()}, DOLFINx {dolfinx.__version__}, one core")
    tables = {"meshes": compare_meshes(quick), "boards": compare_boards(quick)}
    results.write_figures(NAME, tables)


if __name__ == "__main__":
    main()
