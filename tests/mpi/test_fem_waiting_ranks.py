"""Ranks that wait for a slow rank sleep: in sums over shared nodes, across the interface, in samples and agreements."""

import pytest

from tests.support.fem_program import run_script

SLOW = 0.3
SCRIPT = f"""
import json, sys, time
import numpy as np
from mpi4py import MPI
from reflowshock.fem.dynamics.energy_balance import EnergyBalance
from reflowshock.fem.dynamics.history import History
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.exchange import Channel, SharedNodes

world = MPI.COMM_WORLD
values = np.ones((3, 3))
shared = SharedNodes(world, np.array([world.rank, 5, 6]))
mine, none = np.arange(3, dtype=np.int32), np.full(3, -1, np.int32)
channel = Channel(world, mine if world.rank else none, none if world.rank else mine, True)
history = History(world, {{"dns": None}}, EnergyBalance(1.0, 1.0, 1.0, 1.0), {{}})

def exchange():
    channel.send(values) if world.rank else channel.receive(values)

waits = {{
    "sum": lambda: shared.add(values),
    "channel": exchange,
    "sample": lambda: history._combine(np.ones(3)),
    "agreement": lambda: agreed(world, lambda: None),
}}
shares = {{}}
for name, wait in waits.items():
    wait()
    world.Barrier()
    begin, core = time.perf_counter(), time.process_time()
    if world.rank:
        time.sleep({SLOW})
    wait()
    shares[name] = time.perf_counter() - begin, time.process_time() - core
    wait()  # the messages can be sent again
if world.rank == 0:
    print(json.dumps(shares))
"""


@pytest.fixture(scope="module")
def shares(tmp_path_factory) -> dict:
    return run_script(SCRIPT, tmp_path_factory.mktemp("waiting"), 2)


@pytest.mark.parametrize("name", ["sum", "channel", "sample", "agreement"])
def test_a_rank_that_waits_leaves_its_core(shares, name):
    wall, core = shares[name]
    assert wall >= 0.9 * SLOW
    assert core < 0.25 * wall
