"""A dam break: liquid in the corner of a tank is let go and hits the opposite wall (Buchner 2002)."""

from collections.abc import Callable
from functools import partial

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.parameters.flows import DamBreak
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.flow import FlowResult, Metrics
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.smoothing import shape

COLUMNS = ("time", "sensor_pressure", "front", "kinetic_energy", "potential_energy", "elastic_energy")
# Over rho g H: the sensor's pressure by which it is reached.
REACHED = 0.05
# In sqrt(H / g): the plateau behind the impact, and when the wave that falls back strikes.
PLATEAU, SECOND = (3.5, 5.0), (5.2, 7.0)
# In sqrt(H / g): pressures are averaged over it before the second rise is sought.
WINDOW = 0.1
# Of the kernel's shape: with less liquid about it a sensor is dry.
DRY = 0.1


def solve_dam_break(
    scene: DamBreak, progress: Callable[[float], None] | None = None, checkpoint: Checkpoint | None = None
) -> FlowResult:
    """Let the dam break.

    Raises:
        FloatingPointError: a position is not finite.
    """
    simulation = dam(scene)
    run = flow.run_flow(simulation, scene.until, partial(_sample, scene), progress, checkpoint)
    history = run.history(COLUMNS)
    lost = {"particles_lost": (float(particles_lost(scene, simulation)), "")}
    return flow.result_of(run, history, _metrics(scene, history) | lost)


def dam(scene: DamBreak) -> Simulation:
    """Set up the column at rest under the pressure of its weight, in a tank without a lid, 4 columns high."""
    spacing, across, layers = scene.spacing, scene.numerics.particles_across, flow.wall_layers(scene)
    length = tank_columns(scene)
    law = flow.law_of(scene, (0.0, 0.0, 0.0), (0.0, 0.0, -scene.gravity), has_surface=True)
    liquid = flow.lattice(np.arange(scene.columns), np.arange(across), spacing)
    block = flow.lattice(np.arange(-layers, length + layers), np.arange(-layers, 4 * across), spacing)
    outside = (block[0] < 0.0) | (block[0] > length * spacing) | (block[2] < 0.0)
    pressure = scene.density * scene.gravity * (scene.height - liquid[2])
    fields = flow.liquid_and_walls(liquid, block[:, outside], pressure, law)
    return Simulation(fields, liquid.shape[1], law, device=flow.device_of(scene))


def tank_columns(scene: DamBreak) -> int:
    """Length of the tank in spacings."""
    return round(scene.tank_length / scene.spacing)


def _sample(scene: DamBreak, simulation: Simulation) -> tuple[float, ...]:
    """One row of the history."""
    liquid, fields = slice(simulation.fluids), simulation.fields
    x, z, mass = fields.x[liquid], fields.z[liquid], fields.mass[liquid]
    potential = scene.gravity * float(mass @ z)
    pressure, kinetic = _pressure_at(scene, simulation), simulation.kinetic_energy
    return simulation.time, pressure, float(x.max()), kinetic, potential, simulation.elastic_energy


def _pressure_at(scene: DamBreak, simulation: Simulation) -> float:
    """Pressure at the sensor [Pa]: mean of the liquid beside it, weighted by the kernel; 0 where it is dry."""
    law, fields, liquid = simulation.law, simulation.fields, slice(simulation.fluids)
    x, z = fields.x[liquid], fields.z[liquid]
    distance = np.hypot(x - tank_columns(scene) * scene.spacing, z - scene.sensor_height)
    near = np.flatnonzero(distance < 2.0 * law.length)
    weight = np.array([shape(law.kernel, False, q) for q in distance[near] / law.length])
    total = weight.sum()
    return float(weight @ fields.pressure[near] / total) if total > DRY else 0.0


def particles_lost(scene: DamBreak, simulation: Simulation) -> int:
    """Particles that are beyond the middle of a wall's first layer."""
    liquid, half = slice(simulation.fluids), 0.5 * scene.spacing
    x, z = simulation.fields.x[liquid], simulation.fields.z[liquid]
    return int(((x < -half) | (x > tank_columns(scene) * scene.spacing + half) | (z < -half)).sum())


def _metrics(scene: DamBreak, history: dict[str, Floats]) -> Metrics:
    """When the wave strikes, what it presses with, and when it strikes again; nan where the run ended before."""
    time = history["time"] / scene.unit_of_time
    pressure = history["sensor_pressure"] / (scene.density * scene.gravity * scene.height)
    reached = pressure > REACHED
    plateau = (time >= PLATEAU[0]) & (time <= PLATEAU[1])
    total = history["kinetic_energy"] + history["potential_energy"] + history["elastic_energy"]
    nothing = float("nan")
    return {
        "impact_onset": (float(time[np.argmax(reached)]) if reached.any() else nothing, "sqrt(H/g)"),
        "plateau_mean": (float(pressure[plateau].mean()) if time[-1] >= PLATEAU[1] else nothing, "rho g H"),
        "second_rise": (second_rise(time, pressure), "sqrt(H/g)"),
        "energy_rise": (float((np.maximum.accumulate(total[::-1])[::-1] - total).max() / total[0]), ""),
    }  # fmt: skip


def second_rise(time: Floats, pressure: Floats) -> float:
    """Return when the pressure rises again: midway from the plateau to the largest mean of a window after it.

    Args:
        time: `(n,)` in sqrt(H / g).
        pressure: `(n,)` over rho g H.

    Returns:
        nan where the history ends before.
    """
    if time[-1] < SECOND[1]:
        return float("nan")
    width = max(1, round(WINDOW / float(np.diff(time).mean())))
    smooth = np.convolve(pressure, np.full(width, 1.0 / width), mode="same")
    plateau = pressure[(time >= PLATEAU[0]) & (time <= PLATEAU[1])].mean()
    later = (time >= SECOND[0]) & (time <= SECOND[1])
    middle = 0.5 * (plateau + smooth[later].max())
    return float(time[later][np.argmax(smooth[later] >= middle)])
