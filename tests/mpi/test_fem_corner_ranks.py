"""Sums over four ranks, three of which meet at one corner of the interface, are exact."""

import pytest

from tests.support.fem_program import run_script

SCRIPT = """
import contextlib, json, sys
import numpy as np
from mpi4py import MPI
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.parallel.communicators import Communicators
from reflowshock.fem.coupling.participants import couple
from reflowshock.fem.estimates.placement import shared
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.roles import ELASTIC
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.problem.shock import Coupling
from reflowshock.fem.division.tables import model_inputs
from tests.stability.test_fem_division import board, joint
from reflowshock.cases.hard.trials.coupled import checked, surveyed

world = MPI.COMM_WORLD


def quarters(points, corner):  # quarters of the plane around a vertical edge, one for each rank
    side = points[:, :2] > corner + 1e-6
    return ((side[:, 0] + 2 * side[:, 1]) % world.size).astype(np.int32)


def moved(scheme):
    whole, found, rules = surveyed(append([board(4), joint(0.25e-3, 0.25e-3)]), coupling=Coupling(scheme=scheme))
    division = checked(whole, found, rules)
    inputs, bodies = model_inputs(whole, division), {}
    corner = inputs["macro"].mesh.points[inputs["macro"].tables.interface].max(axis=0)[:2]
    comms = Communicators(world, shared(("macro", "meso"), world.size))
    for role, item in inputs.items():
        centre = item.mesh.points[item.mesh.cells].mean(axis=1)
        ranks = quarters(centre, corner if role == "macro" else corner / 3)
        mesh = (item.mesh, ranks) if world.rank == 0 else (None, None)
        rank_elements = make_rank_elements(distribute(comms.models[role], *mesh), item.tables, ELASTIC)
        step = division.plan.window if role == "macro" else division.meso_step
        factor = np.ones(len(rank_elements.steps))
        bodies[role] = make_body(comms.models[role], rank_elements, item.tables, factor, ForceOptions(step=step))
    at_corner = [(np.abs(body.local.points[:, :2] - corner).max(axis=1) < 1e-9).any() for body in bodies.values()]
    participants, _, found = couple(comms, bodies, dict.fromkeys(bodies, []), division.plan, scheme_of(scheme))
    for part in participants.values():
        motion = part.motion
        wave = np.sin(1e3 * motion.body.local.points @ [1.0, 0.7, 0.4])
        motion.velocity[:] = np.where(motion.mobility > 0.0, wave[:, None] * [1.0, -0.5, 0.3], 0.0)
    for _ in range(40):
        for part in participants.values():
            part.begin_window()
        for part in participants.values():
            part.finish_window()
    sums = np.zeros(4)
    for part in participants.values():
        motion, owned = part.motion, part.motion.body.shared.owned
        pattern = np.cos(2e3 * motion.body.local.points[owned] @ [0.3, -0.8, 1.0])
        sums[:3] += pattern @ motion.displacement[owned]
        sums[3] += np.abs(motion.displacement[owned]).sum()
    exact = max(found.rigid, found.linear, found.tie, found.interface)
    return world.allreduce(sums).tolist(), world.allreduce(int(any(at_corner))), exact


with contextlib.redirect_stdout(sys.stderr):
    found = {scheme: moved(scheme) for scheme in ("held_velocity", "local_steps", "gravouil_combescure")}
if world.rank == 0:
    print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def sums_by_ranks(tmp_path_factory) -> dict[int, dict]:
    """Return number of ranks -> sums that the script prints on them."""
    return {ranks: run_script(SCRIPT, tmp_path_factory.mktemp(f"ranks{ranks}"), ranks) for ranks in (1, 4)}


@pytest.mark.parametrize("scheme", ["held_velocity", "local_steps", "gravouil_combescure"])
def test_corner_of_the_cut_where_three_ranks_meet(sums_by_ranks, scheme):
    (alone, _, _), (together, holders, exact) = sums_by_ranks[1][scheme], sums_by_ranks[4][scheme]
    assert holders >= 3
    assert exact < 1e-12
    assert max(abs(a - b) for a, b in zip(alone, together, strict=True)) < 1e-10 * alone[-1]
