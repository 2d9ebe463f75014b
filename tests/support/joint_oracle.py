"""An oracle for a joint's numbers: quadratic hexahedra in DOLFINx forms, J2 flow, Newton's method, HHT-alpha steps.

It shares no element, tie, time step or measure with the program, only the scene (``joint_patch.py``) and what hides
the versions of DOLFINx. The displacement has 27 nodes a hexahedron, on curved ones, with 27 integration points.
Strains are small. The flow is radial return with isotropic, linear hardening, sigma_y = A + B p (Johnson & Cook with
n = 1, C = 0), whose closed form has an exact tangent by differentiation.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import basix
import dolfinx.fem
import numpy as np
import scipy.sparse
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from reflowshock.fem import dolfinx_api
from reflowshock.fem.materials.parameters import Isotropic, Material
from tests.support.joint_patch import JointPatch, Lattice

Floats = NDArray[np.float64]
FLAGS = ["-O2", "-march=native"]
DEGREE = 4  # three points along each edge
LAYERS = (12.5e-6, 25e-6, 50e-6)
TOLERANCE, TRIALS = 1e-6, 15
TINY = 1.0  # Pa: there is no direction of flow where there is no stress
AT_POINTS = {"stress": (3, 3), "tangent": (6, 6)}
MATRIX = [0, 3, 5, 3, 1, 4, 5, 4, 2]  # of the components xx yy zz xy yz xz
ENGINEERING = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
DEVIATOR = np.eye(6)
DEVIATOR[:3, :3] -= 1.0 / 3.0
ORIENTATION = {"foot": -1.0, "head": 1.0}


def stiffness_matrix(material: Material) -> Floats:
    """Return C ``(6, 6)`` [Pa] of strains xx yy zz xy yz xz, shear as engineering strain, from the nine constants."""
    (x, y, z), (xy, yz, xz), shear = material.engineering_constants
    compliance = np.diag([1 / x, 1 / y, 1 / z, *(1 / value for value in shear)])
    compliance[0, 1] = compliance[1, 0] = -xy / x
    compliance[1, 2] = compliance[2, 1] = -yz / y
    compliance[0, 2] = compliance[2, 0] = -xz / x
    return np.linalg.inv(compliance)


def lattice_order() -> NDArray[np.int64]:
    """Return the place in ``joint_patch.Lattice`` of each node of DOLFINx's quadratic hexahedron: ``(27,)``."""
    cell, variant = basix.CellType.hexahedron, basix.LagrangeVariant.gll_warped
    places = np.rint(2 * basix.create_element(basix.ElementFamily.P, cell, 2, variant).points).astype(int)
    return places @ [1, 3, 9]


def strain_of(displacement: ufl.core.expr.Expr) -> ufl.core.expr.Expr:
    """Return the strain (6,), xx yy zz xy yz xz, of a displacement or a test function."""
    g = ufl.grad(displacement)
    shear = [g[0, 1] + g[1, 0], g[1, 2] + g[2, 1], g[0, 2] + g[2, 0]]
    return ufl.as_vector([g[0, 0], g[1, 1], g[2, 2], *shear])


def von_mises(stress: Floats) -> Floats:
    """Return von Mises' stress ``(...)`` of stresses ``(..., 6)``."""
    deviator = stress @ DEVIATOR
    return np.sqrt(1.5 * np.einsum("...c,...c,c->...", deviator, deviator, ENGINEERING))


class Region:
    """Cells of one elastic material as a mesh of DOLFINx's, and their matrices and forces among all nodes.

    Stress and strain have the components xx yy zz xy yz xz, shear as engineering strain.

    Attributes:
        dofs: ``(3 m,)`` displacement component of the patch that each degree of freedom is.
        height: ``(ne,)`` [m] of the cells' centres.
        weight: ``(ne, 27)`` [m^3] of the integration points.
    """

    def __init__(self, points: Floats, cells: NDArray[np.int64], material: Material) -> None:
        """Take cells ``(ne, 27)`` of points ``(n, 3)`` [m] in lattice order."""
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
        place = self.dofs[matrix.row], self.dofs[matrix.col]
        return scipy.sparse.coo_matrix((matrix.data, place), shape=(self.count, self.count)).tocsr()

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
        """Return what layers are judged by at the integration points, ``(ne, 27)``: Pa, J/m^3."""
        return {"von_mises": von_mises(self.strain(displacement) @ self.elasticity)}

    def means(self, values: dict[str, Floats], within: tuple[float, float]) -> dict[str, float]:
        """Return means of values over the volume between two heights [m]."""
        chosen = (self.height > within[0]) & (self.height < within[1])
        weight = self.weight[chosen]
        return {name: float(np.average(value[chosen], weights=weight)) for name, value in values.items()}

    def settle(self) -> None:
        """Take the latest displacement as that of a finished step."""


class YieldingRegion(Region):
    """Cells that yield, by radial return from the plastic strain that the latest finished step has left."""

    def __init__(self, points: Floats, cells: NDArray[np.int64], material: Material) -> None:
        """Take cells as ``Region``, without plastic strain."""
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
        own, result = np.zeros(len(self.dofs)), np.zeros(self.count)
        dolfinx.fem.assemble_vector(own, self._force)
        result[self.dofs] = own
        return result

    def tangent(self) -> scipy.sparse.csr_matrix:
        """Return the derivative [N/m] of the latest force."""
        self._set("tangent", self._latest[1])
        own = ufl.dot(self._fields["tangent"], strain_of(self.trial))
        return self.among_all(ufl.inner(own, strain_of(self.test)) * self.dx)

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
        """Return what layers are judged by at the integration points, ``(ne, 27)``: Pa, J/m^3."""
        stress, _ = self._returned(self.strain(displacement))
        (start, hardening), plastic = self._law, self._new["equivalent"]
        work = start * plastic + 0.5 * hardening * plastic**2
        return {"von_mises": von_mises(stress), "plastic_strain": plastic, "plastic_work": work}

    def settle(self) -> None:
        """Take the plastic strains of the latest displacement."""
        self._state = self._new


class Patch:
    """The regions of a patch, what is held and moved, and the measures of its joint."""

    def __init__(self, patch: JointPatch, lattice: Lattice, yields: bool) -> None:
        """Take a quadratic mesh; without ``yields`` the solder is elastic."""
        self.patch, self.points, kind = patch, lattice.points, {"solder": YieldingRegion} if yields else {}
        self.regions = {
            part: kind.get(part, Region)(lattice.points, cells, patch.materials[part])
            for part, cells in lattice.cells.items()
        }
        x, y, z = self.points.T
        near = 1e-6 * patch.side
        outside = np.abs(np.abs(x) - 0.5 * patch.side) < near
        moved = outside & (x > 0) & (z < near)
        held = np.repeat(outside[:, None], 3, axis=1)
        held[:, 1] |= y < near
        self.free = np.flatnonzero(~held.ravel())
        self.full = (moved[:, None] * patch.full_motion).ravel()
        self.ends = {
            end: np.flatnonzero(
                (np.abs(z - patch.faces[k]) < near) & np.isin(np.arange(len(z)), lattice.cells["copper"])
            )
            for end, k in (("foot", 0), ("head", 3))
        }

    def force(self, displacement: Floats) -> Floats:
        """Return the internal force ``(3 n,)`` [N]."""
        return sum(region.force(displacement) for region in self.regions.values())

    @cached_property
    def yielding(self) -> list[YieldingRegion]:
        """Return the regions whose tangent changes."""
        return [region for region in self.regions.values() if isinstance(region, YieldingRegion)]

    @cached_property
    def _constant(self) -> scipy.sparse.csr_matrix:
        return sum(region.stiffness for region in self.regions.values() if region not in self.yielding)

    def tangent(self) -> scipy.sparse.csr_matrix:
        """Return the tangent [N/m] of all components at the latest displacement."""
        return sum((region.tangent() for region in self.yielding), self._constant)

    @cached_property
    def mass(self) -> scipy.sparse.csr_matrix:
        """Return the mass matrix [kg] of all components."""
        return sum(region.mass for region in self.regions.values())

    def settle(self) -> None:
        """Finish a step."""
        for region in self.regions.values():
            region.settle()

    def measures(self, displacement: Floats, acceleration: Floats | None = None) -> dict[str, float]:
        """Return section resultants and layer averages of the whole joint (both halves), SI; call before ``settle``.

        ``axial@foot`` and ``shear@foot`` [N] are the forces that pull and shear the joint, ``moment@foot`` [N m] is
        that about y through the pad's centre, ``peel@foot`` [Pa] the mean normal traction.
        """
        joint = [self.regions[part] for part in ("copper", "solder")]
        force = sum(region.force(displacement) for region in joint)
        if acceleration is not None:
            force = force + sum(region.mass for region in joint) @ acceleration
        result = {}
        for end, nodes in self.ends.items():
            on_end = 2.0 * ORIENTATION[end] * force.reshape(-1, 3)[nodes]
            axial = float(on_end[:, 2].sum())
            result[f"axial@{end}"], result[f"shear@{end}"] = axial, float(on_end[:, 0].sum())
            result[f"moment@{end}"] = -float(self.points[nodes, 0] @ on_end[:, 2])
            result[f"peel@{end}"] = axial / self.patch.pad_area
        _, low, high, _ = self.patch.faces
        solder = self.regions["solder"]
        values = solder.values(displacement)
        for depth in LAYERS:
            for end, within in (("foot", (low, low + depth)), ("head", (high - depth, high))):
                means = solder.means(values, within)
                result |= {f"{name}@{end}:{1e6 * depth:g}um": value for name, value in means.items()}
        return result


class Factor:
    """Solves with a symmetric matrix by MUMPS."""

    def __init__(self, matrix: scipy.sparse.csr_matrix) -> None:
        """Factor the matrix."""
        arrays = matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data
        self._matrix = PETSc.Mat().createAIJ(size=matrix.shape, csr=arrays, comm=MPI.COMM_SELF)
        self._matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self._solver = PETSc.KSP().create(MPI.COMM_SELF)
        self._solver.setOperators(self._matrix)
        self._solver.setType("preonly")
        self._solver.getPC().setType("cholesky")
        self._solver.getPC().setFactorSolverType("mumps")
        self._solver.setUp()

    def solve(self, right: Floats) -> Floats:
        """Return the solution."""
        given, solution = self._matrix.createVecs()
        given.array = right
        self._solver.solve(given, solution)
        found = solution.array.copy()
        given.destroy(), solution.destroy()
        return found

    def free(self) -> None:
        """Give the memory back."""
        self._solver.destroy()
        self._matrix.destroy()


class Newton:
    """Newton's method for c M u + k f(u) = right on the free components; a constant matrix is factored once.

    Attributes:
        patch: The patch.
        weights: c [1/s^2] of the mass, k of the internal force.
    """

    def __init__(self, patch: Patch, weights: tuple[float, float]) -> None:
        """Take a patch and the weights."""
        self.patch, self.weights = patch, weights
        self._factor: Factor | None = None

    def solve(self, start: Floats, boundary: Floats, right: Floats) -> tuple[Floats, Floats]:
        """Return displacement and internal force ``(3 n,)``.

        Args:
            start: ``(3 n,)`` [m] first guess.
            boundary: ``(3 n,)`` [m], the displacement where it is prescribed.
            right: ``(3 n,)`` [N].

        Raises:
            RuntimeError: No convergence.
        """
        patch, free = self.patch, self.patch.free
        force = patch.force(start)
        matrix = self._matrix()
        change = boundary - start
        change[free] = 0.0
        # The boundary's part in the first step is linear, too: moving it alone would crush the cells beside it.
        residual = self._residual(start, force, right) + matrix @ change
        moved = start + change
        for _ in range(TRIALS):
            moved[free] -= self._factored(matrix).solve(residual[free])
            force = patch.force(moved)
            residual = self._residual(moved, force, right)
            scale = float(np.abs(force).max())
            if np.abs(residual[free]).max() < TOLERANCE * scale:
                return moved, force
            matrix = self._matrix()
        raise RuntimeError(f"Newton's method has not converged in {TRIALS} trials")

    def _residual(self, displacement: Floats, force: Floats, right: Floats) -> Floats:
        mass, internal = self.weights
        inertia = mass * (self.patch.mass @ displacement) if mass else 0.0
        return inertia + internal * force - right

    @cached_property
    def _inertia(self) -> scipy.sparse.csr_matrix:
        return self.weights[0] * self.patch.mass

    def _matrix(self) -> scipy.sparse.csr_matrix:
        if self._factor and not self.patch.yielding:
            return self._constant
        self._constant = self.weights[1] * self.patch.tangent()
        if self.weights[0]:
            self._constant = self._constant + self._inertia
        return self._constant

    def _factored(self, matrix: scipy.sparse.csr_matrix) -> Factor:
        if self._factor and not self.patch.yielding:
            return self._factor
        if self._factor:
            self._factor.free()
        self._factor = Factor(matrix[self.patch.free][:, self.patch.free])
        return self._factor


def equilibrium(patch: Patch, steps: int = 1) -> list[dict[str, float]]:
    """Return the measures at equal shares of the full motion, at rest."""
    displacement, nothing, found = np.zeros(len(patch.full)), np.zeros(len(patch.full)), []
    newton = Newton(patch, (0.0, 1.0))
    for step in range(1, steps + 1):
        displacement, _ = newton.solve(displacement, step / steps * patch.full, nothing)
        found.append(patch.measures(displacement))
        patch.settle()
    return found


@dataclass(frozen=True, slots=True)
class Motion:
    """The motion of the moved side: its full motion times ``share``, from rest.

    Attributes:
        share: Time [s] -> share of the full motion.
        acceleration: Time [s] -> its second derivative [1/s^2].
    """

    share: Callable[[float], float]
    acceleration: Callable[[float], float]


def haversine(duration: float) -> Motion:
    """Return the motion there and back, sin^2(pi t / T) of the full one, over a duration [s]."""
    rate = np.pi / duration
    return Motion(lambda time: np.sin(rate * time) ** 2, lambda time: 2.0 * rate**2 * np.cos(2.0 * rate * time))


def steps_in_time(
    patch: Patch, motion: Motion, step: float, count: int, alpha: float = -0.05
) -> list[dict[str, float]]:
    """Return the measures after each of ``count`` steps of the HHT method, beginning at rest.

        M a' + (1 + alpha) f(u') - alpha f(u) = 0,  u' = u + h v + h^2 ((1/2 - beta) a + beta a'),
        beta = (1 - alpha)^2 / 4,  gamma = 1/2 - alpha          (Hilber, Hughes & Taylor, EESD 5, 1977)

    Args:
        patch: The patch, at rest.
        motion: Of its moved side.
        step: h [s].
        count: Number of steps.
        alpha: From -1/3 to 0.
    """
    beta, gamma = 0.25 * (1.0 - alpha) ** 2, 0.5 - alpha
    inertia = 1.0 / (beta * step**2)
    newton, mass = Newton(patch, (inertia, 1.0 + alpha)), patch.mass
    displacement, velocity, force = np.zeros((3, len(patch.full)))
    acceleration = motion.acceleration(0.0) * patch.full
    acceleration[patch.free] = _first_acceleration(patch, acceleration)
    found = []
    for number in range(1, count + 1):
        time = number * step
        guess = displacement + step * velocity + (0.5 - beta) * step**2 * acceleration
        right = inertia * (mass @ guess) + alpha * force
        # The prescribed acceleration enters by M; the guess of its displacement is chosen so that u' gives it.
        boundary, given = motion.share(time) * patch.full, motion.acceleration(time) * patch.full
        shift = inertia * (boundary - guess) - given
        shift[patch.free] = 0.0
        right += mass @ shift
        displacement, force = newton.solve(displacement, boundary, right)
        new = inertia * (displacement - guess) - shift
        velocity = velocity + step * ((1.0 - gamma) * acceleration + gamma * new)
        acceleration = new
        found.append({"time": time, **patch.measures(displacement, acceleration)})
        patch.settle()
    return found


def _first_acceleration(patch: Patch, acceleration: Floats) -> Floats:
    """Return the acceleration of the free components at rest where the others ``(3 n,)`` [m/s^2] begin to move."""
    given = acceleration.copy()
    given[patch.free] = 0.0
    factor = Factor(patch.mass[patch.free][:, patch.free])
    found = factor.solve(-(patch.mass @ given)[patch.free])
    factor.free()
    return found
