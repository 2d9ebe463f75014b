"""Internal force of elements with local time steps, as one force term of the model's large step.

Leapfrog with local time steps (Diaz & Grote, SIAM J. Sci. Comput. 31, 2009; several levels: 37, 2015; stabilised, see
``division.chebyshev``) equals leapfrog with the large step DT and a modified symmetric stiffness. At a displacement u,
the nodes inside a level take p substeps from rest at q_0 = u while all other nodes are fixed at u. The force of the
step is the weighted mean of the forces f(q_k), on the nodes inside and on the nodes around them (the ring):

    f(u) = sum over k of weight_k f(q_k),        K_eff = -df/du = K_eff^T,        K_eff -> K for DT -> 0.

As a mean of internal forces it has no resultant, and it is zero for rigid motion. Loads act once per large step outside
of it. The elements of the next level are a term inside f, whose large step is the substep, and so on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.division.chebyshev import Substeps
from reflowshock.fem.elements.element import Elements
from reflowshock.fem.errors import LevelError
from reflowshock.fem.forces.energy import Energy, InternalForce, linear_energy
from reflowshock.fem.forces.force import ForceTerm, linear_terms
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_congruent import CongruentElements, in_rows
from reflowshock.fem.kernels.levels import begin_substeps, end_substeps, run_levels, take_substep
from reflowshock.fem.mesh.tie import Tie
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.exchange import SharedNodes
from reflowshock.fem.parallel.local_mesh import positions
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.materials.parameters import Material


@dataclass(frozen=True, slots=True)
class Levels:
    """Step level of each element, and the time steps of the levels.

    Attributes:
        level: Level of each element of the rank, 0 for elements with the step of the model, shape (ne,).
        ratios: Number of steps of level k + 1 in one step of level k.
        step: Step of the model DT [s]; in an inner level, the step of the surrounding level.
        damping: Coefficient beta of stiffness-proportional damping, divided by the step of the model.
    """

    level: NDArray[np.int32]
    ratios: tuple[int, ...]
    step: float
    damping: float = 0.0


@dataclass(frozen=True, slots=True)
class SubsteppedElements:
    """Force term of one level and all levels inside it.

    The nodes of the level are renumbered: first the ones that move (free), then the ring. Slaves are eliminated: their
    masters take their place in the elements and receive their forces.

    Attributes:
        rows: Numbers of the level's nodes in the surrounding level, shape (n,) int32.
        terms: Force terms at the nodes: elements of this level, and the next level.
        substeps: Coefficients of the substeps.
        shared: Free nodes shared with other ranks.
        step: Step of the surrounding level [s].
        inverse: DT^2 / m of the free nodes, zero for fixed components, shape (nf, 3) [s^2/kg]; see ``follow``.
        foreign: Free nodes whose force another rank (the lowest that has them) contributes.
        change: Displacement change of the latest substep, shape (nf, 3) [m].
        state: Work arrays of ``add``: displacement [m], force [N], weighted sum of forces [N], shape (3, n, 3).
        compiled: Arrays of this level and the levels inside it for ``kernels.levels.run_levels``, empty if the substeps
            cannot run in one compiled call.
        plain: Force terms of the same elements without local steps, for the hourglass energy; empty without hourglass
            control.
        history: Empty, since the force depends only on the displacement.
    """

    rows: NDArray[np.int32]
    terms: Sequence[InternalForce]
    substeps: Substeps
    shared: SharedNodes
    step: float
    inverse: NDArray[np.float64]
    foreign: NDArray[np.int32]
    change: NDArray[np.float64]
    state: NDArray[np.float64]
    compiled: tuple[tuple[NDArray, ...], ...] = ()
    plain: Sequence[ForceTerm] = ()
    history: dict[str, NDArray] = field(default_factory=dict)

    @classmethod
    def build(cls, comm: MPI.Comm, body: Body, levels: Levels) -> "SubsteppedElements":
        """Build the term of all elements of levels above 0; collective.

        Args:
            comm: Communicator of the model.
            body: Model on this rank; the nodes of its coupling interface do not move in substeps.
            levels: Levels of the elements, which must be linear elastic.
        """
        term = _build_level(comm, body, levels, 1, np.arange(len(body.mass), dtype=np.int32))
        elements = body.elements.subset(levels.level > 0)
        return replace(term, plain=linear_terms(elements)) if elements.kind.hourglass else term

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract K_eff u, shape (n, 3) [N], from the force; collective."""
        if self.compiled:
            run_levels(self.compiled, 0, displacement, force)
            return
        steps, local_displacement, local_force = self.substeps, self.state[0], self.state[1]
        begin_substeps(self.rows, displacement, self.state)
        for coefficients in zip(steps.memory, steps.rate, steps.weight, strict=True):
            for term in self.terms:
                term.add(local_displacement, local_force)
            self.shared.add(local_force)
            take_substep(coefficients, self.inverse, self.change, self.state)
        end_substeps(self.rows, self.foreign, self.state, force)

    def follow(self, mobility: NDArray[np.float64]) -> None:
        """Adopt the inverse masses of a motion at the nodes of the surrounding level, shape (m, 3) [1/kg].

        Nodes with prescribed motion or a large mass must not move in substeps; otherwise the elements there would be
        softer by the square of their steps.
        """
        free = len(self.inverse)
        self.inverse[:] = self.step**2 * mobility[self.rows[:free]]
        for inner in levels_of(self.terms):
            inner.follow(mobility[self.rows])

    def carry(self, load: NDArray[np.float64], fall: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean internal force at u = 0 of substeps in which loads act, shape (m, 3) [N]; collective.

        With this correction a load deforms the elements at its nodes correctly: K_eff u = f + carry(f) for K u = f.
        Without it, the loaded nodes would move freely during the step. It has no resultant.

        Args:
            load: Load at the nodes of the surrounding level, equal on all copies of a node, shape (m, 3) [N].
            fall: Body acceleration of all components that are not fixed, shape (3,) [m/s^2]; in the falling frame, the
                fixed components move against it.
        """
        steps, local_displacement, local_force = self.substeps, self.state[0], self.state[1]
        free = len(self.inverse)
        local_load, force = load[self.rows], np.zeros_like(load)
        inner_force = sum((inner.carry(local_load, fall) for inner in levels_of(self.terms)), np.zeros_like(local_load))
        fixed_fall, speed = np.where(self.inverse == 0.0, fall, 0.0), 0.0
        local_displacement.fill(0.0)
        for coefficients in zip(steps.memory, steps.rate, steps.weight, strict=True):
            for term in self.terms:
                term.add(local_displacement, local_force)
            local_force += inner_force
            self.shared.add(local_force)
            local_force[:free] += local_load[:free]
            take_substep(coefficients, self.inverse, self.change, self.state)
            speed = coefficients[0] * speed + coefficients[1] * self.step**2
            local_displacement[:free] -= speed * fixed_fall
        self.state[2, :free] -= local_load[:free]  # the weights add up to one
        end_substeps(self.rows, self.foreign, self.state, force)
        return force

    def means(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the weighted mean over the substeps of the displacements of each level; collective.

        Args:
            values: Displacement, or velocity, of the surrounding level, shape (m, 3).

        Returns:
            Means for this level and the levels inside it, shape (levels, m, 3); valid at the nodes of each level's
            elements.
        """
        steps, local_displacement, local_force = self.substeps, self.state[0], self.state[1]
        begin_substeps(self.rows, values, self.state)
        total = np.zeros(())
        for coefficients in zip(steps.memory, steps.rate, steps.weight, strict=True):
            inner = [level.means(local_displacement) for level in levels_of(self.terms)]
            total = total + coefficients[2] * np.concatenate([local_displacement[None], *inner])
            for term in self.terms:
                term.add(local_displacement, local_force)
            self.shared.add(local_force)
            take_substep(coefficients, self.inverse, self.change, self.state)
        self.state[2] = 0.0
        result = np.repeat(values[None], len(total), axis=0)
        result[:, self.rows] = total
        return result

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return u . K_eff u / 2 [J], with the hourglass share of elements without local steps; collective."""
        hourglass = sum(term.energy(displacement).hourglass for term in self.plain)
        return Energy(linear_energy(self, displacement, None).strain - hourglass, hourglass=hourglass)


def levels_of(terms: Sequence[InternalForce]) -> list[SubsteppedElements]:
    """Return those of the force terms that take local time steps (several substeps in one step), in the same order.

    Args:
        terms: Force terms of a model; the result is empty if none has substeps.
    """
    return [term for term in terms if isinstance(term, SubsteppedElements)]


def check_elastic(materials: Sequence[Material], kinematics: Kinematics, ratios: tuple[int, ...]) -> None:
    """Check that elements with local time steps are linear elastic: substeps from rest have no loading history.

    Args:
        materials: Materials of these elements.
        kinematics: Kinematics of the model: small, corotational or finite.
        ratios: Number of steps of each level in one step of the surrounding level, for the message.

    Raises:
        LevelError: A material yields, or kinematics are not small.
    """
    yielding = [material for material in materials if material.plasticity is not None]
    if yielding or kinematics != "small":
        cause = f"{len(yielding)} materials yield" if yielding else f"kinematics = {kinematics}"
        raise LevelError(
            f"local steps (ratios {', '.join(map(str, ratios))}) support only linear elastic elements at small strains,"
            f" but {cause}; use coupling.scheme = held_velocity or gravouil_combescure"
        )


def _build_level(
    comm: MPI.Comm, body: Body, levels: Levels, number: int, around: NDArray[np.int32]
) -> SubsteppedElements:
    """Build a level and the levels inside it; collective.

    Args:
        comm: Communicator of the model.
        body: Model on this rank.
        levels: Levels of its elements.
        number: Number of the level.
        around: Nodes of the surrounding level, shape (m,).
    """
    nodes, free = _level_nodes(body, levels.level, number)
    terms = _terms_at_nodes(body, levels.level == number, nodes)
    substeps = Substeps.of(levels.ratios[number - 1], number, levels.damping)
    if number < len(levels.ratios):
        inner = replace(levels, step=levels.step / levels.ratios[number - 1])
        terms.append(_build_level(comm, body, inner, number + 1, nodes))
    shared = SharedNodes(comm, body.local.nodes[nodes[:free]], body.shared.clock)
    mass = np.where(body.mass > 0.0, body.mass, np.inf)[nodes[:free], None]
    term = SubsteppedElements(
        rows=positions(around, nodes),
        terms=terms,
        substeps=substeps,
        shared=shared,
        step=levels.step,
        inverse=np.where(body.free[nodes[:free]], levels.step**2 / mass, 0.0),
        foreign=np.flatnonzero(~shared.owned).astype(np.int32),
        change=np.zeros((free, 3)),
        state=np.zeros((3, len(nodes), 3)),
    )
    return replace(term, compiled=_compiled_arrays(term))


def _compiled_arrays(level: SubsteppedElements) -> tuple[tuple[NDArray, ...], ...]:
    """Return the arrays with which all substeps of a level run in one compiled call, empty if they cannot."""
    inner = levels_of(level.terms)
    element_terms = [term for term in level.terms if term not in inner]
    matrix = element_terms[0] if len(element_terms) == 1 else None
    if not isinstance(matrix, AssembledElements) or level.shared.exchanged or (inner and not inner[0].compiled):
        return ()
    steps = level.substeps
    coefficients = np.column_stack([steps.memory, steps.rate, steps.weight])
    arrays = (level.rows, level.foreign, coefficients, level.inverse, level.change, level.state)
    return ((*arrays, matrix.pointer, matrix.columns, matrix.blocks), *(inner[0].compiled if inner else ()))


def _level_nodes(body: Body, level: NDArray[np.int32], number: int) -> tuple[NDArray[np.int32], int]:
    """Return the nodes of a level and the levels inside it, without slaves, and the number of moving ones; collective.

    The moving nodes come first. They belong to no element of an outer level on any rank, nor to a master of its slaves.
    """
    used, slaves = np.zeros(len(body.mass), dtype=bool), np.zeros(len(body.mass), dtype=bool)
    used[body.elements.cells[level >= number]] = True
    slaves[body.tie.slave] = True
    used[body.tie.master[used[body.tie.slave]]] = True
    outer = np.zeros((len(body.mass), 3))
    outer[body.elements.cells[level < number]] = 1.0
    outer[body.interface[body.interface >= 0]] = 1.0
    body.tie.gather(outer)
    body.shared.add(outer)
    moves = outer[:, 0] == 0.0
    used &= ~slaves
    nodes = np.concatenate([np.flatnonzero(used & moves), np.flatnonzero(used & ~moves)])
    return nodes.astype(np.int32), int(np.sum(used & moves))


def _terms_at_nodes(body: Body, chosen: NDArray[np.bool_], nodes: NDArray[np.int32]) -> list[InternalForce]:
    """Return the force terms of selected elements of a body, numbered by ``nodes``, none of which is a slave."""
    is_used = np.isin(body.tie.slave, body.elements.cells[chosen])
    tie = Tie(body.tie.slave[is_used], body.tie.master[is_used], body.tie.weight[is_used])
    order = np.concatenate([nodes, tie.slave])
    elements = body.elements.subset(chosen)
    renumbered = replace(elements, points=elements.points[order], cells=positions(order, elements.cells))
    return _tied_terms(renumbered, Tie(positions(order, tie.slave), positions(order, tie.master), tie.weight))


def _tied_terms(elements: Elements, tie: Tie) -> list[InternalForce]:
    """Return the force terms of linear elements with the slaves, which must be the last nodes, eliminated.

    Boxes with a slave no longer share their stiffness with other boxes, so they are assembled.
    """
    box = in_rows(elements) & ~np.isin(elements.cells, tie.slave).any(axis=1)
    terms: list[InternalForce] = []
    if box.any():
        terms.append(CongruentElements.build(elements.subset(box)))
    if not box.all():
        terms.append(_without_slaves(AssembledElements.build(elements.subset(~box)), tie))
    return terms


def _without_slaves(assembled: AssembledElements, tie: Tie) -> AssembledElements:
    """Return the assembled stiffness T^T K T without the slaves, T the tie."""
    if not len(tie.slave):
        return assembled
    count = len(assembled.pointer) - 1
    size = 3 * count
    half = scipy.sparse.bsr_matrix((assembled.blocks, assembled.columns, assembled.pointer), shape=(size, size))
    matrix = scipy.sparse.kron(tie.matrix(count), scipy.sparse.identity(3), format="csr")
    half = matrix.T @ half @ matrix
    both = (half + half.T).tocsr()
    both.eliminate_zeros()
    whole = both.tobsr((3, 3))
    whole.sort_indices()
    return upper_blocks(whole, count - len(tie.slave))


def upper_blocks(matrix: scipy.sparse.bsr_matrix, count: int) -> AssembledElements:
    """Return the upper 3 x 3 blocks of the first ``count`` block rows of a symmetric matrix, as a force term.

    Args:
        matrix: Symmetric stiffness in block rows with sorted columns, all blocks stored, shape (3 n, 3 n) [N/m].
        count: Number of leading nodes; the later ones must have no entries in these rows.

    Returns:
        Assembled stiffness with halved diagonal blocks, as ``kernels.force.add_block_force`` expects.
    """
    row = np.repeat(np.arange(matrix.shape[0] // 3), np.diff(matrix.indptr))
    is_upper = (row <= matrix.indices) & (row < count)
    columns = matrix.indices[is_upper].astype(np.int32)
    blocks: NDArray[np.float64] = matrix.data[is_upper]
    blocks[columns == row[is_upper]] *= 0.5
    pointer = np.concatenate([[0], np.cumsum(np.bincount(row[is_upper], minlength=count))]).astype(np.int32)
    return AssembledElements(pointer, columns, blocks)
