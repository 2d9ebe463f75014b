"""The internal force of elements that take several small steps within the step of their model.

Leapfrog with local time steps (Diaz & Grote, SIAM J. Sci. Comput. 31, 2009, and 37, 2015 for several levels;
stabilised, see ``levels.chebyshev``) is leapfrog of the large step DT with another symmetric stiffness. At a
displacement u the nodes inside a level take p substeps from rest at q_0 = u, all other nodes held at u; the force of
the step is the mean of the forces f(q_k) on the way, on the nodes inside as on those around (the ring). So it is a
force term like any other:

    f(u) = sum over k of weight_k f(q_k),        K_eff = -df/du = K_eff^T,        K_eff -> K for DT -> 0.

Being a mean of internal forces it has no resultant; rigid motion gives none at all. Forces of loads are not in it: they
act once a step. The elements of the next level are a term inside f with the substep for DT, and so on.
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
    """Who takes which steps.

    Attributes:
        level: ``(ne,)`` level of each element of the rank, 0 for those that take the step of the model.
        ratios: Steps of level k + 1 in one of level k.
        step: Step of the model DT [s]; inside a level, of the level around it.
        damping: beta of damping over the step of the model.
    """

    level: NDArray[np.int32]
    ratios: tuple[int, ...]
    step: float
    damping: float = 0.0


@dataclass(frozen=True, slots=True)
class SubsteppedElements:
    """One level and all inside it.

    Its nodes are numbered anew: first those that move (free), then the ring. Slaves are eliminated: their masters are
    the nodes of their elements, and get all force.

    Attributes:
        rows: ``(n,)`` int32, its nodes among those of the level around it.
        terms: Forces at its nodes: of its own elements, and of the next level.
        substeps: Their coefficients.
        shared: Its free nodes that several ranks hold.
        step: Step of the level around it [s].
        inverse: ``(nf, 3)`` DT^2 / m of its free nodes [s^2/kg], zero for held components; see ``follow``.
        foreign: Those of its free nodes whose force another rank gives: the lowest that holds them.
        change: ``(nf, 3)`` [m] of the latest substep.
        state: ``(3, n, 3)``: displacement [m], force [N] there, weighted sum of forces [N]; only ``add`` reads it.
        at_once: Where all substeps can be one call: it and the levels inside it as ``kernels.levels.run_levels`` takes
            them, with the same arrays; else empty.
        plain: Terms of its elements without levels, where they have hourglass control: for its share of the energy.
        history: Empty: the force follows from the displacement.
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
    at_once: tuple[tuple[NDArray, ...], ...] = ()
    plain: Sequence[ForceTerm] = ()
    history: dict[str, NDArray] = field(default_factory=dict)

    @classmethod
    def build(cls, comm: MPI.Comm, body: Body, levels: Levels) -> "SubsteppedElements":
        """Build the levels below the step of a model, whose elements of level 0 are not in them; collective.

        Args:
            comm: Communicator of the model.
            body: The model, whatever its terms. The nodes of its interface are held.
            levels: Levels of its elements, which must be linear elastic.
        """
        term = build_level(comm, body, levels, 1, np.arange(len(body.mass), dtype=np.int32))
        elements = body.elements.subset(levels.level > 0)
        return replace(term, plain=linear_terms(elements)) if elements.kind.hourglass else term

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract K_eff u from the force; collective."""
        if self.at_once:
            run_levels(self.at_once, 0, displacement, force)
            return
        steps, place, pull = self.substeps, self.state[0], self.state[1]
        begin_substeps(self.rows, displacement, self.state)
        for coefficients in zip(steps.memory, steps.rate, steps.weight, strict=True):
            for term in self.terms:
                term.add(place, pull)
            self.shared.add(pull)
            take_substep(coefficients, self.inverse, self.change, self.state)
        end_substeps(self.rows, self.foreign, self.state, force)

    def follow(self, mobility: NDArray[np.float64]) -> None:
        """Let the nodes of all levels be as free as in a motion: inverse masses ``(m, 3)`` [1/kg] of the level around.

        What a motion prescribes, or gives a large mass, does not move in substeps; else the elements there would be
        softer by the square of their steps.
        """
        free = len(self.inverse)
        self.inverse[:] = self.step**2 * mobility[self.rows[:free]]
        for inner in levels_of(self.terms):
            inner.follow(mobility[self.rows])

    def carry(self, load: NDArray[np.float64], fall: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean internal force ``(m, 3)`` [N] at u = 0 of substeps in which loads act; collective.

        With it a load bends the elements at its nodes as they are, K_eff u = f + carry(f) for K u = f, where f alone
        would give the nodes a window's free flight. It has no resultant.

        Args:
            load: ``(m, 3)`` [N] at the nodes of the level around, equal on all copies of a node.
            fall: ``(3,)`` [m/s^2] acceleration of all but what is held: in a frame that falls, this moves against it.
        """
        steps, place, pull = self.substeps, self.state[0], self.state[1]
        free = len(self.inverse)
        mine, force = load[self.rows], np.zeros_like(load)
        inside = sum((inner.carry(mine, fall) for inner in levels_of(self.terms)), np.zeros_like(mine))
        held, speed = np.where(self.inverse == 0.0, fall, 0.0), 0.0
        place.fill(0.0)
        for coefficients in zip(steps.memory, steps.rate, steps.weight, strict=True):
            for term in self.terms:
                term.add(place, pull)
            pull += inside
            self.shared.add(pull)
            pull[:free] += mine[:free]
            take_substep(coefficients, self.inverse, self.change, self.state)
            speed = coefficients[0] * speed + coefficients[1] * self.step**2
            place[:free] -= speed * held
        self.state[2, :free] -= mine[:free]  # the weights add up to one
        end_substeps(self.rows, self.foreign, self.state, force)
        return force

    def means(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what elements of each level feel on average over the step, of linear forces the mean; collective.

        Args:
            values: ``(m, 3)`` displacements, or velocities, of the level around.

        Returns:
            ``(levels, m, 3)``, of this level and those inside it; in each the nodes of its elements count.
        """
        steps, place, pull = self.substeps, self.state[0], self.state[1]
        begin_substeps(self.rows, values, self.state)
        total = np.zeros(())
        for coefficients in zip(steps.memory, steps.rate, steps.weight, strict=True):
            inner = [level.means(place) for level in levels_of(self.terms)]
            total = total + coefficients[2] * np.concatenate([place[None], *inner])
            for term in self.terms:
                term.add(place, pull)
            self.shared.add(pull)
            take_substep(coefficients, self.inverse, self.change, self.state)
        self.state[2] = 0.0
        result = np.repeat(values[None], len(total), axis=0)
        result[:, self.rows] = total
        return result

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return u . K_eff u / 2, of which hourglass modes have what they have without levels; collective."""
        hourglass = sum(term.energy(displacement).hourglass for term in self.plain)
        return Energy(linear_energy(self, displacement, None).strain - hourglass, hourglass=hourglass)


def levels_of(terms: Sequence[InternalForce]) -> list[SubsteppedElements]:
    """Return those of some force terms that have levels."""
    return [term for term in terms if isinstance(term, SubsteppedElements)]


def check_elastic(materials: Sequence[Material], kinematics: Kinematics, ratios: tuple[int, ...]) -> None:
    """Refuse levels where forces depend on the path: a mean over substeps from rest is no path.

    Raises:
        LevelError: With what is not linear elastic.
    """
    yielding = [material for material in materials if material.plasticity is not None]
    if yielding or kinematics != "small":
        cause = f"{len(yielding)} of the materials yield" if yielding else f"kinematics = {kinematics}"
        raise LevelError(
            f"local steps (ratios {', '.join(map(str, ratios))}) need linear elastic elements at small strains, but"
            f" {cause}; scheme = held_velocity or gravouil_combescure is for them"
        )


def build_level(
    comm: MPI.Comm, body: Body, levels: Levels, number: int, around: NDArray[np.int32]
) -> SubsteppedElements:
    """Build a level and those inside it; collective.

    Args:
        comm: Communicator of the model.
        body: The model.
        levels: Levels of its elements.
        number: Which level.
        around: ``(m,)`` nodes of the level around it.
    """
    nodes, free = level_nodes(body, levels.level, number)
    terms = own_terms(body, levels.level == number, nodes)
    substeps = Substeps.of(levels.ratios[number - 1], number, levels.damping)
    if number < len(levels.ratios):
        inner = replace(levels, step=levels.step / levels.ratios[number - 1])
        terms.append(build_level(comm, body, inner, number + 1, nodes))
    shared = SharedNodes(comm, body.local.nodes[nodes[:free]], body.shared.clock)
    mass = np.where(body.mass > 0.0, body.mass, np.inf)[nodes[:free], None]
    made = SubsteppedElements(
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
    return replace(made, at_once=arrays_at_once(made))


def arrays_at_once(level: SubsteppedElements) -> tuple[tuple[NDArray, ...], ...]:
    """Return ``SubsteppedElements.at_once`` of a level: Python between substeps costs as much as small levels do."""
    inner = levels_of(level.terms)
    own = [term for term in level.terms if term not in inner]
    matrix = own[0] if len(own) == 1 else None
    if not isinstance(matrix, AssembledElements) or level.shared.exchanged or (inner and not inner[0].at_once):
        return ()
    steps = level.substeps
    coefficients = np.column_stack([steps.memory, steps.rate, steps.weight])
    arrays = (level.rows, level.foreign, coefficients, level.inverse, level.change, level.state)
    return ((*arrays, matrix.pointer, matrix.columns, matrix.blocks), *(inner[0].at_once if inner else ()))


def level_nodes(body: Body, level: NDArray[np.int32], number: int) -> tuple[NDArray[np.int32], int]:
    """Return the local nodes but slaves of a level and those inside it, and how many of them move; collective.

    Those that move come first: no element of an outer level has them, on any rank, not even by a slave.
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


def own_terms(body: Body, chosen: NDArray[np.bool_], nodes: NDArray[np.int32]) -> list[InternalForce]:
    """Return the forces of some elements of a body at some of its nodes, none of them a slave."""
    here = np.isin(body.tie.slave, body.elements.cells[chosen])
    tie = Tie(body.tie.slave[here], body.tie.master[here], body.tie.weight[here])
    order = np.concatenate([nodes, tie.slave])
    elements = body.elements.subset(chosen)
    renumbered = replace(elements, points=elements.points[order], cells=positions(order, elements.cells))
    return tied_terms(renumbered, Tie(positions(order, tie.slave), positions(order, tie.master), tie.weight))


def tied_terms(elements: Elements, tie: Tie) -> list[InternalForce]:
    """Return the force terms of linear elements at all nodes but the slaves, which must be the last ones.

    Boxes with a slave share no stiffness with others any more: they are assembled.
    """
    box = in_rows(elements) & ~np.isin(elements.cells, tie.slave).any(axis=1)
    terms: list[InternalForce] = []
    if box.any():
        terms.append(CongruentElements.build(elements.subset(box)))
    if not box.all():
        terms.append(without_slaves(AssembledElements.build(elements.subset(~box)), tie))
    return terms


def without_slaves(assembled: AssembledElements, tie: Tie) -> AssembledElements:
    """Return T^T K T of an assembled stiffness at all nodes but the slaves, T the tie."""
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
    """Return the first ``count`` block rows of a symmetric matrix: upper blocks, diagonal ones halved."""
    row = np.repeat(np.arange(matrix.shape[0] // 3), np.diff(matrix.indptr))
    kept = (row <= matrix.indices) & (row < count)
    columns = matrix.indices[kept].astype(np.int32)
    blocks: NDArray[np.float64] = matrix.data[kept]
    blocks[columns == row[kept]] *= 0.5
    pointer = np.concatenate([[0], np.cumsum(np.bincount(row[kept], minlength=count))]).astype(np.int32)
    return AssembledElements(pointer, columns, blocks)
