"""Viscous flows with exact solutions, by delta-SPH: the start of channel flow, and decaying vortices."""

from collections.abc import Callable

import numpy as np

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.flows.channel import Poiseuille, channel_points, exact_speeds, plate_points
from reflowshock.particles.flows.result import FlowResult
from reflowshock.particles.flows.vortices import TaylorGreen, box_points
from reflowshock.particles.reference import viscous_flows as exact
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.simulation import Simulation

Progress = Callable[[float], None]


def solve_poiseuille(
    scene: Poiseuille, progress: Progress | None = None, checkpoint: Checkpoint | None = None
) -> FlowResult:
    """Compute the start of channel flow and its error against the exact speeds.

    Args:
        scene: Parameters of the channel flow: width, speed, duration, liquid and numerics.
        progress: Function called with the completed fraction, 0 to 1.
        checkpoint: Checkpoint to continue from, if its file exists, and to write.

    Returns:
        Pictures, history and metrics; speeds and errors are over the speed of the scene.

    Raises:
        FloatingPointError: A position is not finite.
    """
    simulation = channel(scene)

    def sample(now: Simulation) -> tuple[float, ...]:
        liquid = slice(now.fluids)
        height, speed = now.fields.z[liquid], now.fields.u[liquid]
        error = speed - exact_speeds(height, now.time, scene)
        spread = (np.sqrt((error**2).mean()), np.abs(error).max(), speed.max())
        return now.time, *(float(value / scene.speed) for value in spread)

    run = flow.run_flow(simulation, scene.until, sample, progress, checkpoint)
    history = run.history(("time", "profile_error", "largest_error", "largest_speed"))
    metrics = {
        "profile_error_at_end": (float(history["profile_error"][-1]), ""),
        "largest_error_at_end": (float(history["largest_error"][-1]), ""),
        "reynolds": (scene.reynolds_number, ""),
    }
    if scene.rheology is None:  # with a rheology only the steady flow is known
        metrics["profile_error"] = float(history["profile_error"].max()), ""
    return flow.result_of(run, history, metrics)


def channel(scene: Poiseuille) -> Simulation:
    """Set up liquid at rest between two plates, periodic along x and driven by a constant force.

    Args:
        scene: Parameters of the channel flow: width, speed, duration, liquid and numerics.

    Returns:
        Simulation at time 0, to be advanced by ``run_flow``.
    """
    law = flow.law_of(scene, (scene.columns * scene.spacing, 0.0, 0.0), (scene.force, 0.0, 0.0), has_surface=False)
    liquid, walls = channel_points(scene), plate_points(scene, flow.wall_layers(scene))
    fields = flow.make_fields(liquid, walls, np.zeros(liquid.shape[1]), law)
    return Simulation(fields, liquid.shape[1], law, device=flow.device_of(scene))


def solve_taylor_green(
    scene: TaylorGreen, progress: Progress | None = None, checkpoint: Checkpoint | None = None
) -> FlowResult:
    """Compute decaying vortices in a periodic box and their error against the exact speeds.

    Args:
        scene: Parameters of the vortices: side of the box, speed, duration, liquid and numerics.
        progress: Function called with the completed fraction, 0 to 1.
        checkpoint: Checkpoint to continue from, if its file exists, and to write.

    Returns:
        Pictures, history and metrics of the flow.

    Raises:
        FloatingPointError: A position is not finite.
    """
    simulation = vortices(scene)
    rate = exact.taylor_green_decay(scene.side, scene.viscosity / scene.density)

    def sample(now: Simulation) -> tuple[float, ...]:
        return now.time, now.fastest / scene.speed, float(np.exp(-rate * now.time)), now.kinetic_energy

    run = flow.run_flow(simulation, scene.until, sample, progress, checkpoint)
    history = run.history(("time", "largest_speed", "exact_speed", "kinetic_energy"))
    time, largest, exact_speed, energy = history.values()
    fitted = -0.5 * float(np.polyfit(time, np.log(energy), 1)[0])
    metrics = {
        "decay_rate": (fitted, "1/s"),
        "decay_rate_error": (fitted / rate - 1.0, ""),
        "speed_error": (float(np.abs(largest - exact_speed).max()), ""),
        "reynolds": (scene.reynolds_number, ""),
    }
    return flow.result_of(run, history, metrics)


def vortices(scene: TaylorGreen) -> Simulation:
    """Set up the vortices of a scene in a periodic box without walls.

    Args:
        scene: Parameters of the vortices: side of the box, speed, duration, liquid and numerics.

    Returns:
        Simulation at time 0, with the exact initial velocities and pressures.
    """
    law = flow.law_of(scene, (scene.side, 0.0, scene.side), (0.0, 0.0, 0.0), has_surface=False)
    liquid = box_points(scene)
    u, w, pressure = exact.taylor_green(liquid[0], liquid[2], scene.side)
    fields = flow.make_fields(liquid, np.empty((3, 0)), scene.density * scene.speed**2 * pressure, law)
    fields.u[:], fields.w[:] = scene.speed * u, scene.speed * w
    return Simulation(fields, liquid.shape[1], law, device=flow.device_of(scene))
