"""The loops on a GPU: in Numba's simulator they compute what threads compute; without a GPU they are refused."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from reflowshock.particles.parameters.droplets import Droplet, DropletNumerics
from reflowshock.particles.parameters.flows import DamBreak, SphNumerics
from reflowshock.particles.parameters.rheology import Rheology
from reflowshock.particles.scenes.dam_break import dam
from reflowshock.particles.scenes.droplet import droplet
from reflowshock.particles.sph.simulation import Simulation

SIMULATED = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
PROGRAM = """
import sys, numpy as np
from reflowshock.particles.sph.cuda_loops import CudaLoops
from reflowshock.particles.sph.fluid_state import Fields, Law
given = np.load(sys.argv[1])
law = Law(**{name: kind(given[name]) for name, kind in Law.__annotations__.items()})
fields = Fields(**{name: given["field_" + name] for name in Fields._fields})
lists = given["offsets"], given["indices"]
loops, fluids = CudaLoops(law), int(given["fluids"])
rates, walls, viscosities = np.zeros((10, fluids)), np.zeros((5, len(fields.x) - fluids)), np.zeros((1, fluids))
if law.rheology:
    loops.find_viscosities(fluids, lists, fields, viscosities)
loops.find_rates(fluids, lists, fields, rates)
loops.find_wall_values(fluids, lists, fields, walls)
drifts = np.zeros((3, fluids))
loops.find_drifts(fluids, lists, fields, drifts)
np.savez(sys.argv[2], rates=rates, walls=walls, viscosities=viscosities, drifts=drifts)
"""
TANK = {"height": 0.6, "width": 1.2, "tank_length": 3.22, "sensor_height": 0.12, "duration": 0.02}
INK = {
    "diameter": 23e-6, "density": 1000.0, "surface_tension": 0.072, "viscosity": 0.0149, "contact_angle": 1.5,
    "speed": 5.0, "duration": 1e-5,
}  # fmt: skip

THINNED = {"particles_per_diameter": 8, "xsph": 0.5, "density_gradient": "reproducing"}
THINNING = Rheology(law="carreau", exponent=0.5, shear_rate=1e5, viscosity_at_infinity=1e-3)


def small_dam() -> Simulation:
    return dam(DamBreak(**TANK, numerics=SphNumerics(particles_across=8, xsph=0.5)))


def small_impact() -> Simulation:
    return droplet(Droplet(**INK, numerics=DropletNumerics(particles_per_diameter=8, xsph=0.5)))


def small_impact_of_carreau() -> Simulation:
    ink = Droplet(**INK, rheology=THINNING, numerics=DropletNumerics(**THINNED))
    return droplet(ink)


@pytest.mark.parametrize("scene", [small_dam, small_impact, small_impact_of_carreau])
def test_a_gpu_computes_what_threads_compute(scene, tmp_path):
    simulation, random = scene(), np.random.default_rng(7)
    for _ in range(2):
        simulation.step(simulation.time_step())
    fields, fluids, (offsets, indices) = simulation.fields, simulation.fluids, simulation.rows.lists
    for speed in (fields.u, fields.w):
        speed[:fluids] += random.normal(size=fluids) * simulation.fastest
    rates, walls, viscosities = np.zeros((10, fluids)), np.zeros((5, len(fields.x) - fluids)), np.zeros((1, fluids))
    if simulation.law.rheology:
        simulation.loops.find_viscosities(fluids, simulation.rows.lists, fields, viscosities)
        assert np.ptp(viscosities) > 0.0
    drifts = np.zeros((3, fluids))
    simulation.loops.find_drifts(fluids, simulation.rows.lists, fields, drifts)
    assert drifts.any()
    simulation.loops.find_rates(fluids, simulation.rows.lists, fields, rates)
    simulation.loops.find_wall_values(fluids, simulation.rows.lists, fields, walls)
    arrays = {f"field_{name}": array for name, array in fields._asdict().items()}
    given = tmp_path / "given.npz"
    np.savez(given, offsets=offsets, indices=indices, fluids=fluids, **simulation.law._asdict(), **arrays)
    command = [sys.executable, "-c", PROGRAM, str(given), str(tmp_path / "found.npz")]
    subprocess.run(command, env=os.environ | SIMULATED, cwd=Path(__file__).parents[3], check=True, timeout=300)
    here_too = {"rates": rates, "walls": walls, "viscosities": viscosities, "drifts": drifts}
    with np.load(tmp_path / "found.npz") as found:
        compared = [(found[name], array) for name, array in here_too.items()]
        for there, here in compared:
            largest = np.abs(here).max(axis=1, keepdims=True, initial=0.0)
            assert np.allclose(there, here, rtol=1e-12, atol=1e-12 * largest)


def test_without_a_gpu_a_case_that_asks_for_one_is_refused():
    program = (
        "import sys\n"
        "from tests.unit.particles.test_cuda_loops import *\n"
        "small_dam(); assert not any('cuda_loops' in name for name in sys.modules if 'test' not in name)\n"
        "dam(DamBreak(**TANK, numerics=SphNumerics(particles_across=8, device='cuda')))\n"
    )
    environment = os.environ | {"CUDA_VISIBLE_DEVICES": ""}
    root = Path(__file__).parents[3]
    ended = subprocess.run(
        [sys.executable, "-c", program], env=environment, cwd=root, capture_output=True, text=True, check=False
    )
    assert ended.stderr.splitlines()[-1].endswith("no CUDA device; numerics.device = cpu runs on threads")
