"""Ranks must not change what levels along a path do to solder that flows, nor may copies of a node differ in a bit."""

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import SOLDER
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_pieces
from reflowshock.fem.parallel.local_mesh import distribute
from tests.support.fem_levels import joint_on_board
from tests.support.fem_program import run_warm

STEP, STEPS = 1e-9, 160  # [s]
RATE, CENTRE = 3e4, np.array([0.75e-3, 0.75e-3, -0.5e-3])  # [1/s], [m]


def moved(comm: MPI.Comm) -> tuple[np.ndarray, np.ndarray, float]:
    """Return input numbers of this rank's nodes, their displacements, and the plastic work of all ranks."""
    item = prepare(joint_on_board(held=False), "dns")["dns"]
    height = item.mesh.points[item.mesh.cells, 2].mean(axis=1)
    item.tables.every[:] = np.select([height < -0.5e-3, height < -0.2e-3], [8, 4], 1)
    local = distribute(comm, item.mesh if comm.rank == 0 else None)
    pieces = make_pieces(local, item.tables, Materials(solder=SOLDER), "one_point")
    body = make_body(comm, pieces, item.tables, np.ones(len(pieces.steps)), ForceOptions("corotational", STEP))
    motion = ExplicitMotion(body, [], STEP, np.empty(0, np.int32), np.zeros(len(body.mass)))
    away = RATE * (body.local.points - CENTRE)
    motion.velocity[:] = np.column_stack([3 * away[:, 2], away[:, 0], -2 * away[:, 0]])
    body.tie.spread(motion.velocity)
    motion.take_steps(STEPS)
    return body.local.nodes, motion.displacement, comm.allreduce(motion.internal_energy().plastic)


def write_march(path: str) -> None:
    """Compare the copies of all nodes bit by bit, and write one of each and the plastic work."""
    comm = MPI.COMM_WORLD
    nodes, displacement, work = moved(comm)
    parts = comm.gather((nodes, displacement))
    if comm.rank == 0:
        found: dict[int, np.ndarray] = {}
        for number, value in [pair for part in parts for pair in zip(*part, strict=True)]:
            assert np.array_equal(found.setdefault(int(number), value), value), number
        np.savez(path, displacement=[found[number] for number in sorted(found)], work=work)


def test_flow_is_the_same_on_more_ranks(tmp_path):
    path, script = tmp_path / "moved.npz", tmp_path / "script.py"
    script.write_text(f"from tests.mpi.test_fem_path_level_ranks import write_march; write_march({str(path)!r})")
    run_warm([str(script)], 2)
    nodes, displacement, work = moved(MPI.COMM_SELF)
    with np.load(path) as found:
        assert (
            np.abs(found["displacement"] - displacement[np.argsort(nodes)]).max() <= 1e-10 * np.abs(displacement).max()
        )
        assert abs(found["work"] - work) <= 1e-10 * work
    assert work > 0.0
