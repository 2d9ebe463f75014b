"""Direct solution of symmetric positive definite systems by a MUMPS Cholesky factorisation."""

from dataclasses import dataclass

from petsc4py import PETSc

from reflowshock.fem.errors import AgreedError

PREFIX = "factor_"
SETTINGS = {14: 50}  # ICNTL(14) of MUMPS: extra working memory [%]; ties and many ranks exceed its estimate


@dataclass(frozen=True, slots=True)
class FactorCost:
    """Cost of a factorisation: floating-point operations, entries of the factor, memory of all ranks [B]."""

    operations: float
    entries: float
    memory: float


class Factorisation:
    """Cholesky factor of a sparse matrix."""

    def __init__(self, matrix: PETSc.Mat) -> None:
        """Factor a matrix; collective.

        Raises:
            AgreedError: The matrix is not positive definite, or memory ran out; on every rank.
        """
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        self._solver = PETSc.KSP().create(matrix.comm)
        self._solver.setOperators(matrix)
        make_direct(self._solver)
        self._solver.setUp()
        self._factor = self._solver.getPC().getFactorMatrix()
        status, negative = self._factor.getMumpsInfog(1), self._factor.getMumpsInfog(12)
        if status < 0 or negative > 0:
            raise AgreedError(
                f"MUMPS failed to factor {matrix.size[0]} equations: INFOG(1) = {status}, INFOG(2) ="
                f" {self._factor.getMumpsInfog(2)} (-10: singular; -9, -13, -19: out of memory), {negative} pivots are"
                " negative"
            )

    @property
    def cost(self) -> FactorCost:
        """Cost of the factorisation."""
        entries = self._factor.getMumpsInfog(29)
        return FactorCost(
            operations=self._factor.getMumpsRinfog(3),
            entries=float(entries) if entries >= 0 else -1e6 * entries,  # MUMPS counts large numbers in millions
            memory=1e6 * self._factor.getMumpsInfog(22),
        )

    def solve(self, right: PETSc.Vec, solution: PETSc.Vec) -> None:
        """Solve for a right-hand side; collective."""
        self._solver.solve(right, solution)

    def free(self) -> None:
        """Free the memory of the factor, which PETSc otherwise keeps as long as a reference exists."""
        self._factor.destroy()
        self._solver.destroy()


def make_direct(solver: PETSc.KSP) -> None:
    """Configure a PETSc linear solver as one MUMPS Cholesky factorisation without iterations.

    Args:
        solver: Solver whose matrix is symmetric; changed in place, before its set-up.
    """
    for number, value in SETTINGS.items():  # MUMPS 5.5 under PETSc 3.18 takes them as options only
        PETSc.Options()[f"{PREFIX}mat_mumps_icntl_{number}"] = value
    solver.setOptionsPrefix(PREFIX)
    solver.setType(PETSc.KSP.Type.PREONLY)
    solver.getPC().setType(PETSc.PC.Type.CHOLESKY)
    solver.getPC().setFactorSolverType("mumps")
