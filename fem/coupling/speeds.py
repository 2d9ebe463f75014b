"""What an update of an element costs each rank: the program's own force terms, timed on samples of the mesh.

Elements are of five families, which ``force.force_terms`` computes in five ways: boxes that share stiffnesses, other
linear ones whose matrices are assembled, those with a path, boxes that turn, and other hexahedra that turn. A step
costs a fixed part (calls) and one per element (force, and update of its nodes); two samples of different size tell them
apart.
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
BATCHES, BATCH_SECONDS = 24, 0.001  # short: some fall between two turns of another program on the core
ALIKE = 1.2  # ratio of two speeds below which they may be one, measured twice
MESSAGE_ROWS, MESSAGES = 500, 40


@dataclass(frozen=True, slots=True)
class Kind:
    """What decides on the family of elements besides their shape.

    Attributes:
        materials: Material of each part.
        formulation: Of hexahedra.
        kinematics: Whether rotations and strains are small.
        step: dt [s].
    """

    materials: Sequence[Material]
    formulation: str
    kinematics: Kinematics
    step: float


@dataclass(frozen=True, slots=True)
class StepCost:
    """Seconds of a step, by family, of one rank ``(5,)`` or of all of them ``(ranks, 5)``.

    Attributes:
        fixed: Of one step, however many elements.
        element: Of each element.
    """

    fixed: NDArray[np.float64]
    element: NDArray[np.float64]


def families(mesh: MeshData, kind: Kind) -> NDArray[np.int8]:
    """Return the family ``(ne,)`` of each element."""
    elastic = np.array([material.plasticity is None for material in kind.materials])[mesh.part]
    linear = elastic & (kind.kinematics == "small")
    box = is_box(mesh.points[mesh.cells])
    turning = elastic & (kind.kinematics == "corotational") & (mesh.cells.shape[1] == 8)
    return np.select([linear & box, linear, turning & box, turning], [0, 1, 3, 4], 2).astype(np.int8)


def samples(mesh: MeshData, family: NDArray[np.int8], ranks: int) -> dict[int, tuple[MeshData, MeshData]]:
    """Return a small and a large sample of each family that a mesh has: neighbours in the order of its cells."""
    found = {}
    for number in np.unique(family).tolist():
        chosen = np.flatnonzero(family == number)
        share = min(LARGE, -(-len(chosen) // ranks))
        found[number] = some_cells(mesh, chosen, min(SMALL, share)), some_cells(mesh, chosen, share)
    return found


def some_cells(mesh: MeshData, chosen: NDArray[np.int64], count: int) -> MeshData:
    """Return the middle ``count`` of the chosen cells as a mesh without facets."""
    begin = (len(chosen) - count) // 2
    taken = chosen[begin : begin + count]
    return without_unused_nodes(MeshData(mesh.points, mesh.cells[taken], mesh.part[taken], mesh.part_names, {}))[0]


def measured_costs(world: MPI.Comm, found: Mapping[int, tuple[MeshData, MeshData, Kind]]) -> StepCost:
    """Time a small and a large sample of each family on all ranks at the same time, as a run would be; collective.

    Returns:
        ``(ranks, 5)``; zero for families without a sample.
    """
    fixed, element = np.zeros(len(FAMILIES)), np.zeros(len(FAMILIES))
    for number, (small, large, kind) in found.items():
        terms = [sample_terms(sample, kind) for sample in (small, large)]
        world.Barrier()
        first, second = (
            seconds_of_step(term, len(mesh.points)) for term, mesh in zip(terms, (small, large), strict=True)
        )
        fixed[number], element[number] = line_through((len(small.cells), first), (len(large.cells), second))
    return StepCost(np.array(world.allgather(fixed)), np.array(world.allgather(element)))


def line_through(small: tuple[int, float], large: tuple[int, float]) -> tuple[float, float]:
    """Return the fixed seconds of a step and those of each element, from two samples: elements, seconds.

    At least half of the large sample's time is its elements'; all else would be a disturbed measurement.
    """
    count = large[0] - small[0]
    element = max((large[1] - small[1]) / count if count else 0.0, 0.5 * large[1] / large[0])
    return max(large[1] - element * large[0], 0.0), element


def sample_terms(sample: MeshData, kind: Kind) -> list[ForceTerm]:
    """Return the force terms of a sample."""
    elements = elements_of(sample.points, sample.cells, sample.part, kind.materials, kind.formulation)
    return force_terms(elements, kind.materials, kind.kinematics, kind.step)


def seconds_of_step(terms: Sequence[ForceTerm], nodes: int) -> float:
    """Return the seconds of a step of some terms with ``nodes`` nodes at rest: the least of a few batches."""
    state, gravity = np.zeros((3, nodes, 3)), np.zeros(3)
    mobility = np.zeros((nodes, 3))  # nothing moves: a step that no element bears would turn them inside out

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
    """Return the seconds of a message of some nodes between neighbours, the largest of all ranks; collective."""
    sent, received = np.zeros((MESSAGE_ROWS, 3)), np.empty((MESSAGE_ROWS, 3))
    before, after = (world.rank - 1) % world.size, (world.rank + 1) % world.size
    world.Barrier()
    seconds = []
    for _ in range(MESSAGES if world.size > 1 else 0):
        begin = time.perf_counter()
        world.Sendrecv(sent, after, recvbuf=received, source=before)
        seconds.append(time.perf_counter() - begin)
    return float(world.allreduce(float(np.median(seconds)) if seconds else 0.0, MPI.MAX))


def speeds_of(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the speed ``(ranks,)`` of each rank from the seconds ``(ranks,)`` that it needs for the same work.

    Their mean is one; ranks as fast as each other but for the error of a measurement are alike.
    """
    speeds = 1.0 / seconds
    return np.ones(len(speeds)) if speeds.max() < ALIKE * speeds.min() else speeds / speeds.mean()
