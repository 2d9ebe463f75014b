"""Placements of two models on ranks: predicted and measured window times, busy shares, and coupling overhead.

    PYTHONPATH=. python benchmarks/placement.py [RANKS ...]  (default 1 2; three minutes; writes results/placement.json)

The package of ``cases/bga_drop`` on its board, linear, copper at its true mass, all joints fine, with both schemes; and
``cases/jedec_bga`` in finite rotation with plastic solder, its scaled masses and one fine joint. The script starts
itself on the ranks. Ranks wait for each other, so that interruptions by other programs count twice; figures are
therefore means over the fastest twentieth of the windows, and predictions use the minimum of a few samples.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np
from mpi4py import MPI

from benchmarks.support import results, turns
from benchmarks.support.drop_scene import DropScene
from reflowshock.fem.coupling.stopwatch import Stopwatch
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.parallel.mpi_environment import without_mpi_job
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.shock import Ranks
from reflowshock.fem.run.dynamics import make_participants
from reflowshock.fem.run.package import PackageDrop
from reflowshock.fem.run.time_loop import run_window
from reflowshock.workflow.process.launch import mpi_command

SCHEMES = ("held_velocity", "local_steps")
SCALED = ("shock.numerics.mass_scaled=['copper', 'solder', 'column']",)
NONLINEAR = {"kinematics": "corotational", "plasticity": "on", "duration": 1e-3}
WINDOWS, FASTEST = 300, 15
PREDICTION, OVERHEAD, BUSY = 0.3, 0.03, 0.9


def measure(world: MPI.Comm, request: RunInput) -> dict:
    """Measure the windows (exchange intervals) of a run on all ranks; collective.

    Args:
        world: Communicator of all ranks.
        request: Input of the run.

    Returns:
        Summary of the placement with the predicted time, ``substeps``, ``window_seconds``, ``measured / predicted``,
        ``busy_shares`` by rank, ``busy_share``, ``coupling_overhead`` and ``load_average``; equal on all ranks.
    """
    problem = PackageDrop.read(world, request)
    plan = problem.place(world)
    comms = Communicators(world, plan.placement)
    models, steps = problem.build(comms, plan.cells)
    participants, channels, _ = make_participants(comms, problem, models, steps)
    sums = {role: model.body.shared.clock for role, model in models.items()}
    records = np.empty((WINDOWS, 4))
    for record in records:
        stopwatch = Stopwatch(sums, channels)
        run_window(participants, stopwatch)
        waits = sum(clock.waiting for clock in sums.values()), sum(clock.waiting for clock in channels)
        record[:] = sum(stopwatch.turns.values()), *waits, sum(clock.packing for clock in channels)
    ranks = np.array(world.allgather(records))
    chosen = np.argsort(ranks[:, :, 0].max(axis=0))[:FASTEST]
    total, sum_waiting, coupling_waiting, packing = ranks[:, chosen].mean(axis=1).T
    return plan.summary | {
        "substeps": steps.plan.substeps,
        "window_seconds": float(total.max()),
        "measured / predicted": float(total.max() / plan.summary["predicted_window_seconds"]),
        "busy_shares": (1.0 - (sum_waiting + coupling_waiting) / total).tolist(),
        "busy_share": float(1.0 - (sum_waiting + coupling_waiting).sum() / total.sum()),
        "coupling_overhead": float(((packing + coupling_waiting) / total).min()),
        "load_average": os.getloadavg()[0],
    }


def write_inputs(folder: Path) -> dict[str, RunInput]:
    """Write the meshes to a folder; return the inputs of the coupling schemes and of the nonlinear case by name."""
    for name in ("linear", "nonlinear"):
        (folder / name).mkdir()
    scene = DropScene.write(folder / "linear")
    inputs = {name: scene.request("two_scale", {"scheme": name, "fine_joints": "all"}, {}) for name in SCHEMES}
    scene = DropScene.write(folder / "nonlinear", SCALED, "jedec_bga")
    inputs["jedec_bga"] = scene.request("two_scale", {"fine_joints": ["A10"], "levels": 1}, NONLINEAR)
    return inputs


def with_placements(inputs: dict[str, RunInput], size: int) -> dict[str, str]:
    """Return the inputs with all placements of models on ``size`` ranks: words for the run -> input as JSON text."""
    table = {}
    for name, request in inputs.items():
        for placement in ("shared", "disjoint") if size > 1 else ("shared",):
            shock = request.shock.model_copy(update={"ranks": Ranks(total=size, placement=placement)})
            text = request.model_copy(update={"shock": shock}).model_dump_json()
            table[f"{name}, {placement}, {size}"] = text
    return table


def main(counts: list[int]) -> None:
    """Measure all placements on each number of ranks, print them and store them with their limits."""
    table: dict[str, dict] = {}
    with tempfile.TemporaryDirectory() as folder:
        inputs, path = write_inputs(Path(folder)), Path(folder) / "requests.json"
        for count in counts:
            path.write_text(json.dumps(with_placements(inputs, count)))
            program = [sys.executable, "-m", "mpi4py", __file__, str(path)]
            command = mpi_command(count, program, oversubscribe=True)
            subprocess.run(command, env=without_mpi_job(os.environ), stdout=subprocess.DEVNULL, check=True)
            table |= json.loads(path.read_text())
    results.write_and_print(
        "placement", {"rows": table, "bars": {name: judge_placement(row) for name, row in table.items()}}
    )


def judge_placement(row: dict) -> dict:
    """Compare the figures of a placement with their limits; the busy share counts only where ranks share both models.

    Args:
        row: Figures of ``measure``.

    Returns:
        Name of a limit -> value, limit, sense of the comparison and whether it is satisfied, as ``turns.bar`` returns
        it.
    """
    figures = {
        "error of the prediction": turns.bar(abs(row["measured / predicted"] - 1.0), PREDICTION, at_least=False),
        "coupling_overhead": turns.bar(row["coupling_overhead"], OVERHEAD, at_least=False),
    }
    return figures | ({"busy_share": turns.bar(row["busy_share"], BUSY)} if row["chosen"].startswith("shared") else {})


def measure_on_ranks(world: MPI.Comm, path: Path) -> None:
    """Measure the inputs in a file and overwrite it with name -> figures of ``measure``; collective.

    Args:
        world: Communicator of all ranks.
        path: File that holds the result of ``with_placements`` as JSON.
    """
    inputs = json.loads(path.read_text())
    rows = {name: measure(world, RunInput.model_validate_json(text)) for name, text in inputs.items()}
    if world.rank == 0:
        path.write_text(json.dumps(rows))


if __name__ == "__main__":
    if sys.argv[-1].endswith(".json"):
        measure_on_ranks(MPI.COMM_WORLD, Path(sys.argv[-1]))
    else:
        main([int(value) for value in sys.argv[1:]] or [1, 2])
