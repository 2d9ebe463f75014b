"""Particle-steps per second of delta-SPH for a plane dam break and droplets in three dimensions, on CPU and GPU.

Run: PYTHONPATH=. .venv/bin/python benchmarks/bench_sph.py   (two minutes; results/sph.json)
Whole steps are timed, on one and two threads in turns. The limits apply to one core in three dimensions with all terms,
to the speed-up of two threads, and to a GPU if there is one. The GPU runs a liquid without a tracked surface with up to
4e6 particles; the threads of the same machine run one of these sizes for comparison.
"""

import json
from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

import numpy as np
from numba import get_num_threads, set_num_threads

from benchmarks.support import results
from reflowshock.particles.flows.dam_break import DamBreak
from reflowshock.particles.flows.droplet import Droplet, DropletEffects, DropletNumerics
from reflowshock.particles.flows.sph_numerics import SphNumerics
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.threads import ThreadParticles
from reflowshock.particles.sph_flows.dam_break import dam
from reflowshock.particles.sph_flows.droplet import droplet, liquid_of

NAME = "sph"
RATE, SPEEDUP, GPU_RATE = 5e5, 1.7, 1e8  # limits
STEPS, TURNS = 20, 5
# Particles across the diameter: GPU sizes with their measured steps, and the size that the threads run as well.
ACROSS = 38
SIZES, SHARED = {ACROSS: 200, 60: 200, 124: 100, 197: 50}, 60


def make_dam_break() -> Simulation:
    """Return a plane dam break of 20 000 particles of water at its start."""
    numerics = SphNumerics(particles_across=100)
    return dam(DamBreak(height=0.6, width=1.2, tank_length=3.22, sensor_height=0.12, duration=1.0, numerics=numerics))


def make_ink_scene(tension: str, across: int, device: str = "cpu") -> Droplet:
    """Return the parameters of a drop of ink that strikes a wall at 5 m/s.

    Args:
        tension: Surface tension, "on" or "off".
        across: Number of particles across the diameter.
        device: Device that computes the drop, "cpu" or "cuda".
    """
    effects = DropletEffects(surface_tension=tension, viscosity="on")
    liquid = {"density": 1000.0, "surface_tension": 0.072, "viscosity": 0.0149, "contact_angle": 1.57, "speed": 5.0}
    numerics = DropletNumerics(particles_per_diameter=across, device=device)
    return Droplet(diameter=23e-6, duration=1e-5, **liquid, effects=effects, numerics=numerics)


def make_drop() -> Simulation:
    """Return a drop of 28 000 particles with a tracked surface, before it strikes a wall."""
    return droplet(make_ink_scene("on", ACROSS))


def make_stretched_drop(across: int, device: Callable[..., Any]) -> Simulation:
    """Return a free drop without a tracked surface or particle shifting, whose velocities stretch it along z.

    Its viscosity is a tenth of that of ink, so that the speed of sound limits the time step of all sizes.

    Args:
        across: Number of particles across the diameter.
        device: Class of the particles: ``ThreadParticles`` or ``CudaParticles``.
    """
    scene = make_ink_scene("off", across)
    coordinates = (np.arange(-(across // 2) - 1, across // 2 + 1) + 0.5) * scene.spacing
    lattice = np.stack(np.meshgrid(coordinates, coordinates, coordinates, indexing="ij")).reshape(3, -1)
    points = lattice[:, (lattice**2).sum(axis=0) < (0.5 * scene.diameter) ** 2]
    law = liquid_of(scene, scene.spacing)[0]._replace(
        tracked=0, shifting=0.0, mirror=0, viscosity=0.1 * scene.viscosity
    )
    fields = flow.make_fields(points, np.empty((3, 0)), np.zeros(points.shape[1]), law)
    for speed, share, coordinate in zip(fields[3:6], (-0.5, -0.5, 1.0), points, strict=True):
        speed[:] = share * scene.impact_speed * coordinate / (0.5 * scene.diameter)
    return Simulation(fields, points.shape[1], law, device=device)


def time_steps(simulation: Simulation, steps: int) -> float:
    """Take ``steps`` steps of a simulation, in place, and return their wall time [s], GPU work included."""
    start = perf_counter()
    for _ in range(steps):
        simulation.step(simulation.time_step())
    assert np.isfinite(simulation.fastest)
    return perf_counter() - start


def time_on_threads(simulation: Simulation, threads: int) -> tuple[float, float]:
    """Take ``STEPS`` steps of a simulation on ``threads`` threads; return their wall and processor time [s]."""
    set_num_threads(threads)
    processor = process_time()
    return time_steps(simulation, STEPS), process_time() - processor


def measure(simulation: Simulation) -> dict[str, float]:
    """Measure the rate of one thread and the speed-up of two; each is the best of several turns.

    Args:
        simulation: Simulation, whose time advances in place.

    Returns:
        ``particles``, ``neighbours_listed``, ``particle_steps_per_second`` of one thread (processor time), and
        ``two_threads_over_one``, a ratio of wall times.
    """
    most = get_num_threads()
    time_on_threads(simulation, most)
    turns = [(time_on_threads(simulation, 1), time_on_threads(simulation, min(2, most))) for _ in range(TURNS)]
    set_num_threads(most)
    single_seconds = min(processor for (_, processor), _ in turns)
    speedup = min(single[0] for single, _ in turns) / min(double[0] for _, double in turns)
    return {
        "particles": simulation.fluids, "neighbours_listed": simulation.particles.neighbours,
        "particle_steps_per_second": simulation.fluids * STEPS / single_seconds, "two_threads_over_one": speedup,
    }  # fmt: skip


def measure_gpu() -> dict[str, Any] | None:
    """Measure a GPU and the threads of the same machine by a free drop; return None without a GPU.

    Returns:
        ``card`` (its name); ``sizes``, number of particles -> ``particle_steps_per_second``, ``steps_of_a_list`` and
        ``bytes_of_particle``; ``gpu`` and ``threads_N``, particle-steps per second of one size on the GPU and on N
        threads.
    """
    from numba import cuda

    from reflowshock.particles.sph.cuda_particles import CudaParticles

    if not cuda.is_available():
        return None
    figures: dict[str, Any] = {"card": str(cuda.get_current_device().name), "sizes": {}}
    for across, steps in SIZES.items():
        free = cuda.current_context().get_memory_info()[0]
        simulation = make_stretched_drop(across, CudaParticles)
        time_steps(simulation, 5)
        lists = simulation.particles.builds
        rate = simulation.fluids * steps / time_steps(simulation, steps)
        lists = simulation.particles.builds - lists
        used = (free - cuda.current_context().get_memory_info()[0]) / simulation.fluids
        figures["sizes"][simulation.fluids] = {
            "particle_steps_per_second": rate, "steps_of_a_list": steps / max(1, lists), "bytes_of_particle": used,
        }  # fmt: skip
        if across == SHARED:
            figures["gpu"] = rate
        del simulation
    shared, most = make_stretched_drop(SHARED, ThreadParticles), get_num_threads()
    time_steps(shared, 5)
    for threads in (most, 2, 1):
        set_num_threads(threads)
        figures[f"threads_{threads}"] = max(shared.fluids * 10 / time_steps(shared, 10) for _ in range(3))
    set_num_threads(most)
    return figures


def main() -> None:
    """Measure all scenes on threads and, if there is one, on a GPU; store and print figures and limits."""
    scenes = {
        "dam_break": make_dam_break(),
        "free_drop": make_stretched_drop(ACROSS, ThreadParticles),
        "drop": make_drop(),
    }
    rows: dict[str, Any] = {name: measure(scene) for name, scene in scenes.items()}
    figures = {
        "particle_steps_per_second": (rows["free_drop"]["particle_steps_per_second"], RATE),
        "particle_steps_per_second_with_surface": (rows["drop"]["particle_steps_per_second"], RATE),
        "two_threads_over_one": (rows["free_drop"]["two_threads_over_one"], SPEEDUP),
        "two_threads_over_one_with_surface": (rows["drop"]["two_threads_over_one"], SPEEDUP),
    }
    gpu = measure_gpu()
    if gpu is not None:
        best = max(size["particle_steps_per_second"] for size in gpu["sizes"].values())
        figures["particle_steps_per_second_of_a_gpu"] = (best, GPU_RATE)
    judged = {name: {"value": value, "limit": limit, "ok": value >= limit} for name, (value, limit) in figures.items()}
    results.write_figures(NAME, {"scenes": rows, "gpu": gpu, "figures": judged})
    for name, row in (rows | judged).items():
        print(name, "  ".join(f"{key} {value:.4g}" for key, value in row.items()))
    print("gpu", json.dumps(gpu) if gpu else "no CUDA device")


if __name__ == "__main__":
    main()
