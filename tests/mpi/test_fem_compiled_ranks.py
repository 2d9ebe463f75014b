"""Compiled steps on two ranks equal single steps, and copies of a node are equal to the bit."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import SOLDER
from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.compiled_steps import CompiledSteps
from reflowshock.fem.kernels.levels import Interface
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import Materials
from tests.mpi.test_fem_path_level_ranks import gathered
from tests.support.fem_levels import joint_on_board
from tests.support.fem_program import run_warm

STEP, STEPS, WINDOWS = 1e-9, 5, 6  # [s]
TAKES = {"compiled": ExplicitMotion.take_steps, "single": ExplicitMotion._take_single_steps}
RATE = 2e6  # [1/s]


def begun(comm: MPI.Comm) -> tuple[ExplicitMotion, Interface]:
    """Return a dropped motion, sheared until the solder yields, and an interface at its lowest nodes."""
    item = prepare(joint_on_board(held=False), "dns")["dns"]
    local = distribute(comm, item.mesh if comm.rank == 0 else None)
    rank_elements = make_rank_elements(local, item.tables, Materials(solder=SOLDER), "one_point")
    options = ForceOptions("corotational", STEP)
    body = make_body(comm, rank_elements, item.tables, np.ones(len(rank_elements.steps)), options)
    height = body.local.points[:, 2]
    rows = np.flatnonzero(height < comm.allreduce(float(height.min()), MPI.MIN) + 1e-9).astype(np.int32)
    motion = ExplicitMotion(body, [half_sine_drop(1e7, 40 * STEP)], STEP, rows, np.zeros(len(body.mass)))
    motion.velocity[:, 0] = RATE * height
    body.tie.spread(motion.velocity)
    counted = rows[body.shared.owned[rows]]
    random = np.random.default_rng(1)
    change, weights = random.uniform(-1.0, 1.0, (STEPS, 3)), random.random((STEPS + 1, 2))
    return motion, Interface(rows, counted, motion.velocity[rows], change, weights, np.zeros((2, len(counted), 3)))


def marched(comm: MPI.Comm, take) -> list:
    """Return displacements, plastic work, external work, and impulses by node after some windows, on rank 0."""
    motion, interface = begun(comm)
    assert CompiledSteps.of(motion.body, []) is not None
    for _ in range(WINDOWS):
        take(motion, STEPS, interface)
    moved, work = gathered(comm, motion)
    external = comm.allreduce(motion.external_work)
    numbers, impulses = (
        np.concatenate(comm.allgather(part), axis=-1 if part.ndim == 1 else 1)
        for part in (motion.body.local.nodes[interface.counted], interface.impulses)
    )
    return [moved, work, external, impulses[:, np.argsort(numbers)]]


def write_marches(path: str) -> None:
    """Write the results of compiled and of single steps on two ranks."""
    comm = MPI.COMM_WORLD
    marches = {name: marched(comm, take) for name, take in TAKES.items()}
    if comm.rank == 0:
        np.savez(path, **{f"{name}_{k}": value for name, march in marches.items() for k, value in enumerate(march)})


def test_compiled_steps_on_two_ranks_are_single_ones(tmp_path):
    path, script = tmp_path / "moved.npz", tmp_path / "script.py"
    script.write_text(f"from tests.mpi.test_fem_compiled_ranks import write_marches; write_marches({str(path)!r})")
    run_warm([str(script)], 2)
    expected = marched(MPI.COMM_SELF, ExplicitMotion._take_single_steps)
    assert expected[1] > 0.0
    with np.load(path) as marches:
        for name in TAKES:
            for k, value in enumerate(expected):
                assert marches[f"{name}_{k}"] == pytest.approx(value, rel=1e-10, abs=1e-11 * np.abs(value).max()), k
