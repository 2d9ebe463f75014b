"""Independent oracle for joint measures: materials of ``joint_regions.py``, Newton's method, HHT-alpha steps.

It shares no element, tie, time step or measure with the program, only the scene (``joint_patch.py``) and the adapter to
DOLFINx versions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse
from mpi4py import MPI
from petsc4py import PETSc

from tests.support.joint_patch import JointPatch, Lattice
from tests.support.joint_regions import Floats, Region, YieldingRegion

LAYERS = (12.5e-6, 25e-6, 50e-6)
TOLERANCE, TRIALS = 1e-6, 15
ORIENTATION = {"foot": -1.0, "head": 1.0}


class Patch:
    """Regions of a patch, their supports and motion, and the measures of its joint."""

    def __init__(self, patch: JointPatch, lattice: Lattice, yields: bool) -> None:
        """Build the regions of a quadratic mesh; without ``yields`` the solder is elastic."""
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
        """Regions with a changing tangent."""
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
        """Return section resultants and layer averages of the whole joint in SI units; call before ``settle``.

        ``axial@foot`` and ``shear@foot`` [N] are the normal and tangential section forces, ``moment@foot`` [N m] is the
        moment about y through the centre of the pad, ``peel@foot`` [Pa] the mean normal traction.
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
    """MUMPS factorisation of a symmetric matrix."""

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
        right_vector, solution = self._matrix.createVecs()
        right_vector.array = right
        self._solver.solve(right_vector, solution)
        change = solution.array.copy()
        right_vector.destroy(), solution.destroy()
        return change

    def free(self) -> None:
        """Free the memory."""
        self._solver.destroy()
        self._matrix.destroy()


class Newton:
    """Newton's method for c M u + k f(u) = right on the free components; a constant matrix is factored once.

    Attributes:
        patch: Patch.
        weights: Weight c [1/s^2] of the mass and k of the internal force.
    """

    def __init__(self, patch: Patch, weights: tuple[float, float]) -> None:
        """Store the patch and the weights."""
        self.patch, self.weights = patch, weights
        self._factor: Factor | None = None

    def solve(self, start: Floats, boundary: Floats, right: Floats) -> tuple[Floats, Floats]:
        """Return displacement [m] and internal force [N], shape (3 n,).

        Args:
            start: First guess [m], shape (3 n,).
            boundary: Prescribed displacement [m], shape (3 n,).
            right: Right-hand side [N], shape (3 n,).

        Raises:
            RuntimeError: If the iteration does not converge.
        """
        patch, free = self.patch, self.patch.free
        force = patch.force(start)
        matrix = self._matrix()
        change = boundary - start
        change[free] = 0.0
        # The first step moves the boundary by the linear solution: moving it alone would crush adjacent cells.
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
    """Return the measures of the joint at each of ``steps`` equal shares of the full motion, in static equilibrium."""
    displacement, nothing, history = np.zeros(len(patch.full)), np.zeros(len(patch.full)), []
    newton = Newton(patch, (0.0, 1.0))
    for step in range(1, steps + 1):
        displacement, _ = newton.solve(displacement, step / steps * patch.full, nothing)
        history.append(patch.measures(displacement))
        patch.settle()
    return history


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of the moved side: its full motion times ``share``, from rest.

    Attributes:
        share: Time [s] -> share of the full motion.
        acceleration: Time [s] -> its second derivative [1/s^2].
    """

    share: Callable[[float], float]
    acceleration: Callable[[float], float]


def haversine(duration: float) -> Motion:
    """Return the motion sin^2(pi t / T) times the full motion, with the duration T [s]."""
    rate = np.pi / duration
    return Motion(lambda time: np.sin(rate * time) ** 2, lambda time: 2.0 * rate**2 * np.cos(2.0 * rate * time))


def steps_in_time(
    patch: Patch, motion: Motion, step: float, count: int, alpha: float = -0.05
) -> list[dict[str, float]]:
    """Return the measures after each of ``count`` steps of the HHT method, starting at rest.

        M a' + (1 + alpha) f(u') - alpha f(u) = 0,  u' = u + h v + h^2 ((1/2 - beta) a + beta a'),
        beta = (1 - alpha)^2 / 4,  gamma = 1/2 - alpha          (Hilber, Hughes & Taylor, EESD 5, 1977)

    Args:
        patch: Patch at rest.
        motion: Motion of its moved side.
        step: Time step h [s].
        count: Number of steps.
        alpha: HHT parameter from -1/3 to 0.
    """
    beta, gamma = 0.25 * (1.0 - alpha) ** 2, 0.5 - alpha
    inertia = 1.0 / (beta * step**2)
    newton, mass = Newton(patch, (inertia, 1.0 + alpha)), patch.mass
    displacement, velocity, force = np.zeros((3, len(patch.full)))
    acceleration = motion.acceleration(0.0) * patch.full
    acceleration[patch.free] = _first_acceleration(patch, acceleration)
    history = []
    for number in range(1, count + 1):
        time = number * step
        guess = displacement + step * velocity + (0.5 - beta) * step**2 * acceleration
        right = inertia * (mass @ guess) + alpha * force
        # The prescribed acceleration enters by M; the guess of its displacement is chosen so that u' gives it.
        boundary, boundary_acceleration = motion.share(time) * patch.full, motion.acceleration(time) * patch.full
        shift = inertia * (boundary - guess) - boundary_acceleration
        shift[patch.free] = 0.0
        right += mass @ shift
        displacement, force = newton.solve(displacement, boundary, right)
        new = inertia * (displacement - guess) - shift
        velocity = velocity + step * ((1.0 - gamma) * acceleration + gamma * new)
        acceleration = new
        history.append({"time": time, **patch.measures(displacement, acceleration)})
        patch.settle()
    return history


def _first_acceleration(patch: Patch, acceleration: Floats) -> Floats:
    """Return the free accelerations [m/s^2], shape (3 n,), at rest when the prescribed ones begin."""
    prescribed = acceleration.copy()
    prescribed[patch.free] = 0.0
    factor = Factor(patch.mass[patch.free][:, patch.free])
    free_acceleration = factor.solve(-(patch.mass @ prescribed)[patch.free])
    factor.free()
    return free_acceleration
