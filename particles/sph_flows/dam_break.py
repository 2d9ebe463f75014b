"""Dam break computed by delta-SPH (Buchner 2002)."""

from collections.abc import Callable
from functools import partial

import numpy as np

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.flows.dam_break import DamBreak, column_points, dam_metrics, tank_columns, tank_points
from reflowshock.particles.flows.result import FlowResult
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.smoothing import shape

COLUMNS = ("time", "sensor_pressure", "front", "kinetic_energy", "potential_energy", "elastic_energy")
# Kernel sum below which the sensor is dry.
DRY = 0.1


def solve_dam_break(
    scene: DamBreak, progress: Callable[[float], None] | None = None, checkpoint: Checkpoint | None = None
) -> FlowResult:
    """Compute a dam break.

    Args:
        scene: Parameters of the dam break: column, tank, pressure sensor, liquid and numerics.
        progress: Function called with the completed fraction, 0 to 1.
        checkpoint: Checkpoint to continue from, if its file exists, and to write.

    Returns:
        Pictures, history and the metrics of ``dam_metrics``, with the number of ``particles_lost``.

    Raises:
        FloatingPointError: A position is not finite.
    """
    simulation = dam(scene)
    run = flow.run_flow(simulation, scene.until, partial(_sample, scene), progress, checkpoint)
    history = run.history(COLUMNS)
    lost = {"particles_lost": (float(particles_lost(scene, simulation)), "")}
    return flow.result_of(run, history, dam_metrics(scene, history) | lost)


def dam(scene: DamBreak) -> Simulation:
    """Set up the column at rest under the pressure of its weight, in an open tank that is four times as high.

    Args:
        scene: Parameters of the dam break: column, tank, pressure sensor, liquid and numerics.

    Returns:
        Simulation at time 0, to be advanced by ``run_flow``.
    """
    law = flow.law_of(scene, (0.0, 0.0, 0.0), (0.0, 0.0, -scene.gravity), has_surface=True)
    liquid = column_points(scene)
    pressure = scene.density * scene.gravity * (scene.height - liquid[2])
    fields = flow.make_fields(liquid, tank_points(scene, flow.wall_layers(scene)), pressure, law)
    return Simulation(fields, liquid.shape[1], law, device=flow.device_of(scene))


def _sample(scene: DamBreak, simulation: Simulation) -> tuple[float, ...]:
    """Return one row of the history."""
    liquid, fields = slice(simulation.fluids), simulation.fields
    x, z, mass = fields.x[liquid], fields.z[liquid], fields.mass[liquid]
    potential = scene.gravity * float(mass @ z)
    pressure, kinetic = _pressure_at(scene, simulation), simulation.kinetic_energy
    return simulation.time, pressure, float(x.max()), kinetic, potential, simulation.elastic_energy


def _pressure_at(scene: DamBreak, simulation: Simulation) -> float:
    """Return the pressure at the sensor [Pa]: kernel-weighted mean of the liquid next to it; 0 if the sensor is dry."""
    law, fields, liquid = simulation.law, simulation.fields, slice(simulation.fluids)
    x, z = fields.x[liquid], fields.z[liquid]
    distance = np.hypot(x - tank_columns(scene) * scene.spacing, z - scene.sensor_height)
    near = np.flatnonzero(distance < 2.0 * law.length)
    weight = np.array([shape(law.kernel, False, q) for q in distance[near] / law.length])
    total = weight.sum()
    return float(weight @ fields.pressure[near] / total) if total > DRY else 0.0


def particles_lost(scene: DamBreak, simulation: Simulation) -> int:
    """Return the number of liquid particles that have left the tank: beyond the middle of the first layer of a wall.

    Args:
        scene: Size of the tank and particle spacing.
        simulation: Particles at any time; not changed.
    """
    liquid, half = slice(simulation.fluids), 0.5 * scene.spacing
    x, z = simulation.fields.x[liquid], simulation.fields.z[liquid]
    return int(((x < -half) | (x > tank_columns(scene) * scene.spacing + half) | (z < -half)).sum())
