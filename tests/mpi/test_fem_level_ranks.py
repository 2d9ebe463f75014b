"""Step levels: the force does not depend on the ranks, and all copies of a node are equal to the bit."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.loads.load import NodalForces, half_sine_drop
from reflowshock.fem.loads.pulse import HalfSine
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_levels import joint_on_board, levelled
from tests.support.fem_program import run_warm

RATIOS, WINDOWS = (4, 3, 3), 20


def moved(comm: MPI.Comm) -> tuple[np.ndarray, np.ndarray]:
    """Return input numbers of the nodes of this rank and their displacements after some windows under many loads."""
    model = levelled(joint_on_board(), ELASTIC, RATIOS, comm=comm)
    body = model.body
    nodes = np.arange(0, comm.allreduce(int(body.local.nodes.max()), MPI.MAX), 5)
    push = NodalForces.build(body, nodes, np.sin(np.arange(3 * len(nodes))).reshape(-1, 3), HalfSine(1.0, 1e-6))
    motion = ExplicitMotion(
        body, [push, half_sine_drop(1e4, 1e-6)], model.window, np.empty(0, np.int32), np.zeros(len(body.mass))
    )
    motion.launch(np.array([1.0, 0.5, -0.3]))
    for _ in range(WINDOWS):
        motion.advance()
        motion.update_force()
    return body.local.nodes, motion.displacement


def write_march(path: str) -> None:
    """Compare the copies of all nodes bit by bit and write one of each."""
    comm = MPI.COMM_WORLD
    nodes, displacement = (comm.gather(values) for values in moved(comm))
    if comm.rank == 0:
        displacement_of_node: dict[int, np.ndarray] = {}
        for number, value in zip(np.concatenate(nodes), np.concatenate(displacement), strict=True):
            assert np.array_equal(displacement_of_node.setdefault(int(number), value), value), number
        np.save(path, np.array([displacement_of_node[number] for number in sorted(displacement_of_node)]))


@pytest.fixture(scope="module")
def alone() -> np.ndarray:
    """Return the displacements of all nodes on one rank, in input order, shape (n, 3) [m]."""
    nodes, displacement = moved(MPI.COMM_SELF)
    return displacement[np.argsort(nodes)]


@pytest.mark.parametrize("ranks", [pytest.param(2, marks=pytest.mark.long), 4])
def test_displacements_are_the_same_on_more_ranks(alone, tmp_path, ranks):
    path = tmp_path / "moved.npy"
    script = tmp_path / "script.py"
    script.write_text(f"from tests.mpi.test_fem_level_ranks import write_march; write_march({str(path)!r})")
    run_warm([str(script)], ranks)
    assert np.abs(np.load(path) - alone).max() <= 1e-10 * np.abs(alone).max()
