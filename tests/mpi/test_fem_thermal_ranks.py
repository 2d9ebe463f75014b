"""Heated board and package are equal on one and on two ranks; errors of one rank end both."""

from tests.support.fem_program import run_script

SCRIPT = """
import json, sys
from dataclasses import replace
from pathlib import Path
import numpy as np
from mpi4py import MPI
from reflowshock.fem.errors import AgreedError
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.structure import ThermalStructure
from tests.support.thermal_models import small_structure

world, folder = MPI.COMM_WORLD, Path(sys.argv[1]) / str(MPI.COMM_WORLD.rank)
folder.mkdir()
assembly = small_structure(folder, package="moved", corner_displacement=-1e-4)
wrenches = np.random.default_rng(0).normal(size=(4, 2, 6)) * ([1e-3] * 3 + [1e-7] * 3)
differences = {}
for name, thermal, rigid in (("moved", assembly.thermal, []), ("floating", Thermal(), [1e-5])):
    comms = MPI.COMM_SELF, world
    alone, together = (ThermalStructure.build(comm, replace(assembly, thermal=thermal)) for comm in comms)
    one, two = (item.solve(473.15, -1e-4, wrenches, np.array(rigid)) for item in (alone, together))
    for key in ("displacement", "pad_motion", "corner_force"):
        first, second = getattr(one, key), getattr(two, key)
        if len(first):
            differences[f"{name} {key}"] = float(np.abs(second - first).max() / np.abs(first).max())
try:
    ThermalStructure.build(world, replace(assembly, pads=replace(assembly.pads, radii=10.0 * assembly.pads.radii)))
except AgreedError as error:
    messages = world.allgather(str(error))
if world.rank == 0:
    print(json.dumps({"differences": differences, "messages": messages}))
"""


def test_two_ranks_give_the_state_of_one(tmp_path):
    actual = run_script(SCRIPT, tmp_path, ranks=2)
    assert len(actual["differences"]) == 5
    assert {name: value for name, value in actual["differences"].items() if not value < 1e-10} == {}
    assert len(set(actual["messages"])) == 1
    assert "beyond board_side" in actual["messages"][0]
