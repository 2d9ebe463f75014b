"""Bodies with step levels, and their effective stiffness by dense matrix functions."""

from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import grid, joint_mesh, mesh_of, on
from reflowshock.fem.division.chebyshev import stabilisation
from reflowshock.fem.division.choose_levels import StepLimits, governing_steps, least_steps
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.elements.element import element_stiffness
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import Materials

EDGE = 1.5e-3
FRACTION = 0.9


def joint_on_board(solder: int = 7, edges: int = 3, held: bool = True) -> MeshData:
    """Return a joint with copper pads, free at its upper end, on a small block of board to which it will be tied.

    Args:
        solder: Number of element layers of solder.
        edges: Number of elements along the sides of the joint.
        held: Whether two sides of the block are held.
    """
    ticks = np.linspace(0, EDGE, 4)
    points, cells = grid(ticks, ticks, [-1.3e-3, -0.8e-3, -0.3e-3, -0.15e-3, 0.0])
    facets = {"board_side": on(2, 0.0)} | ({"mounting_holes": on(0, EDGE), "symmetry_y": on(1, 0.0)} if held else {})
    joint = joint_mesh("A1", 0.5e-3, 0.5e-3, layers=solder, edges=edges)
    ends = {name: quads for name, quads in joint.facets.items() if not name.startswith("head@")}
    return append([mesh_of(points, cells, "board", facets), replace(joint, facets=ends)])


@dataclass(frozen=True)
class Levelled:
    """Body with step levels, the same body without, and the levels."""

    body: Body
    plain: Body
    level: np.ndarray
    ratios: tuple[int, ...]
    window: float


def levelled(
    mesh: MeshData,
    materials: Materials,
    ratios: tuple[int, ...],
    comm: MPI.Comm = MPI.COMM_SELF,
    damping: float = 0.0,
) -> Levelled:
    """Return a body whose elements take local time steps on several levels, the smallest elements the smallest step.

    Args:
        mesh: Mesh of the body.
        materials: Material of each role.
        ratios: Number of steps of each level in a step of the next outer one.
        comm: Communicator; collective.
        damping: Coefficient beta of stiffness-proportional damping over the window, the outermost step.

    Returns:
        Body with and without levels, level of each element, ratios and window [s].
    """
    item = prepare(mesh, "dns")["dns"]
    alone = make_rank_elements(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials)
    steps = np.empty(len(alone.steps))
    steps[alone.local.cell_numbers] = alone.steps
    least = least_steps(ratios, StepLimits(steps, np.ones(len(steps)), 1.0, FRACTION, damping))
    window = FRACTION * min(steps.max() / least[0], steps.min() / least[-1])
    step_limits = StepLimits(steps, np.ones(len(steps)), window, FRACTION, damping * window)
    needed = governing_steps(item.mesh.cells, item.tables.tie, FRACTION * steps)
    level = np.sum(needed[:, None] < least_steps(ratios, step_limits)[:-1], axis=1, dtype=np.int32)
    tables = replace(item.tables, level=level, ratios=ratios)
    rank_elements = make_rank_elements(distribute(comm, item.mesh if comm.rank == 0 else None), item.tables, materials)
    factor = np.ones(len(rank_elements.steps))
    body = make_body(comm, rank_elements, tables, factor, ForceOptions("small", window, damping * window))
    plain = make_body(comm, rank_elements, item.tables, factor)
    return Levelled(body, plain, level[rank_elements.local.cell_numbers], ratios, window)


def dense_level_stiffness(model: Levelled, number: int) -> np.ndarray:
    """Return the stiffness T^T K T of the elements of a level with the tie T, dense, shape (3 n, 3 n) [N/m].

    Args:
        model: Body with levels of ``levelled``.
        number: Level, 0 for the outermost one.
    """
    elements = model.body.elements.subset(model.level == number)
    size = 3 * len(model.body.mass)
    matrix = np.zeros((size, size))
    for cell, stiffness in zip(elements.cells, element_stiffness(elements), strict=True):
        dofs = (3 * cell[:, None] + np.arange(3)).ravel()
        matrix[np.ix_(dofs, dofs)] += stiffness
    tie = np.kron(model.body.tie.matrix(len(model.body.mass)).toarray(), np.eye(3))
    return tie.T @ matrix @ tie


def dense_effective_stiffness(model: Levelled, number: int = 0, step: float | None = None) -> np.ndarray:
    """Return the effective stiffness K_eff that a level with its inner levels has in a step, dense, (3 n, 3 n) [N/m].

    With A and B the (mass-scaled) stiffness blocks inside and outside, K_eff exceeds the block of the ring by A phi(A),
    B phi(A) and B ((phi - 1) / z)(A) B^T, phi(z) = (2 - 2 T_p(delta - z / omega) / T_p(delta)) / z.

    Args:
        model: Body with levels of ``levelled``.
        number: Level, 0 for the outermost one.
        step: Step of the next outer level [s]; None for the window.
    """
    step = step or model.window
    inner = step if number == 0 else step / model.ratios[number - 1]
    matrix = dense_level_stiffness(model, number)
    if number < len(model.ratios):
        matrix = matrix + dense_effective_stiffness(model, number + 1, inner)
    if number == 0:
        return matrix
    moves = moving_components(model, number)
    scale = step / np.sqrt(np.repeat(model.body.mass, 3)[moves])
    values, vectors = np.linalg.eigh(scale[:, None] * matrix[np.ix_(moves, moves)] * scale)
    coupling_block = matrix[np.ix_(~moves, moves)] * scale @ vectors
    phi, slope = filter_of(model.ratios[number - 1], stabilisation(number), values)
    back = vectors.T / scale
    result = matrix.copy()
    result[np.ix_(moves, moves)] = back.T * (values * phi) @ back
    result[np.ix_(~moves, moves)] = coupling_block * phi @ back
    result[np.ix_(moves, ~moves)] = result[np.ix_(~moves, moves)].T
    result[np.ix_(~moves, ~moves)] += coupling_block * slope @ coupling_block.T
    return result


def filter_of(count: int, nu: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return phi(z) of the stabilised substeps and (phi(z) - 1) / z, zero at z = 0, by NumPy's Chebyshev polynomials.

    Args:
        count: Number of substeps.
        nu: Stabilisation, 0 for none.
        z: Squared frequencies times squared step, shape (n,).

    Returns:
        Both functions, shape (n,) each.
    """
    polynomial = np.polynomial.Chebyshev.basis(count)
    delta = 1.0 + nu / count**2
    omega = 2.0 * polynomial.deriv()(delta) / polynomial(delta)
    some = np.abs(z) > 1e-9
    safe = np.where(some, z, 1.0)
    phi = np.where(some, (2.0 - 2.0 * polynomial(delta - safe / omega) / polynomial(delta)) / safe, 1.0)
    return phi, np.where(some, (phi - 1.0) / safe, 0.0)


def moving_components(model: Levelled, number: int) -> np.ndarray:
    """Return whether each displacement component is free and moves in the substeps of a level only, shape (3 n,).

    Args:
        model: Body with levels of ``levelled``.
        number: Level; nodes of elements of outer levels, and slaves tied to them, do not count.
    """
    body = model.body
    outer = np.zeros(len(body.mass), dtype=bool)
    for cell in body.elements.cells[model.level < number]:
        for node in cell:
            outer[node] = True
            outer[body.tie.master[body.tie.slave == node].ravel()] = True
    used = np.zeros(len(body.mass), dtype=bool)
    used[body.elements.cells[model.level >= number]] = True
    used[body.tie.master[used[body.tie.slave]].ravel()] = True
    return (body.free & (used & ~outer)[:, None]).ravel()
