"""Tetrahedra against the same linear form assembled by DOLFINx."""

import dolfinx.fem
import dolfinx.fem.petsc
import numpy as np
import pytest
import ufl
from mpi4py import MPI

from reflowshock.cases.hard.trials.boxes import KINDS, box, elements_of, stiffness_matrix
from reflowshock.fem import dolfinx_api
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4

RANDOM = np.random.default_rng(0)


@pytest.mark.parametrize("name", ["tetrahedron", "tetrahedron_quadratic"])
def test_internal_force_equals_that_of_dolfinx(name):
    line = np.linspace(0, 1, 3)
    points, cells = box(KINDS[name], line, line, line, move=lambda p: p + RANDOM.uniform(-0.05, 0.05, p.shape))
    displacement = RANDOM.uniform(-1, 1, points.shape)
    ours = (stiffness_matrix(elements_of(KINDS[name], points, cells, [FR4])) @ displacement.ravel()).reshape(-1, 3)

    mesh = dolfinx_api.make_mesh(MPI.COMM_SELF, points, cells)
    space = dolfinx_api.vector_space(mesh)
    field, test = dolfinx.fem.Function(space), ufl.TestFunction(space)
    dofs, nodes = dolfinx_api.cell_dofs(space), dolfinx_api.input_nodes(mesh)[dolfinx_api.cell_nodes(mesh)]
    field.x.array.reshape(-1, 3)[dofs] = displacement[nodes]
    elasticity = ufl.as_matrix(elasticity_matrix(FR4).tolist())

    def strain(u):
        e = ufl.sym(ufl.grad(u))
        return ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[0, 2]])

    work = ufl.inner(elasticity * strain(field), strain(test)) * ufl.dx(metadata={"quadrature_degree": 2})
    force = dolfinx.fem.petsc.assemble_vector(dolfinx.fem.form(work)).array.reshape(-1, 3)
    theirs = np.empty_like(ours)
    theirs[nodes] = force[dofs]
    assert np.abs(ours - theirs).max() < 1e-13 * np.abs(theirs).max()
