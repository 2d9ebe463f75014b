"""Implicit steps with finite rotation and plasticity: Newton's method by PETSc around the program's own force terms.

Products with the tangent are finite differences of forces, which cost a thousandth of a solution. GMRES solves, with
the factor of the elastic body at rest, computed once, as preconditioner. The remaining operator has the rank of the
yielding region.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from benchmarks.support.program_run import ProgramRun
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.participant import SingleModel
from reflowshock.fem.estimates.estimate import implicit_plan
from reflowshock.fem.forces.force import ForceTerm
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.loads.load import Load
from reflowshock.fem.model.body import Body

ALPHA, ITERATIONS = -0.1, 60  # HHT parameter; GMRES iterations per Newton step
CONVERGED, SMALL = 1e-4, 1e-5  # residual relative to the start of a step, and to the largest body force so far


def with_step(term: ForceTerm, step: float) -> ForceTerm:
    """Return a force term whose state of plasticity continues with another time step.

    Args:
        term: Force term; terms of linear elements are returned unchanged.
        step: Time step [s].
    """
    if not isinstance(term, NonlinearElements):
        return term
    path = Path(term.path.finite, step)
    return replace(term, path=path, kernel=partial(term.kernel.func, term.blocks, path))


def take_implicit_steps(run: ProgramRun, step: float) -> "NewtonMotion":
    """Switch a run of one model at rest, in place, to implicit steps of at most ``step`` [s]; return its motion.

    The times of the samples stay unchanged.
    """
    [(role, participant)] = run.participants.items()
    run.plan = implicit_plan(run.plan, step)
    motion = NewtonMotion(participant.motion.body, participant.motion._loads, run.plan.step)
    run.participants = {role: SingleModel(motion, run.plan)}
    return motion


class NewtonMotion(ImplicitMotion):
    """Implicit motion of a body on one rank with finite rotation and plasticity.

    Attributes:
        solutions: Number of solutions with the factor so far.
    """

    def __init__(self, body: Body, loads: Sequence[Load], step: float) -> None:
        """Start at rest, from the current path of the terms."""
        self.solutions, self._largest = 0, 0.0
        body = replace(body, terms=[with_step(term, step) for term in body.terms])
        self._histories = [values for term in body.terms for values in term.history.values()]
        self._keep()
        super().__init__(MPI.COMM_SELF, body, loads, step, ALPHA)
        self._newton = PETSc.SNES().create(MPI.COMM_SELF)
        self._newton.setFunction(self._unbalanced, self._right.duplicate())
        self._newton.setUseMF(True)
        self._newton.setUseEW(True)
        self._newton.setMaxLinearSolveFailures(ITERATIONS)
        solver = self._newton.getKSP()
        solver.setType(PETSc.KSP.Type.GMRES)
        solver.setTolerances(max_it=ITERATIONS)
        solver.getPC().setType(PETSc.PC.Type.PYTHON)
        solver.getPC().setPythonContext(self)

    @staticmethod
    def check(body: Body) -> None:
        """Do nothing: all terms can be balanced."""

    def _keep(self) -> None:
        """Store the path at the start of a step, from which each evaluation continues."""
        self._kept = [values.copy() for values in self._histories]

    def _add_internal(self, field: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Evaluate the internal force from the path at the start of the step."""
        for values, start_values in zip(self._histories, self._kept, strict=True):
            values[...] = start_values
        return super()._add_internal(field, force)

    def _solve(self, before: np.ndarray) -> None:
        """Balance the step, starting from the previous accelerations."""
        self._keep()
        self._start = self.displacement.copy(), self.velocity.copy(), before
        weight = float(np.linalg.norm(self.body.mass) * np.linalg.norm(self.gravity))
        self._largest = max(self._largest, weight)
        self._newton.setTolerances(rtol=CONVERGED, atol=SMALL * self._largest)
        self._solution.array = self._acceleration[self._equations.owned]
        self._newton.solve(None, self._solution)
        if self._newton.reason < 0:
            raise ArithmeticError(f"Newton's method stops at {self.time:g} s: {self._newton.reason}")
        self._unbalanced(self._newton, self._solution, self._right)

    def _unbalanced(self, _newton: PETSc.SNES, accelerations: PETSc.Vec, result: PETSc.Vec) -> None:
        """Compute the residual force at trial accelerations for PETSc and move the body there."""
        h, scheme = self.step, self._scheme
        displacement, speed, before = self._start
        self._equations.spread(accelerations, self._acceleration)
        self.displacement[:] = displacement + h**2 * scheme.beta * self._acceleration
        self.velocity[:] = speed + h * scheme.gamma * self._acceleration
        self._update_force()
        forces = (1.0 + scheme.alpha) * self._total_force() - scheme.alpha * before
        result.array = (self.body.mass[:, None] * self._acceleration - forces)[self._equations.owned]

    def apply(self, _preconditioner: PETSc.PC, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve with the elastic factor, for PETSc."""
        self.solutions += 1
        self.factor.solve(right, solution)
