"""Complete GPU steps equal CPU steps in Numba's simulator and are rejected without a GPU."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from reflowshock.particles.flows.channel import Poiseuille
from reflowshock.particles.flows.dam_break import DamBreak
from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.flows.rheology import Rheology
from reflowshock.particles.flows.sph_numerics import SphNumerics
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph_flows.dam_break import dam
from reflowshock.particles.sph_flows.droplet import droplet
from reflowshock.particles.sph_flows.viscous_flows import channel

ROOT = Path(__file__).parents[3]
SIMULATED = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1"}
PROGRAM = """
import copy, sys, numpy as np
from tests.unit.particles.test_cuda_loops import SCENES, results_of, stirred
simulation = stirred(sys.argv[1], "cuda")
assert "reflowshock.particles.sph.cuda_loops" in sys.modules
saved = copy.deepcopy(simulation.saved())
again = SCENES[sys.argv[1]]("cuda")
again.restore(saved)
assert all(np.array_equal(*pair) for pair in zip(simulation.fields, again.fields))
seen = []
simulation.particles.add(lambda rates, fields: seen.append(fields))
for name in ("x", "z", "u", "w", "density", "mass", "viscosity"):
    assert np.array_equal(getattr(seen[0], name), getattr(simulation.fields, name)), name
for one in (simulation, again):
    one.step(1e-3 * one.time_step())
assert all(np.array_equal(*pair) for pair in zip(simulation.fields, again.fields))
np.savez(sys.argv[2], **results_of(simulation))
"""
TANK = {"height": 0.6, "width": 0.6, "tank_length": 1.2, "sensor_height": 0.12, "duration": 0.02}
INK = {
    "diameter": 23e-6, "density": 1000.0, "surface_tension": 0.072, "viscosity": 0.0149, "contact_angle": 1.5,
    "speed": 5.0, "duration": 1e-5,
}  # fmt: skip

THINNED = {"particles_per_diameter": 8, "xsph": 0.5, "density_gradient": "reproducing"}
THINNING = Rheology(law="carreau", exponent=0.5, shear_rate=1e5, viscosity_at_infinity=1e-3)


def small_dam(device: str) -> Simulation:
    """Return a dam break of few particles on a device, at its start."""
    return dam(DamBreak(**TANK, numerics=SphNumerics(particles_across=8, xsph=0.5, device=device)))


def small_channel(device: str) -> Simulation:
    """Return a channel flow of few particles on a device, at its start."""
    return channel(Poiseuille(width=1e-3, speed=0.1, numerics=SphNumerics(particles_across=6, device=device)))


def small_impact(device: str) -> Simulation:
    """Return an impact of few particles on a device, at its start."""
    return droplet(Droplet(**INK, numerics=DropletNumerics(particles_per_diameter=8, device=device)))


def small_impact_of_carreau(device: str) -> Simulation:
    """Return an impact of a Carreau liquid on a device, at its start."""
    return droplet(Droplet(**INK, rheology=THINNING, numerics=DropletNumerics(**THINNED, device=device)))


SCENES = {scene.__name__: scene for scene in (small_dam, small_channel, small_impact, small_impact_of_carreau)}


def stirred(scene: str, device: str) -> Simulation:
    """Return a flow some steps after a random disturbance, so that neighbour lists are rebuilt."""
    start, random = SCENES[scene](device), np.random.default_rng(7)
    fields, liquid = start.fields, slice(start.fluids)
    for speed in (fields.u, fields.w):
        speed[liquid] += random.normal(0.0, 0.3 * start.law.sound, start.fluids)
    simulation = Simulation(fields, start.fluids, start.law, start.surface, start.device)
    for _ in range(4):
        simulation.step(0.4 * start.law.length / start.law.sound / 4.0)
    return simulation


def results_of(simulation: Simulation) -> dict[str, np.ndarray]:
    """Return the compared results, in rows of equal size."""
    result = {"fields": np.array(simulation.fields[:12]), "rates": simulation.rates}
    if simulation.surface:
        result["surface"] = simulation.surface.points.T
    return result | {
        "viscosity": simulation.fields.viscosity[None],
        "builds": np.array([[simulation.particles.builds]]),
    }


@pytest.mark.long  # the simulator takes minutes
@pytest.mark.parametrize("scene", SCENES)
def test_a_gpu_computes_what_threads_compute(scene, tmp_path):
    simulation = stirred(scene, "cpu")
    simulation.step(1e-3 * simulation.time_step())
    assert simulation.particles.builds > 1
    command = [sys.executable, "-c", PROGRAM, scene, str(tmp_path / "found.npz")]
    subprocess.run(command, env=os.environ | SIMULATED, cwd=ROOT, check=True, timeout=600)
    with np.load(tmp_path / "found.npz") as archive:
        for name, here in results_of(simulation).items():
            largest = np.abs(here).max(axis=1, keepdims=True, initial=0.0)
            assert np.allclose(archive[name], here, rtol=1e-9, atol=1e-9 * largest.max()), name


def test_without_a_gpu_a_case_that_asks_for_one_is_refused():
    program = (
        "import sys\n"
        "from tests.unit.particles.test_cuda_loops import *\n"
        "small_dam('cpu'); assert not any('sph.cuda' in name for name in sys.modules)\n"
        "small_dam('cuda')\n"
    )
    environment = os.environ | {"CUDA_VISIBLE_DEVICES": ""}
    ended = subprocess.run(
        [sys.executable, "-c", program], env=environment, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert ended.stderr.splitlines()[-1].endswith("no CUDA device; numerics.device = cpu runs on threads")
