"""The structure in a separate process: equal results, returned errors and termination with its parent."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest
from mpi4py import MPI

from reflowshock.fem.statics.process import StructureError, StructureProcess
from reflowshock.fem.statics.structure import ThermalStructure
from tests.support.thermal_models import REFERENCE, small_structure

ROOT = Path(__file__).resolve().parents[3]
ORPHAN = """
import multiprocessing, sys, time
from pathlib import Path
from reflowshock.fem.statics.process import StructureProcess
from tests.support.thermal_models import small_structure
if __name__ == "__main__":
    process = StructureProcess(small_structure(Path(sys.argv[1])))
    process.rigid_modes
    print(multiprocessing.active_children()[0].pid, flush=True)
    time.sleep(60.0)
"""


def test_a_process_answers_as_the_structure_itself(tmp_path):
    assembly = small_structure(tmp_path)
    wrenches = np.random.default_rng(0).normal(size=(4, 2, 6)) * ([1e-3] * 3 + [1e-7] * 3)
    loads = REFERENCE + 100.0, 0.0, wrenches, np.array([1e-5])
    with StructureProcess(assembly) as process:
        structure = ThermalStructure.build(MPI.COMM_SELF, assembly)
        assert np.array_equal(process.points, structure.points)
        assert np.array_equal(process.package, structure.package)
        assert np.array_equal(process.rigid_modes.pad_motion, structure.rigid_modes.pad_motion)
        with pytest.raises(StructureError, match=r"required: finite, shape \(4, 2, 6\)"):
            process.solve(REFERENCE, 0.0, wrenches[1:], np.zeros(1))
        there, here = (item.solve(*loads) for item in (process, structure))
        for name in ("displacement", "pad_motion", "corner_force"):
            assert getattr(there, name) == pytest.approx(getattr(here, name), rel=1e-12, abs=1e-18)
        child = multiprocessing.active_children()[0]
        child.kill()
        with pytest.raises(StructureError, match="exit code -9: it was killed"):
            process.solve(*loads)


def test_errors_of_the_process_are_told(tmp_path):
    assembly = small_structure(tmp_path)
    pads = replace(assembly.pads, radii=10.0 * assembly.pads.radii)
    process = StructureProcess(replace(assembly, pads=pads))
    with process, pytest.raises(StructureError, match=r"wetted disc of .* beyond board_side"):
        process.solve(REFERENCE, 0.0, np.zeros((4, 2, 6)), np.zeros(1))
    assert not multiprocessing.active_children()


def test_the_process_ends_with_its_parent(tmp_path):
    script = tmp_path / "orphan.py"
    script.write_text(ORPHAN)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)], stdout=subprocess.PIPE, text=True, env=environment
    )
    child = psutil.Process(int(parent.stdout.readline()))
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    for _ in range(100):
        if not child.is_running() or child.status() == psutil.STATUS_ZOMBIE:
            return
        time.sleep(0.1)
    child.kill()
    pytest.fail("the process outlived its parent")
