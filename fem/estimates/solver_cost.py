"""Predicted cost of explicit and implicit steps of a structure before it is meshed, and the choice between them."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache

from reflowshock.fem.estimates.estimate import largest_implicit_step
from reflowshock.fem.estimates.material_effects import plastic_laws
from reflowshock.fem.problem.structure import Dynamics, StructureProblem

COMPONENTS = 3
LEAF = 3  # largest number of node layers that are eliminated at once
# Operations and entries of MUMPS, whose ordering does not use the box shape, over nested dissection of the box. Plates
# of one to four layers and cubes of 1e3 to 7e4 unknowns needed 1.3 to 2.8 and 1.2 to 1.7 (benchmarks/jedec_oracle.py).
OPERATIONS_FACTOR = 1.7
ENTRIES_FACTOR = 1.45


# Measured by benchmarks/jedec_oracle.py on one core of an AMD EPYC (AVX-512), Debian 12: element updates per second of
# whole explicit steps, linear and with plasticity or finite rotations; MUMPS 5.5 on the BLAS that Debian installs (an
# optimised one factors five to seven times faster).
LINEAR_RATE = {
    "incompatible_modes": 5.0e7,
    "one_point": 5.0e7,
    "tetrahedron": 9.0e7,
    "tetrahedron_quadratic": 9.0e6,
}
NONLINEAR_RATE = {
    "incompatible_modes": 3.5e6,
    "one_point": 1.0e7,
    "tetrahedron": 1.3e7,
    "tetrahedron_quadratic": 4.5e6,
}
TURNING_BOX_RATE, TURNING_RATE = 2.0e7, 1.2e7  # elastic and corotational: boxes of graded meshes, other hexahedra
TURNING_BOARD_RATE = 1.35e7  # boxes of a board limited by memory bandwidth: 1e5, or 1e4 alternating with the joints
FACTOR_RATE = 3.0e9  # operations per second of the factorisation
SOLVE_RATE = 6.0e8  # entries of the factor per second of a solution
ASSEMBLY_SECONDS = 2.0e-5  # [s] per equation
EXPLICIT_OVERHEAD, IMPLICIT_OVERHEAD = 2.5e-5, 4.0e-4  # [s] per step, interpreter
IMPLICIT_UPDATE = 3.0e-7  # [s] per step and node: forces, vectors, energy balance
# Cooling of joints that yield: a few Newton steps, each with about ten products.
COOLING_TANGENTS, COOLING_SOLUTIONS = 10, 120
TANGENT_RATE = 1.0e4  # tangents of yielding elements per second
PLATE_LAYERS = 4  # layers of the equivalent plate of board and package, as many as the board has
ENTRY_MEMORY, EQUATION_MEMORY = 11.0, 3.0e3  # [B] per entry of the factor, per equation during assembly
ELEMENT_MEMORY, NODE_MEMORY = 300.0, 500.0  # [B] per element and node of the explicit solver


@dataclass(frozen=True, slots=True)
class SolverCost:
    """Cost of one solver on one core.

    Attributes:
        steps: Number of time steps.
        seconds: Total time, set-up included [s].
        setup: Time before the first step [s].
        memory: Memory [B].
    """

    steps: int
    seconds: float
    setup: float
    memory: float


@dataclass(frozen=True, slots=True)
class SolverForecast:
    """Costs of both solvers.

    Attributes:
        explicit: Cost of explicit steps.
        implicit: Cost of implicit steps, of the linear model if the problem is nonlinear.
        only_explicit: Nonlinearities that only the explicit solver supports; empty if both solvers can be used.
    """

    explicit: SolverCost
    implicit: SolverCost
    only_explicit: tuple[str, ...]

    @property
    def cheaper(self) -> str:
        """Name of the solver that takes less time."""
        return "explicit" if self.explicit.seconds <= self.implicit.seconds else "implicit"

    @property
    def sentence(self) -> str:
        """Recommendation of a solver with its reason."""
        if self.only_explicit:
            return f"Only the explicit solver supports {', '.join(self.only_explicit)}."
        costs = {"explicit": self.explicit.seconds, "implicit": self.implicit.seconds}
        ratio = max(costs.values()) / min(costs.values())
        comparison = f"{self.cheaper.capitalize()} steps are {ratio:.3g} times cheaper here"
        return f"{comparison}; plasticity, finite rotations and two-scale runs need explicit steps."


def forecast_solvers(
    problem: StructureProblem, elements: int, explicit_steps: int, implicit_steps: int
) -> SolverForecast:
    """Predict the cost of the explicit and of the implicit solver on one core.

    Args:
        problem: Parameters of the structure.
        elements: Number of elements of the mesh.
        explicit_steps: Steps of the explicit solver.
        implicit_steps: Steps of the implicit solver, see ``implicit_step``.

    Returns:
        Number of steps, times [s] and memory [B] of each solver, and the nonlinearities that only the explicit solver
        supports.
    """
    nodes = _node_counts(problem)
    reasons = _nonlinearities(problem)
    structure = problem.structure
    kind = structure.formulation if structure.element == "hexahedron" else structure.element
    rate = (NONLINEAR_RATE if reasons else LINEAR_RATE)[kind]
    return SolverForecast(
        _explicit_cost(elements, math.prod(nodes), explicit_steps, rate), implicit_cost(nodes, implicit_steps), reasons
    )


def _explicit_cost(elements: int, nodes: int, steps: int, rate: float) -> SolverCost:
    """Predict the cost of explicit steps at a rate of element updates per second."""
    memory = ELEMENT_MEMORY * elements + NODE_MEMORY * nodes
    return SolverCost(steps, steps * (elements / rate + EXPLICIT_OVERHEAD), 0.0, memory)


def implicit_cost(nodes: tuple[int, int, int], steps: int) -> SolverCost:
    """Predict time and memory of implicit steps of a box: one factorisation, and a solve per step.

    Args:
        nodes: Number of nodes along x, y and z.
        steps: Number of time steps.

    Returns:
        Number of steps, total time and time before the first step on one core [s], and memory [B].
    """
    factor, equations = box_factor(nodes), 3 * math.prod(nodes)
    setup = factor.operations / FACTOR_RATE + ASSEMBLY_SECONDS * equations
    step = factor.entries / SOLVE_RATE + IMPLICIT_UPDATE * math.prod(nodes) + IMPLICIT_OVERHEAD
    seconds = setup + steps * step
    return SolverCost(steps, seconds, setup, ENTRY_MEMORY * factor.entries + EQUATION_MEMORY * equations)


def cooling_cost(elements: int, yielding: int) -> SolverCost:
    """Predict time and memory of computing residual stress: one factorisation and its solves.

    Args:
        elements: Number of hexahedra.
        yielding: Number of them whose material may yield.

    Returns:
        Number of steps, total time and time before the first step on one core [s], and memory [B].
    """
    solutions = COOLING_SOLUTIONS if yielding else 1
    cost = implicit_cost(plate_nodes(elements), solutions)
    return replace(cost, seconds=cost.seconds + COOLING_TANGENTS * yielding / TANGENT_RATE)


def plate_nodes(elements: int) -> tuple[int, int, int]:
    """Return the number of nodes along x, y, z of a square plate, as a model of a board.

    Args:
        elements: Approximate number of hexahedra of the plate.
    """
    side = max(1, round(math.sqrt(elements / PLATE_LAYERS)))
    return side + 1, side + 1, PLATE_LAYERS + 1


def _node_counts(problem: StructureProblem) -> tuple[int, int, int]:
    """Return the nodes along each side of the box, without the nodes that rings around holes add."""
    structure = problem.structure.refined
    layers = sum(layer.cells for layer in structure.layers.values())
    order = 2 if structure.element == "tetrahedron_quadratic" else 1
    return order * structure.cells[0] + 1, order * structure.cells[1] + 1, order * layers + 1


def _nonlinearities(problem: StructureProblem) -> tuple[str, ...]:
    """Return the nonlinearities of a problem as texts; empty for a linear problem."""
    plastic = ", ".join(plastic_laws(problem.layer_materials))
    reasons = [f"plasticity (layers {plastic})"] if plastic else []
    finite = problem.dynamics.kinematics != "small"
    return tuple(reasons + (["finite rotations (dynamics.kinematics)"] if finite else []))


def implicit_step(dynamics: Dynamics, pulses: Iterable[float]) -> float:
    """Return the largest implicit step [s]: that of the case file, or by default ``estimate.largest_implicit_step``.

    Args:
        dynamics: Settings of the dynamics, with duration [s] and, optionally, the step.
        pulses: Durations of the load pulses [s]; may be empty.
    """
    return dynamics.numerics.implicit_step or largest_implicit_step(dynamics.duration, pulses)


@dataclass(frozen=True, slots=True)
class FactorSize:
    """Number of floating-point operations of a factorisation, and number of entries of the factor."""

    operations: float
    entries: float


def box_factor(nodes: tuple[int, int, int]) -> FactorSize:
    """Predict the size of the Cholesky factor of a linear elastic box, with three unknowns per node.

    Nested dissection (George, SIAM J. Numer. Anal. 10, 1973): the separator through the middle of the longest side
    splits a box in two, recursively. It is eliminated after both halves, in a dense front with the earlier separators
    that border the box: s unknowns with a border of b take ((s + b)^3 - b^3) / 3 operations and s^2 / 2 + s b entries.

    Args:
        nodes: Nodes along each side.

    Returns:
        Number of floating-point operations of the factorisation, and number of entries of the factor.
    """
    operations, entries = _dissect(nodes, (False,) * 6)
    return FactorSize(OPERATIONS_FACTOR * operations, ENTRIES_FACTOR * entries)


@cache
def _dissect(nodes: tuple[int, int, int], bordered: tuple[bool, ...]) -> tuple[float, float]:
    """Return operations and entries of a box; ``bordered`` marks sides (low and high per axis) at a separator."""
    section = [nodes[1] * nodes[2], nodes[0] * nodes[2], nodes[0] * nodes[1]]
    border = float(COMPONENTS * sum(section[axis] * sum(bordered[2 * axis : 2 * axis + 2]) for axis in range(3)))
    longest = max(range(3), key=nodes.__getitem__)
    if nodes[longest] <= LEAF:
        return _front(float(COMPONENTS * nodes[0] * nodes[1] * nodes[2]), border)
    operations, entries = _front(float(COMPONENTS * section[longest]), border)
    below = (nodes[longest] - 1) // 2
    for count, side in ((below, 1), (nodes[longest] - 1 - below, 0)):
        half, sides = list(nodes), list(bordered)
        half[longest], sides[2 * longest + side] = count, True
        more = _dissect((half[0], half[1], half[2]), tuple(sides))
        operations, entries = operations + more[0], entries + more[1]
    return operations, entries


def _front(size: float, border: float) -> tuple[float, float]:
    return ((size + border) ** 3 - border**3) / 3.0, 0.5 * size**2 + size * border
