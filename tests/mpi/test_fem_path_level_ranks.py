"""Step levels with yielding solder: results do not depend on the ranks, and copies of a node are equal to the bit.

An interrupted run continues on other ranks.
"""

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import SOLDER
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.parallel import checkpoint_state
from reflowshock.fem.parallel.checkpoint_state import State
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import Materials
from tests.support.fem_levels import joint_on_board
from tests.support.fem_program import run_warm

STEP, STEPS, HALF = 1e-9, 160, 80  # [s]
RATE, CENTRE = 3e4, np.array([0.75e-3, 0.75e-3, -0.5e-3])  # [1/s], [m]


def begun(comm: MPI.Comm) -> ExplicitMotion:
    """Return a motion in which the joint is sheared and stretched."""
    item = prepare(joint_on_board(held=False), "dns")["dns"]
    height = item.mesh.points[item.mesh.cells, 2].mean(axis=1)
    item.tables.every[:] = np.select([height < -0.5e-3, height < -0.2e-3], [8, 4], 1)
    local = distribute(comm, item.mesh if comm.rank == 0 else None)
    rank_elements = make_rank_elements(local, item.tables, Materials(solder=SOLDER), "one_point")
    body = make_body(
        comm, rank_elements, item.tables, np.ones(len(rank_elements.steps)), ForceOptions("corotational", STEP)
    )
    motion = ExplicitMotion(body, [], STEP, np.empty(0, np.int32), np.zeros(len(body.mass)))
    away = RATE * (body.local.points - CENTRE)
    motion.velocity[:] = np.column_stack([3 * away[:, 2], away[:, 0], -2 * away[:, 0]])
    body.tie.spread(motion.velocity)
    return motion


def continued(comm: MPI.Comm, parts: list[State]) -> ExplicitMotion:
    """Return a motion continued from the states of all ranks of another division."""
    motion = begun(comm)
    state = checkpoint_state.blank({"motion": motion.state()})
    for part in parts:
        checkpoint_state.take(state, {"motion": part}, {"motion"} if comm.rank == 0 else set())
    assert checkpoint_state.is_complete(state)
    motion.restore(checkpoint_state.values(state)["motion"])
    motion.take_steps(STEPS - HALF)
    return motion


def gathered(comm: MPI.Comm, motion: ExplicitMotion) -> tuple[np.ndarray, float]:
    """Return the displacement of each node on rank 0, all copies compared bit by bit, and the plastic work."""
    parts = comm.gather((motion.body.local.nodes, motion.displacement))
    displacement_of_node: dict[int, np.ndarray] = {}
    for number, value in [pair for part in parts or [] for pair in zip(*part, strict=True)]:
        assert np.array_equal(displacement_of_node.setdefault(int(number), value), value), number
    work = comm.allreduce(motion.internal_energy().plastic)
    return np.array([displacement_of_node[number] for number in sorted(displacement_of_node)]), work


def write_marches(path: str) -> None:
    """Write the marches of two ranks, of two continued from one, and of one continued from two."""
    comm = MPI.COMM_WORLD
    motion = begun(comm)
    motion.take_steps(HALF)
    parts = comm.allgather(motion.state())
    motion.take_steps(STEPS - HALF)
    alone = begun(MPI.COMM_SELF)
    alone.take_steps(HALF)
    marches = [gathered(comm, motion), gathered(comm, continued(comm, [alone.state()]))]
    if comm.rank == 0:
        marches.append(gathered(MPI.COMM_SELF, continued(MPI.COMM_SELF, parts)))
        np.savez(path, displacement=[moved for moved, _ in marches], work=[work for _, work in marches])


def test_flow_is_the_same_on_more_ranks_and_where_it_goes_on_with_others(tmp_path):
    path, script = tmp_path / "moved.npz", tmp_path / "script.py"
    script.write_text(f"from tests.mpi.test_fem_path_level_ranks import write_marches; write_marches({str(path)!r})")
    run_warm([str(script)], 2)
    motion = begun(MPI.COMM_SELF)
    motion.take_steps(STEPS)
    displacement, work = gathered(MPI.COMM_SELF, motion)
    with np.load(path) as marches:
        assert len(marches["work"]) == 3
        assert np.abs(marches["displacement"] - displacement).max() <= 1e-10 * np.abs(displacement).max()
        assert np.abs(marches["work"] - work).max() <= 1e-10 * work
    assert work > 0.0
