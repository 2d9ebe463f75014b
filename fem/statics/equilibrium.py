"""Static equilibrium of a body whose parts want to expand differently: one factor, and Newton's method where it yields.

The stress has a convex potential (``kernels.hencky``): each linear system is symmetric and positive, and conjugate
gradients with the elastic factor as preconditioner solve it in few products, since the tangent is at most as stiff as
the elastic body. A step that ends beyond the least energy on its way is cut where the slope changes sign. Only the
limits of hourglass forces (``kernels.nonlinear_one_point``) have no potential: there convergence is linear.
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

CONVERGED = 1e-11  # force out of balance over the forces that hold free expansion back
ITERATIONS, PRODUCTS, LINE_SEARCHES = 50, 500, 12
OVERSHOOT = 0.5  # of the slope at its start is where a step along a direction ends at most
LOOSEST = 0.1  # of the force out of balance: what conjugate gradients may leave of it (Eisenstat & Walker 1996)


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """What was found.

    Attributes:
        displacement: ``(n, 3)`` [m], slaves with their masters.
        residuals: Force out of balance after each iteration, over the forces that hold free expansion back.
        products: Products with tangents, each with a solution by the factor.
    """

    displacement: NDArray[np.float64]
    residuals: tuple[float, ...]
    products: int


def thermal_force(
    body: Body, chosen: NDArray[np.bool_] | slice, materials: Sequence[Material], change: float
) -> NDArray[np.float64]:
    """Return the forces ``(n, 3)`` [N] by which some elements, held at rest, want to expand.

    The mean gradients of a constant stress are exact for all elements: they pass the patch test.
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
    """The static problem of a change of temperature on one rank; all methods are collective.

    Attributes:
        scale: Magnitude [N] of the forces that hold free expansion back.
    """

    def __init__(self, comm: MPI.Comm, body: Body, materials: Sequence[Material], change: float) -> None:
        """Assemble and factor the elastic body.

        Args:
            comm: Communicator of the body.
            body: Its supports hold all rigid motions; whatever its force terms.
            materials: Material of each index of ``body.elements``.
            change: Of temperature [K].

        Raises:
            AgreedError: The supports leave a rigid motion, or memory ran out; on every rank.
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
        """Return the memory of the factor on all ranks [B]."""
        return self._factor.cost.memory

    def free(self) -> None:
        """Give the factor's memory back."""
        self._factor.free()

    def solve(self) -> Equilibrium:
        """Find the equilibrium.

        Raises:
            AgreedError: Forces stay out of balance; on every rank.
        """
        place = self._solution(self._right)
        residuals, products = [], 0
        if not self.scale > 0.0:
            return Equilibrium(place, (0.0,), 0)
        force, tangents = self._state(place)
        for _ in range(ITERATIONS):
            residuals.append(float(np.sqrt(self._dot(force, force))) / self.scale)
            if residuals[-1] <= CONVERGED:
                return Equilibrium(place, tuple(residuals), products)
            progress = residuals[-1] / residuals[-2] if len(residuals) > 1 else 1.0
            step, needed = self._newton_step(force, tangents, min(LOOSEST, progress**2))
            products += needed
            place, force, tangents = self._along(place, step, float(self._dot(step, force)))
        raise AgreedError(
            f"cooling: forces out of balance by {residuals[-1]:.2e} of those that hold expansion back after"
            f" {ITERATIONS} iterations, allowed are {CONVERGED:g}"
        )

    def _along(
        self, place: NDArray[np.float64], step: NDArray[np.float64], slope: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], list[InternalForce]]:
        """Go along a step, not beyond the least energy on the way; return place, force out of balance, tangents."""
        length = 1.0
        for _ in range(LINE_SEARCHES):
            there = place + length * step
            force, tangents = self._state(there)
            after = self._dot(step, force)
            if after >= -OVERSHOOT * slope:
                break
            length *= slope / (slope - after)
        return there, force, tangents

    def _state(self, displacement: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[InternalForce]]:
        """Return the force out of balance ``(n, 3)`` [N], of free components, and the terms of the tangent."""
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
        """Solve tangent times step = force by preconditioned conjugate gradients; return also the products."""
        step, rest = np.zeros_like(force), force.copy()
        wanted = tolerance * np.sqrt(self._dot(force, force))
        better = self._solution(rest)
        direction, product = better.copy(), self._dot(rest, better)
        count = 0
        while count < PRODUCTS and np.sqrt(self._dot(rest, rest)) > wanted:
            pull = np.zeros_like(force)
            for term in tangents:
                term.add(direction, pull)
            self._gather(pull)
            length = -product / self._dot(direction, pull)
            step += length * direction
            rest += length * pull
            count += 1
            better = self._solution(rest)
            before, product = product, self._dot(rest, better)
            direction = better + product / before * direction
        return step, count

    def _gather(self, force: NDArray[np.float64]) -> None:
        """Move forces of slaves to their masters, add up all ranks, and leave out what is held."""
        self._body.tie.gather(force)
        self._body.shared.add(force)
        force[~self._body.free] = 0.0

    def _solution(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement of the elastic body under forces ``(n, 3)`` [N], equal on all copies."""
        right, solution = self._vectors
        right.array = force[self._equations.own]
        self._factor.solve(right, solution)
        displacement = np.empty_like(force)
        self._equations.spread(solution, displacement)
        return displacement

    def _dot(self, first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
        """Return a sum over all free components of all ranks."""
        own = self._equations.own
        return float(self._comm.allreduce(float(first[own] @ second[own])))
