"""An interrupted run continues on other numbers of ranks and in another placement with unchanged results."""

import json
from pathlib import Path

import pytest

from reflowshock.fem.mesh.mesh import append
from tests.support.fem_models import small_assembly, write_msh
from tests.support.fem_program import run_warm
from tests.support.fem_structures import STEEL, write_structure

# Runs the first input completely and interrupted, and continues it with the other inputs, interrupted again on their
# ranks. Reports for each the largest relative difference of a history from the complete run, the window at which it
# continued, the number of remaining checkpoint folders, and the number of field files.
SCRIPT = """
import json, shutil, sys, traceback
from pathlib import Path
import numpy as np
from mpi4py import MPI
from reflowshock.fem.run import time_loop
from reflowshock.fem.problem.inputs import INPUT, RunInput
from reflowshock.fem.run.package import run_package
from reflowshock.fem.run.structure import run_structure

ENERGIES = {"kinetic", "internal", "plastic", "hourglass", "damping", "external", "interface", "balance"}
world, run_window = MPI.COMM_WORLD, time_loop.run_window

class Killed(Exception):
    pass

def go(changes, name, checkpoints=None, windows=10**9):
    comm = world.Split(0 if world.rank < changes["ranks"] else MPI.UNDEFINED)
    if comm == MPI.COMM_NULL:
        return folder / name
    left = iter(range(windows))
    def some_windows(*participants):
        if next(left, None) is None:
            raise Killed
        run_window(*participants)
    time_loop.run_window = some_windows
    (folder / name).mkdir(exist_ok=True)
    request = json.loads((folder / "input.json").read_text()) | changes["input"]
    request = INPUT.validate_python(request | {"output": folder / name, "checkpoints": checkpoints})
    try:
        (run_package if isinstance(request, RunInput) else run_structure)(comm, request)
    except Killed:
        pass
    return folder / name

def histories(path):
    found = {}
    for file in path.glob("*.npz"):  # for a package also the pictures of its interface
        with np.load(file) as arrays:
            found |= {name: arrays[name] for name in arrays if arrays[name].dtype.kind == "f"}
    return found

def difference(found, expected):
    assert found.keys() == expected.keys()
    scale = {name: np.abs(values).max(initial=0.0) or 1.0 for name, values in expected.items()}
    energy = max(scale[name] for name in ENERGIES)
    scale |= dict.fromkeys(ENERGIES, energy)
    if "section_imbalance" in scale:  # rounding of the forces at the ends of the joints
        scale["section_imbalance"] = max(scale["section_board"], scale["section_package"])
    return max(np.abs(found[name] - expected[name]).max(initial=0.0) / scale[name] for name in expected)

def continue_otherwise():
    whole = go(inputs[0], "whole")
    go(inputs[0], "broken", folder / "checkpoints", 11)
    world.Barrier()
    continuations = []
    for k, changes in enumerate(inputs[1:]):
        copy = folder / f"checkpoints{k}"
        if world.rank == 0:
            shutil.copytree(folder / "checkpoints", copy)
        world.Barrier()
        go(changes, f"again{k}", copy, 4)
        world.Barrier()
        found = go(changes, f"again{k}", copy)
        world.Barrier()
        if world.rank == 0:
            window = json.loads((found / "result.json").read_text())["continued_from"]
            fields = len(list(found.glob("*.pvtu")) + list(found.glob("*.vtu")))
            largest = difference(histories(found), histories(whole))
            continuations.append([largest, window, len(list(copy.glob("*/"))), fields])
    if world.rank == 0:
        energies = {name: float(values[-1]) for name, values in histories(whole).items() if name in ENERGIES}
        (folder / "continuations.json").write_text(json.dumps([continuations, energies]))

try:
    for folder in sorted(Path(sys.argv[1]).glob("*/")):
        inputs = json.loads((folder / "inputs.json").read_text())
        continue_otherwise()
except BaseException:  # otherwise the other ranks wait forever
    traceback.print_exc()
    world.Abort(1)
"""
NUMERICS = {"history_samples": 20, "field_samples": 4, "checkpoint_seconds": 1e-9}
WEAK = STEEL | {"plasticity": {"A": 4e7, "B": 1e9, "n": 0.5, "C": 0.05, "reference_rate": 1.0}}


def write_package(directory: Path) -> None:
    """Write a package with yielding solder and damping, for two ranks, three, one, and two in turns.

    The board is held over its lower face: in a falling body, strains would be lost in rounding.
    """
    directory.mkdir()
    board, package, *joints = small_assembly(1, size=1e-3)
    board.facets["mounting_holes"] = board.facets["board_bottom"]
    meshes = [str(directory / name) for name in ("assembly.msh", "joints.msh")]
    for mesh, path in zip((append([board, package]), append(joints)), meshes, strict=True):
        write_msh(mesh, Path(path))
    shock = {
        "peak_acceleration": 2e9,
        "pulse_duration": 2e-5,
        "duration": 2e-6,
        "picture_times": [5e-8, 1e-6],
        "gravity": "on",
        "damping": {"stiffness_coefficient": 1e-10, "mass_coefficient": 10.0},
        "numerics": NUMERICS | {"kinematics": "small", "mass_scaled": ["copper"]},
    }
    scene = {"mode": "two_scale", "meshes": meshes, "materials": {"solder": "SAC405"}}
    (directory / "input.json").write_text(json.dumps(scene))
    placements = [(2, "disjoint"), (3, "disjoint"), (1, "shared"), (2, "shared")]
    inputs = [
        {"ranks": total, "input": {"shock": shock | {"ranks": {"total": total, "placement": placement}}}}
        for total, placement in placements
    ]
    (directory / "inputs.json").write_text(json.dumps(inputs))


def write_strip(directory: Path, solver: str, ranks: tuple[int, ...], **changes) -> None:
    """Write a damped structure under pressure and prescribed motion, shaken by a large mass."""
    directory.mkdir()
    loads = {
        "push": {"kind": "pressure", "on": "z_max", "peak": 1e5, "pulse": "constant"},
        "drop": {"kind": "input_g", "peak": 1e4, "duration": 4e-5, "method": "large_mass"},
        "shake": {"kind": "motion", "on": "x_max", "component": "z", "peak": 5.0, "duration": 4e-5},
    }
    damping = {"stiffness_coefficient": 1e-8}
    kinematics = "finite" if solver == "explicit" else "small"
    dynamics = {"duration": 4e-5, "solver": solver, "numerics": NUMERICS, "damping": damping, "kinematics": kinematics}
    write_structure(directory, solver=solver, dynamics=dynamics, loads=loads, **changes)
    (directory / "inputs.json").write_text(json.dumps([{"ranks": count, "input": {}} for count in ranks]))


@pytest.fixture(scope="module")
def scenes(tmp_path_factory) -> Path:
    """Return the folder with the results of all scenes, interrupted and continued on other ranks."""
    directory = tmp_path_factory.mktemp("ranks")
    write_package(directory / "package")
    write_strip(directory / "yielding", "explicit", (2, 3, 1), materials={"steel": WEAK})
    write_strip(directory / "implicit", "implicit", (2, 1))
    (directory / "script.py").write_text(SCRIPT)
    run_warm([str(directory / "script.py"), str(directory)], 3)
    return directory


@pytest.mark.parametrize("name, ways", [("package", 3), ("yielding", 2), ("implicit", 1)])
def test_run_continues_on_other_ranks(scenes, name, ways):
    continuations, energies = json.loads((scenes / name / "continuations.json").read_text())
    assert len(continuations) == ways
    assert (energies["plastic"] > 0.0) == (name != "implicit")
    for difference, window, folders, fields in continuations:
        assert difference <= 1e-10
        assert 11 < window <= 11 + 4  # the latest sampled window before the second interruption
        assert folders == 1
        assert fields >= 4
