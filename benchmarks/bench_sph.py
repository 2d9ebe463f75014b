"""Particle-steps per second of delta-SPH: a dam break in a plane, droplets in space without and with a surface.

Run: .venv/bin/python benchmarks/bench_sph.py   (two minutes; results/sph.json)
Whole steps, on one thread and on two in turns. The bars are those of one core in space with all terms, and of two
threads over one. There is no figure of a GPU: none was at hand.
"""

import json
from pathlib import Path
from time import perf_counter, process_time

from numba import get_num_threads, set_num_threads

from reflowshock.particles.parameters.droplets import Droplet, DropletEffects, DropletNumerics
from reflowshock.particles.parameters.flows import DamBreak, SphNumerics
from reflowshock.particles.scenes.dam_break import dam
from reflowshock.particles.scenes.droplet import droplet
from reflowshock.particles.sph.simulation import Simulation

RESULTS = Path(__file__).parent / "results" / "sph.json"
RATE, SPEEDUP = 5e5, 1.7  # bars
STEPS, TURNS = 20, 5


def dam_break() -> Simulation:
    """In a plane: 20 000 particles of water."""
    numerics = SphNumerics(particles_across=100)
    return dam(DamBreak(height=0.6, width=1.2, tank_length=3.22, sensor_height=0.12, duration=1.0, numerics=numerics))


def drop(tension: str) -> Simulation:
    """In space: 28 000 particles of ink that strike a wall, with or without tension."""
    effects = DropletEffects(surface_tension=tension, viscosity="on")
    ink = {"density": 1000.0, "surface_tension": 0.072, "viscosity": 0.0149, "contact_angle": 1.57, "speed": 5.0}
    numerics = DropletNumerics(particles_per_diameter=38)
    return droplet(Droplet(diameter=23e-6, duration=1e-5, **ink, effects=effects, numerics=numerics))


def seconds(simulation: Simulation, threads: int) -> tuple[float, float]:
    """Wall and processor time of some steps on so many threads [s]."""
    set_num_threads(threads)
    wall, processor = perf_counter(), process_time()
    for _ in range(STEPS):
        simulation.step(simulation.time_step())
    return perf_counter() - wall, process_time() - processor


def measure(simulation: Simulation) -> dict[str, float]:
    """Rates of one thread by its processor time, and the wall time of one thread over that of two; the best turns."""
    most = get_num_threads()
    seconds(simulation, most)
    turns = [(seconds(simulation, 1), seconds(simulation, min(2, most))) for _ in range(TURNS)]
    one = min(processor for (_, processor), _ in turns)
    listed = len(simulation.rows.lists[1]) / simulation.fluids
    speedup = min(one[0] for one, _ in turns) / min(two[0] for _, two in turns)
    return {
        "particles": simulation.fluids, "neighbours_listed": listed,
        "particle_steps_per_second": simulation.fluids * STEPS / one, "two_threads_over_one": speedup,
    }  # fmt: skip


def main() -> None:
    scenes = {"dam_break": dam_break(), "drop_without_surface": drop("off"), "drop": drop("on")}
    rows = {name: measure(scene) for name, scene in scenes.items()}
    figures = {
        "particle_steps_per_second": (rows["drop_without_surface"]["particle_steps_per_second"], RATE),
        "particle_steps_per_second_with_surface": (rows["drop"]["particle_steps_per_second"], RATE),
        "two_threads_over_one": (rows["drop_without_surface"]["two_threads_over_one"], SPEEDUP),
    }
    judged = {name: {"value": value, "limit": limit, "ok": value >= limit} for name, (value, limit) in figures.items()}
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps({"scenes": rows, "figures": judged}, indent=1))
    for name, row in (rows | judged).items():
        print(name, "  ".join(f"{key} {value:.4g}" for key, value in row.items()))


if __name__ == "__main__":
    main()
