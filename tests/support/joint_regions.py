"""Materials of the joint oracle: quadratic hexahedra in DOLFINx forms, elastic or with J2 flow.

The displacement has 27 nodes per (curved) hexahedron, with 27 integration points. Strains are small. The flow is radial
return with linear isotropic hardening, sigma_y = A + B p (Johnson & Cook with n = 1, C = 0), whose closed form has an
exact tangent.
"""

from functools import cached_property

import basix
import dolfinx.fem
import numpy as np
import scipy.sparse
import ufl
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem import dolfinx_api
from reflowshock.materials.parameters import Isotropic, Material

Floats = NDArray[np.float64]
FLAGS = ["-O2", "-march=native"]
DEGREE = 4  # three points along each edge
TINY = 1.0  # Pa; avoids division by zero without stress
AT_POINTS = {"stress": (3, 3), "tangent": (6, 6)}
MATRIX = [0, 3, 5, 3, 1, 4, 5, 4, 2]  # 3 x 3 matrix of the components xx yy zz xy yz xz
ENGINEERING = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
DEVIATOR = np.eye(6)
DEVIATOR[:3, :3] -= 1.0 / 3.0


def stiffness_matrix(material: Material) -> Floats:
    """Return the stiffness of a material, shape (6, 6) [Pa]: xx, yy, zz, xy, yz, xz (engineering shear)."""
    (x, y, z), (xy, yz, xz), shear = material.engineering_constants
    compliance = np.diag([1 / x, 1 / y, 1 / z, *(1 / value for value in shear)])
    compliance[0, 1] = compliance[1, 0] = -xy / x
    compliance[1, 2] = compliance[2, 1] = -yz / y
    compliance[0, 2] = compliance[2, 0] = -xz / x
    return np.linalg.inv(compliance)


def lattice_order() -> NDArray[np.int64]:
    """Return the index in ``joint_patch.Lattice`` of each node of the quadratic DOLFINx hexahedron, shape (27,)."""
    cell, variant = basix.CellType.hexahedron, basix.LagrangeVariant.gll_warped
    places = np.rint(2 * basix.create_element(basix.ElementFamily.P, cell, 2, variant).points).astype(int)
    return places @ [1, 3, 9]


def strain_of(displacement: ufl.core.expr.Expr) -> ufl.core.expr.Expr:
    """Return the strain of a displacement or a test function as a UFL vector, engineering shear in xy, yz, xz last."""
    g = ufl.grad(displacement)
    shear = [g[0, 1] + g[1, 0], g[1, 2] + g[2, 1], g[0, 2] + g[2, 0]]
    return ufl.as_vector([g[0, 0], g[1, 1], g[2, 2], *shear])


def von_mises(stress: Floats) -> Floats:
    """Return von Mises' stress, shape (...) [Pa], of stresses xx, yy, zz, xy, yz, xz, shape (..., 6) [Pa]."""
    deviator = stress @ DEVIATOR
    return np.sqrt(1.5 * np.einsum("...c,...c,c->...", deviator, deviator, ENGINEERING))


class Region:
    """Cells of one elastic material as a DOLFINx mesh, with matrices and forces in the numbering of the patch.

    Stress and strain have the components xx yy zz xy yz xz, shear as engineering strain.

    Attributes:
        dofs: Displacement component of the patch of each degree of freedom, shape (3 m,).
        height: Heights [m] of the cell centres, shape (ne,).
        weight: Weights [m^3] of the integration points, shape (ne, 27).
    """

    def __init__(self, points: Floats, cells: NDArray[np.int64], material: Material) -> None:
        """Build the mesh from cells, shape (ne, 27), and points [m], shape (n, 3), in lattice order."""
        used, number = np.unique(cells[:, lattice_order()], return_inverse=True)
        self.count = 3 * len(points)
        self.mesh = mesh = dolfinx_api.make_mesh(MPI.COMM_SELF, points[used], number.reshape(-1, 27))
        space = dolfinx_api.vector_space(mesh)
        self.displacement, self.test = dolfinx.fem.Function(space), ufl.TestFunction(space)
        self.trial, self.dx = ufl.TrialFunction(space), ufl.dx(domain=mesh, metadata={"quadrature_degree": DEGREE})
        here = used[dolfinx_api.input_nodes(mesh)[dolfinx_api.cell_nodes(mesh)]]
        nodes = np.empty(len(used), np.int64)
        nodes[dolfinx_api.cell_dofs(space)] = here
        self.dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        self.height = points[here].mean(axis=1)[:, 2]
        self.elasticity, self.density = stiffness_matrix(material), material.density
        self._strain = dolfinx_api.at_quadrature_points(mesh, strain_of(self.displacement), DEGREE)
        determinant = dolfinx_api.at_quadrature_points(mesh, ufl.JacobianDeterminant(mesh.ufl_domain()), DEGREE)
        self.weight = np.abs(determinant()) * basix.make_quadrature(basix.CellType.hexahedron, DEGREE)[1]

    def among_all(self, form: ufl.Form) -> scipy.sparse.csr_matrix:
        """Return a bilinear form as a matrix of all components of the patch."""
        matrix = dolfinx_api.assembled_csr(dolfinx_api.compiled_form(form, FLAGS)).tocoo()
        row_and_column = self.dofs[matrix.row], self.dofs[matrix.col]
        return scipy.sparse.coo_matrix((matrix.data, row_and_column), shape=(self.count, self.count)).tocsr()

    @cached_property
    def mass(self) -> scipy.sparse.csr_matrix:
        """Return the consistent mass matrix [kg]."""
        density = dolfinx.fem.Constant(self.mesh, self.density)
        return self.among_all(density * ufl.inner(self.trial, self.test) * self.dx)

    @cached_property
    def stiffness(self) -> scipy.sparse.csr_matrix:
        """Return the elastic stiffness [N/m]."""
        elasticity = dolfinx.fem.Constant(self.mesh, self.elasticity)
        return self.among_all(ufl.inner(elasticity * strain_of(self.trial), strain_of(self.test)) * self.dx)

    def tangent(self) -> scipy.sparse.csr_matrix:
        """Return the derivative [N/m] of the latest force."""
        return self.stiffness

    def force(self, displacement: Floats) -> Floats:
        """Return the internal force of all components ``(3 n,)`` [N] at a displacement ``(3 n,)`` [m]."""
        return self.stiffness @ displacement

    def strain(self, displacement: Floats) -> Floats:
        """Return the strains at the integration points, ``(ne, 27, 6)``."""
        self.displacement.x.array[:] = displacement[self.dofs]
        return self._strain().reshape(*self.weight.shape, 6)

    def values(self, displacement: Floats) -> dict[str, Floats]:
        """Return the measures of layers at the integration points, shape (ne, 27) [Pa, J/m^3]."""
        return {"von_mises": von_mises(self.strain(displacement) @ self.elasticity)}

    def means(self, values: dict[str, Floats], within: tuple[float, float]) -> dict[str, float]:
        """Return means of values over the volume between two heights [m]."""
        chosen = (self.height > within[0]) & (self.height < within[1])
        weight = self.weight[chosen]
        return {name: float(np.average(value[chosen], weights=weight)) for name, value in values.items()}

    def settle(self) -> None:
        """Accept the latest displacement as a finished step."""


class YieldingRegion(Region):
    """Yielding cells with radial return from the plastic strain of the latest finished step."""

    def __init__(self, points: Floats, cells: NDArray[np.int64], material: Material) -> None:
        """Build cells as in ``Region``, without plastic strain."""
        assert isinstance(material, Isotropic) and material.plasticity
        assert material.plasticity.n == 1.0 and not material.plasticity.C
        super().__init__(points, cells, material)
        self._shear, self._law = material.shear_modulus, (material.plasticity.A, material.plasticity.B)
        self._state = {"strain": np.zeros((*self.weight.shape, 6)), "equivalent": np.zeros(self.weight.shape)}
        self._new, self._latest = self._state, (np.empty(0), np.empty(0))
        spaces = {name: dolfinx_api.quadrature_space(self.mesh, DEGREE, shape) for name, shape in AT_POINTS.items()}
        self._fields = {name: dolfinx.fem.Function(space) for name, space in spaces.items()}
        form = ufl.inner(self._fields["stress"], ufl.grad(self.test)) * self.dx
        self._force = dolfinx_api.compiled_form(form, FLAGS)

    def force(self, displacement: Floats) -> Floats:
        """Return the internal force of all components ``(3 n,)`` [N] at a displacement ``(3 n,)`` [m]."""
        self._latest = self._returned(self.strain(displacement))
        self._set("stress", self._latest[0][..., MATRIX])
        local_force, result = np.zeros(len(self.dofs)), np.zeros(self.count)
        dolfinx.fem.assemble_vector(local_force, self._force)
        result[self.dofs] = local_force
        return result

    def tangent(self) -> scipy.sparse.csr_matrix:
        """Return the derivative [N/m] of the latest force."""
        self._set("tangent", self._latest[1])
        stress_change = ufl.dot(self._fields["tangent"], strain_of(self.trial))
        return self.among_all(ufl.inner(stress_change, strain_of(self.test)) * self.dx)

    def _set(self, name: str, values: Floats) -> None:
        field = self._fields[name]
        blocks = field.x.array.reshape(-1, int(np.prod(AT_POINTS[name])))
        blocks[dolfinx_api.cell_dofs(field.function_space)] = values.reshape(*self.weight.shape, -1)

    def _returned(self, strain: Floats) -> tuple[Floats, Floats]:
        """Return stress ``(ne, 27, 6)`` [Pa] and consistent tangent ``(ne, 27, 6, 6)`` of a strain.

        Simo & Hughes, Computational Inelasticity, 1998, section 3.3.
        """
        (start, hardening), shear = self._law, self._shear
        trial = (strain - self._state["strain"]) @ self.elasticity
        mises, deviator = np.maximum(von_mises(trial), TINY), trial @ DEVIATOR
        excess = mises - start - hardening * self._state["equivalent"]
        flow = np.maximum(excess, 0.0) / (3.0 * shear + hardening)
        direction = 1.5 * deviator / mises[..., None]
        self._new = {
            "strain": self._state["strain"] + flow[..., None] * direction * ENGINEERING,
            "equivalent": self._state["equivalent"] + flow,
        }
        share = 3.0 * shear * flow / mises
        bent = np.where(flow > 0.0, 3.0 * shear / (3.0 * shear + hardening) - share, 0.0) * 4.0 * shear / 3.0
        tangent = self.elasticity - 2.0 * shear * share[..., None, None] * (DEVIATOR / ENGINEERING)
        tangent = tangent - bent[..., None, None] * direction[..., :, None] * direction[..., None, :]
        return trial - 2.0 * shear * flow[..., None] * direction, tangent

    def values(self, displacement: Floats) -> dict[str, Floats]:
        """Return the measures of layers at the integration points, shape (ne, 27) [Pa, J/m^3]."""
        stress, _ = self._returned(self.strain(displacement))
        (start, hardening), plastic = self._law, self._new["equivalent"]
        work = start * plastic + 0.5 * hardening * plastic**2
        return {"von_mises": von_mises(stress), "plastic_strain": plastic, "plastic_work": work}

    def settle(self) -> None:
        """Accept the plastic strains of the latest displacement."""
        self._state = self._new
