"""Static equilibrium of a body under thermal expansion, by Newton's method with one elastic factorisation.

The stress has a convex potential (``kernels.hencky``), so each linear system is symmetric and positive definite.
Conjugate gradients preconditioned by the elastic factor solve it in few products, since the tangent is at most as stiff
as the elastic body. A line search shortens a Newton step that passes the minimum of the energy along its direction.
Only the limits of hourglass forces (``kernels.nonlinear_one_point``) have no potential; there convergence is linear.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.elements.kind import strain_matrix
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.forces.energy import InternalForce
from reflowshock.fem.forces.force import linear_terms
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.factorisation import Factorisation
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.statics.hencky import HenckyElements, free_expansion
from reflowshock.materials.parameters import Material

CONVERGED = 1e-11  # residual force relative to the force that suppresses free expansion
ITERATIONS, PRODUCTS, LINE_SEARCHES = 50, 500, 12
OVERSHOOT = 0.5  # largest slope at the end of a step, as a fraction of the slope at its start
LOOSEST = 0.1  # largest relative tolerance of conjugate gradients (Eisenstat & Walker 1996)


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """Converged displacement with its convergence history.

    Attributes:
        displacement: Displacement, slaves included, shape (n, 3) [m].
        residuals: Residual force after each iteration, relative to the force that suppresses free expansion.
        products: Number of products with the tangent, each with one solution by the factor.
    """

    displacement: NDArray[np.float64]
    residuals: tuple[float, ...]
    products: int


def thermal_force(
    body: Body, chosen: NDArray[np.bool_] | slice, materials: Sequence[Material], change: float
) -> NDArray[np.float64]:
    """Return the nodal forces of selected elements whose thermal expansion is suppressed, shape (n, 3) [N].

    They push outwards when the temperature rises: without constraints they cause the free expansion. All elements pass
    the patch test, so their mean gradients are exact for a constant stress.

    Args:
        body: Model on this rank, n nodes.
        chosen: Selected elements, shape (ne,), or a slice.
        materials: Material of each index of ``body.elements``.
        change: Temperature change [K].
    """
    elements = body.elements.subset(np.arange(len(body.elements.cells))[chosen])
    strain = np.zeros((len(materials), 6))
    strain[:, :3] = free_expansion(materials, change)
    stress = np.einsum("mij,mj->mi", elements.elasticity, strain)[elements.material]
    gradient, volume = body.geometry.gradient[chosen], body.geometry.volume[chosen]
    nodal = np.einsum("eji,ej->ei", strain_matrix(gradient), volume[:, None] * stress)
    force = np.zeros((len(body.mass), 3))
    np.add.at(force, elements.cells, nodal.reshape(*elements.cells.shape, 3))
    return force


class Statics:
    """Static problem of a temperature change on one rank; all methods are collective.

    Attributes:
        scale: Norm of the force that suppresses free expansion [N].
    """

    def __init__(self, comm: MPI.Comm, body: Body, materials: Sequence[Material], change: float) -> None:
        """Assemble and factor the elastic body.

        Args:
            comm: Communicator of the body.
            body: Model on this rank, with supports against all rigid-body motions; its force terms are not used.
            materials: Material of each index of ``body.elements``.
            change: Temperature change [K].

        Raises:
            AgreedError: A rigid-body motion is unconstrained, or memory ran out; on every rank.
        """
        self._comm, self._body = comm, body
        yields = np.array([material.plasticity is not None for material in materials])[body.elements.material]
        self._terms = linear_terms(body.elements.subset(~yields)) if not yields.all() else []
        self._hencky = HenckyElements.build(body.elements.subset(yields), materials, free_expansion(materials, change))
        self._load = thermal_force(body, ~yields, materials, change)
        self._right = thermal_force(body, slice(None), materials, change)
        self._gather(self._right)
        self._equations = Equations.of(comm, body)
        self._vectors = [self._equations.vector(np.zeros((len(body.mass), 3))) for _ in range(2)]
        self._factor = Factorisation(self._equations.stiffness())
        self.scale = float(np.sqrt(self._dot(self._right, self._right)))

    @property
    def memory(self) -> float:
        """Memory of the factor on all ranks [B]."""
        return self._factor.cost.memory

    def free(self) -> None:
        """Free the memory of the factor."""
        self._factor.free()

    def solve(self) -> Equilibrium:
        """Solve for the equilibrium.

        Raises:
            AgreedError: The iteration does not converge; on every rank.
        """
        displacement = self._solution(self._right)
        residuals, products = [], 0
        if not self.scale > 0.0:
            return Equilibrium(displacement, (0.0,), 0)
        force, tangents = self._state(displacement)
        for _ in range(ITERATIONS):
            residuals.append(float(np.sqrt(self._dot(force, force))) / self.scale)
            if residuals[-1] <= CONVERGED:
                return Equilibrium(displacement, tuple(residuals), products)
            progress = residuals[-1] / residuals[-2] if len(residuals) > 1 else 1.0
            step, step_products = self._newton_step(force, tangents, min(LOOSEST, progress**2))
            products += step_products
            displacement, force, tangents = self._line_search(displacement, step, float(self._dot(step, force)))
        raise AgreedError(
            f"cooling: residual force {residuals[-1]:.2e} of the force that suppresses expansion after"
            f" {ITERATIONS} iterations; allowed: {CONVERGED:g}"
        )

    def _line_search(
        self, displacement: NDArray[np.float64], step: NDArray[np.float64], slope: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], list[InternalForce]]:
        """Take a step, shortened to the minimum of the energy; return displacement, residual force and tangents."""
        length = 1.0
        for _ in range(LINE_SEARCHES):
            trial = displacement + length * step
            force, tangents = self._state(trial)
            trial_slope = self._dot(step, force)
            if trial_slope >= -OVERSHOOT * slope:
                break
            length *= slope / (slope - trial_slope)
        return trial, force, tangents

    def _state(self, displacement: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[InternalForce]]:
        """Return the residual force of the free components, shape (n, 3) [N], and the terms of the tangent."""
        force = self._load.copy()
        tangents: list[InternalForce] = list(self._terms)
        for term in self._terms:
            term.add(displacement, force)
        internal, tangent = agreed(self._comm, lambda: self._hencky.linearised(displacement))
        force -= internal
        tangents.append(tangent)
        self._gather(force)
        return force, tangents

    def _newton_step(
        self, force: NDArray[np.float64], tangents: Sequence[InternalForce], tolerance: float
    ) -> tuple[NDArray[np.float64], int]:
        """Solve tangent times step = force by preconditioned conjugate gradients; return also the product count."""
        step, residual = np.zeros_like(force), force.copy()
        limit = tolerance * np.sqrt(self._dot(force, force))
        preconditioned = self._solution(residual)
        direction, product = preconditioned.copy(), self._dot(residual, preconditioned)
        count = 0
        while count < PRODUCTS and np.sqrt(self._dot(residual, residual)) > limit:
            internal = np.zeros_like(force)
            for term in tangents:
                term.add(direction, internal)
            self._gather(internal)
            length = -product / self._dot(direction, internal)
            step += length * direction
            residual += length * internal
            count += 1
            preconditioned = self._solution(residual)
            previous, product = product, self._dot(residual, preconditioned)
            direction = preconditioned + product / previous * direction
        return step, count

    def _gather(self, force: NDArray[np.float64]) -> None:
        """Move forces of slaves to their masters, sum over ranks, and set fixed components to zero."""
        self._body.tie.gather(force)
        self._body.shared.add(force)
        force[~self._body.free] = 0.0

    def _solution(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement of the elastic body under nodal forces, shape (n, 3) [N]."""
        right, solution = self._vectors
        right.array = force[self._equations.owned]
        self._factor.solve(right, solution)
        displacement = np.empty_like(force)
        self._equations.spread(solution, displacement)
        return displacement

    def _dot(self, first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
        """Return the scalar product over the free components of all ranks."""
        owned = self._equations.owned
        return float(self._comm.allreduce(float(first[owned] @ second[owned])))
