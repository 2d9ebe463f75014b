"""Implicit steps and natural modes are the same on one and on two ranks."""

import pytest

from tests.support.fem_program import run_script

SCRIPT = """
import json, sys
import numpy as np
from mpi4py import MPI
from reflowshock.fem.model.assembly import make_body, make_rank_elements
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.dynamics.modal import natural_modes
from reflowshock.materials.roles import ELASTIC
from reflowshock.fem.division.tables import prepare
from tests.support.fem_models import small_assembly

comm = MPI.COMM_WORLD
item = prepare(append(small_assembly(2, size=1e-3)), "dns")["dns"]
rank_elements = make_rank_elements(distribute(comm, item.mesh if comm.rank == 0 else None), item.tables, ELASTIC)
body = make_body(comm, rank_elements, item.tables, np.ones(len(rank_elements.steps)))
equations = Equations.of(comm, body)
motion = ImplicitMotion(comm, body, [half_sine_drop(1e4, 5e-5)], 2e-6)
for _ in range(10):
    motion.advance()
    motion.update_force()
owned = body.shared.owned
displacement = np.zeros((item.tables.nodes, 3))
displacement[body.local.nodes[owned]] = motion.displacement[owned]
parts = [motion.kinetic_energy(), motion.internal_energy().total, motion.external_work]
result = {
    "displacement": comm.allreduce(displacement).tolist(),
    "energies": comm.allreduce(np.array(parts)).tolist(),
    "frequencies": natural_modes(equations, 4).frequency.tolist(),
}
if comm.rank == 0:
    print(json.dumps(result))
"""


def test_two_ranks_give_the_results_of_one(tmp_path):
    single, double = (run_script(SCRIPT, tmp_path, ranks) for ranks in (1, 2))
    scale = max(abs(value) for point in single["displacement"] for value in point)
    for first, second in zip(single["displacement"], double["displacement"], strict=True):
        assert second == pytest.approx(first, abs=1e-8 * scale)
    assert double["frequencies"] == pytest.approx(single["frequencies"], rel=1e-8)
    assert double["energies"] == pytest.approx(single["energies"], rel=1e-8)
    assert sum(double["energies"][:2]) == pytest.approx(double["energies"][2], rel=1e-8)
