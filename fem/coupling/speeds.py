"""Measured cost of an element update on each rank, with the program's own force terms on samples of the mesh.

There are five element families, one for each kind of force term of ``force.force_terms``: boxes with shared stiffness,
other linear elements (assembled), path-dependent elements, corotational boxes, and other corotational hexahedra. A step
has a fixed cost (calls) and a cost per element (force, update of nodes), from two samples of different size.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.elements.mesh_elements import elements_of
from reflowshock.fem.forces.force import ForceTerm, force_terms
from reflowshock.fem.forces.force_congruent import is_box
from reflowshock.fem.kernels.motion import advance
from reflowshock.fem.mesh.mesh import MeshData, without_unused_nodes
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.materials.parameters import Material

FAMILIES = ("box", "assembled", "path", "turning_box", "turning")
LARGE, SMALL = 8192, 128  # elements of a sample; the large one is no larger than a rank's share
BATCHES, BATCH_SECONDS = 24, 0.001  # short batches, so that some run undisturbed by other programs
ALIKE = 1.2  # ratio of speeds below which they count as equal
MESSAGE_ROWS, MESSAGES = 500, 40


@dataclass(frozen=True, slots=True)
class Kind:
    """Properties that determine the element family, apart from the shape.

    Attributes:
        materials: Material of each part.
        formulation: Formulation of hexahedra.
        kinematics: Small, corotational or finite kinematics.
        step: Time step dt [s].
    """

    materials: Sequence[Material]
    formulation: str
    kinematics: Kinematics
    step: float


@dataclass(frozen=True, slots=True)
class StepCost:
    """Cost of a step by element family, shape (5,) for one rank or (ranks, 5) for all ranks.

    Attributes:
        fixed: Fixed time of a step [s].
        element: Time per element [s].
    """

    fixed: NDArray[np.float64]
    element: NDArray[np.float64]


def families(mesh: MeshData, kind: Kind) -> NDArray[np.int8]:
    """Return the family of each element as an index into ``FAMILIES``, shape (ne,).

    0: linear box, 1: other linear element, 2: element with history, 3: corotational box, 4: other corotational
    hexahedron. Elements of a family cost the same.

    Args:
        mesh: Mesh with ne elements.
        kind: Materials of its parts, formulation and kinematics.
    """
    elastic = np.array([material.plasticity is None for material in kind.materials])[mesh.part]
    linear = elastic & (kind.kinematics == "small")
    box = is_box(mesh.points[mesh.cells])
    turning = elastic & (kind.kinematics == "corotational") & (mesh.cells.shape[1] == 8)
    return np.select([linear & box, linear, turning & box, turning], [0, 1, 3, 4], 2).astype(np.int8)


def samples(mesh: MeshData, family: NDArray[np.int8], ranks: int) -> dict[int, tuple[MeshData, MeshData]]:
    """Return a small and a large sample of each family in a mesh, with cells that follow each other in the mesh.

    Args:
        mesh: The mesh.
        family: Index of each element's family in ``FAMILIES``, shape (ne,).
        ranks: Number of ranks that share the mesh, which limits the size of the samples.

    Returns:
        Index of each family present -> (small sample, large sample).
    """
    sampled = {}
    for number in np.unique(family).tolist():
        chosen = np.flatnonzero(family == number)
        share = min(LARGE, -(-len(chosen) // ranks))
        sampled[number] = _some_cells(mesh, chosen, min(SMALL, share)), _some_cells(mesh, chosen, share)
    return sampled


def _some_cells(mesh: MeshData, chosen: NDArray[np.int64], count: int) -> MeshData:
    """Return the middle ``count`` of the chosen cells as a mesh without facets."""
    begin = (len(chosen) - count) // 2
    taken = chosen[begin : begin + count]
    return without_unused_nodes(MeshData(mesh.points, mesh.cells[taken], mesh.part[taken], mesh.part_names, {}))[0]


def measured_costs(world: MPI.Comm, chosen: Mapping[int, tuple[MeshData, MeshData, Kind]]) -> StepCost:
    """Time a small and a large sample of each family on all ranks simultaneously, as in a run; collective.

    Ranks of one machine have equal costs, the least of them: they are not bound to cores, so that a difference is a
    disturbance by other programs.

    Args:
        world: Communicator of all ranks.
        chosen: Index of a family in ``FAMILIES`` -> its small and large sample, and how its elements are computed.

    Returns:
        Costs of shape (ranks, 5), zero for families without a sample.
    """
    fixed, element = np.zeros(len(FAMILIES)), np.zeros(len(FAMILIES))
    machine = world.Split_type(MPI.COMM_TYPE_SHARED)
    for number, (small, large, kind) in chosen.items():
        terms = [sample_terms(sample, kind) for sample in (small, large)]
        world.Barrier()
        first, second = (
            machine.allreduce(seconds_of_step(term, len(mesh.points)), MPI.MIN)
            for term, mesh in zip(terms, (small, large), strict=True)
        )
        fixed[number], element[number] = fit_step_cost(len(small.cells), first, len(large.cells), second)
    machine.Free()
    return StepCost(np.array(world.allgather(fixed)), np.array(world.allgather(element)))


def fit_step_cost(
    small_count: int, small_seconds: float, large_count: int, large_seconds: float
) -> tuple[float, float]:
    """Return the fixed time of a step and the time per element [s], from two samples.

    The elements take at least half of the time of the large sample; a smaller share would be a disturbed measurement.

    Args:
        small_count: Number of elements of the small sample.
        small_seconds: Measured time of a step of the small sample [s].
        large_count: Number of elements of the large sample.
        large_seconds: Measured time of a step of the large sample [s].
    """
    count = large_count - small_count
    element = max((large_seconds - small_seconds) / count if count else 0.0, 0.5 * large_seconds / large_count)
    return max(large_seconds - element * large_count, 0.0), element


def sample_terms(sample: MeshData, kind: Kind) -> list[ForceTerm]:
    """Return the force terms (internal forces with their own elements) of a sample, for timing a step.

    Args:
        sample: Part of a mesh with elements of one family.
        kind: Materials of its parts, formulation, kinematics and time step.
    """
    elements = elements_of(sample.points, sample.cells, sample.part, kind.materials, kind.formulation)
    return force_terms(elements, kind.materials, kind.kinematics, kind.step)


def seconds_of_step(terms: Sequence[ForceTerm], nodes: int) -> float:
    """Return the wall time of one explicit step of force terms with nodes at rest, the minimum of several batches [s].

    Args:
        terms: Force terms that are timed.
        nodes: Number of nodes on which they act.
    """
    state, gravity = np.zeros((3, nodes, 3)), np.zeros(3)
    mobility = np.zeros((nodes, 3))  # nodes stay at rest, since the step may be unstable for these elements

    def steps(count: int) -> float:
        begin = time.perf_counter()
        for _ in range(count):
            advance(state, mobility, gravity, 1.0)
            state[2].fill(0.0)
            for term in terms:
                term.add(state[0], state[2])
        return time.perf_counter() - begin

    steps(1)  # compiles
    count = max(1, int(BATCH_SECONDS / max(steps(2) / 2, 1e-6)))
    return min(steps(count) / count for _ in range(BATCHES))


def measured_latency(world: MPI.Comm) -> float:
    """Return the time of a message between neighbouring ranks [s]; collective.

    Each rank takes the median of several messages; the largest of all ranks is returned, zero for a single rank.

    Args:
        world: Communicator of all ranks.
    """
    sent, received = np.zeros((MESSAGE_ROWS, 3)), np.empty((MESSAGE_ROWS, 3))
    previous, following = (world.rank - 1) % world.size, (world.rank + 1) % world.size
    world.Barrier()
    seconds = []
    for _ in range(MESSAGES if world.size > 1 else 0):
        begin = time.perf_counter()
        world.Sendrecv(sent, following, recvbuf=received, source=previous)
        seconds.append(time.perf_counter() - begin)
    return float(world.allreduce(float(np.median(seconds)) if seconds else 0.0, MPI.MAX))


def speeds_of(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the relative speed of each rank, shape (ranks,), with a mean of one.

    Speeds that differ only by measurement error are set equal.

    Args:
        seconds: Time of each rank for the same work, shape (ranks,) [s].
    """
    speeds = 1.0 / seconds
    return np.ones(len(speeds)) if speeds.max() < ALIKE * speeds.min() else speeds / speeds.mean()
