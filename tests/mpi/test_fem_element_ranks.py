"""Bodies of every kind of element move equally on one and on two ranks, and their fields are written."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.boxes import KINDS
from tests.support.fem_program import run_script

SCRIPT = """
import json, sys
from pathlib import Path
import numpy as np
from mpi4py import MPI
from reflowshock.fem.model.assembly import make_body, make_rank_elements
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.output.fields import Fields
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import ELASTIC
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.division.tables import prepare
from reflowshock.cases.hard.trials.boxes import KINDS, box

comm, result = MPI.COMM_WORLD, {}
for name, kind in KINDS.items():
    points, cells = box(kind, np.linspace(0, 4e-3, 5), np.linspace(0, 2e-3, 3), np.linspace(0, 1e-3, 3))
    item = prepare(MeshData(points, cells, np.zeros(len(cells), np.int32), ("board",), {}), "dns")["dns"]
    local = distribute(comm, item.mesh if comm.rank == 0 else None)
    rank_elements = make_rank_elements(local, item.tables, ELASTIC, name if kind.nodes == 8 else "incompatible_modes")
    body = make_body(comm, rank_elements, item.tables, np.ones(len(rank_elements.steps)))
    body.free[body.local.points[:, 0] < 1e-9] = False
    step = 0.9 * comm.allreduce(float(rank_elements.steps.min(initial=np.inf)), MPI.MIN)
    motion = ExplicitMotion(body, [half_sine_drop(1e4, 5e-5)], step, np.empty(0, np.int32), np.zeros(len(body.mass)))
    for _ in range(100):
        motion.advance()
        motion.update_force()
    fields = Fields(comm, body, item.tables.part[local.cell_numbers], Path(sys.argv[1]) / f"{name}.pvd")
    fields.write(fields.sample(motion.displacement, motion.time))
    fields.close()
    owned = body.shared.owned
    displacement = np.zeros((item.tables.nodes, 3))
    displacement[body.local.nodes[owned]] = motion.displacement[owned]
    held = sum((term.energy(motion.displacement) for term in body.terms), Energy())
    parts = np.array([held.strain, held.hourglass, motion.kinetic_energy(), motion.external_work])
    result[name] = {"displacement": comm.allreduce(displacement).tolist(), "energies": comm.allreduce(parts).tolist()}
if comm.rank == 0:
    print(json.dumps(result))
"""


def test_two_ranks_give_the_results_of_one(tmp_path):
    single, double = (run_script(SCRIPT, tmp_path, ranks) for ranks in (1, 2))
    for name in KINDS:
        first, second = (np.array(run[name]["displacement"]) for run in (single, double))
        assert np.abs(second - first).max() < 1e-10 * np.abs(first).max(), name
        assert double[name]["energies"] == pytest.approx(single[name]["energies"], rel=1e-9, abs=0.0), name
        strain, hourglass, kinetic, work = double[name]["energies"]
        assert strain + hourglass + kinetic == pytest.approx(work, rel=1e-9), name
        assert (hourglass > 0.0) == (name == "one_point")
        assert list(tmp_path.glob(f"{name}*.vtu"))
