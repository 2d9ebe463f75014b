"""Droplet computed by delta-SPH: free, at rest on a wall, or striking it."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import cos, pi, sqrt

import numpy as np

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.flows.droplet import Droplet
from reflowshock.particles.flows.droplet_metrics import base_width, drop_height, droplet_metrics, impact_texts
from reflowshock.particles.flows.droplet_shape import start_shape
from reflowshock.particles.flows.flow_effects import decide_flow
from reflowshock.particles.flows.result import FlowResult
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.capillary_forces import Capillarity
from reflowshock.particles.sph.fluid_state import Law
from reflowshock.particles.sph.liquid_surface import LiquidSurface
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.surface.breakup import find_largest_part
from reflowshock.particles.surface.morphological_closing import count_parts
from reflowshock.particles.surface.profile import mean_width
from reflowshock.particles.surface.remeshing import EDGE
from reflowshock.particles.surface.surface_mesh import SurfaceLost, SurfaceMesh

COLUMNS = (
    "time", "mean_pressure", "roundness", "spread", "base", "height", "largest_speed", "kinetic_energy",
    "surface_energy", "surface_volume", "foot", "parts", "spray", "shed",
)  # fmt: skip
# Share of the radius within which the pressure of a free drop is averaged, far from the surface.
CORE = 0.5
# Newton steps that give the surface the volume of the drop.
ENCLOSURES = 3


def solve_droplet(
    scene: Droplet, progress: Callable[[float], None] | None = None, checkpoint: Checkpoint | None = None
) -> FlowResult:
    """Compute the motion of a droplet from its start.

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.
        progress: Function called with the completed fraction, 0 to 1.
        checkpoint: Checkpoint to continue from, if its file exists, and to write.

    Returns:
        Pictures, history and metrics, and for impacts texts on their outcome.

    Raises: as ``follow``.
    """
    return follow(scene, droplet(scene), progress, checkpoint)


def follow(
    scene: Droplet,
    simulation: Simulation,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> FlowResult:
    """Compute the motion of a droplet from the state of a simulation, which is advanced in place.

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.
        simulation: Particles and surface, as ``droplet`` returns them.
        progress: Function called with the completed fraction, 0 to 1.
        checkpoint: Checkpoint to continue from, if its file exists, and to write.

    Returns:
        Pictures, history and metrics, and for impacts texts on their outcome.

    Raises:
        FloatingPointError: A position is not finite.
        SurfaceLost: The liquid has left its surface, or the surface has vanished.
    """
    try:
        run = flow.run_flow(simulation, scene.until, partial(_sample, scene), progress, checkpoint)
    except SurfaceLost as error:
        raise SurfaceLost(
            f"step {simulation.steps}, {1e6 * simulation.time:.4g} us, "
            f"{simulation.time / scene.unit_of_time:.2g} units of time: {error}; "
            "take more particles per diameter"
        ) from error
    history = run.history(COLUMNS)
    result = flow.result_of(run, history, droplet_metrics(scene, history))
    return replace(result, words=impact_texts(scene, history) if scene.impact_speed else {})


def droplet(scene: Droplet) -> Simulation:
    """Set up the particles of a droplet and their surface, whose tension balances the pressure of a sphere.

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.

    Returns:
        Simulation at time 0, with the impact speed if there is one.
    """
    points, triangles, spacing = start_shape(scene, EDGE)
    law, tension = liquid_of(scene, spacing)
    fields = flow.make_fields(points, np.empty((3, 0)), np.zeros(points.shape[1]), law)
    fields.w[:] = -scene.impact_speed
    mesh = SurfaceMesh(*triangles, law.spacing, bool(law.mirror))
    surface = LiquidSurface(mesh, Capillarity(tension, cos(scene.angle), law, scene.bounds))
    for _ in range(ENCLOSURES):
        surface.enclose(scene.volume)
    return Simulation(fields, points.shape[1], law, surface, flow.device_of(scene))


def liquid_of(scene: Droplet, spacing: float) -> tuple[Law, float]:
    """Return the parameters of the pair interactions of a droplet's liquid, and its surface tension.

    Args:
        scene: Parameters of the droplet: liquid, size, wall, speed, effects and numerics.
        spacing: Particle spacing [m].

    Returns:
        Parameters of the pair interactions, and surface tension [N/m], 0 if it does not act.
    """
    effects = decide_flow(scene)
    weight = -scene.gravity if effects["droplet_gravity"]["on"] else 0.0
    law = flow.law_of(scene, (0.0, 0.0, 0.0), (0.0, 0.0, weight), has_surface=True)
    law = flow.law_in_space(law, spacing, mirror=scene.has_wall, no_slip=scene.impact_speed > 0.0)
    law = law._replace(tracked=1, shifting=1.0)
    return law, scene.surface_tension if effects["droplet_tension"]["on"] else 0.0


def _sample(scene: Droplet, simulation: Simulation) -> tuple[float, ...]:
    """Return one row of the history, lengths in diameters."""
    fields, surface = simulation.fields, simulation.surface
    assert surface is not None
    points = np.array(fields[:3])
    centre = points.mean(axis=1)
    radius = np.linalg.norm(points.T - centre, axis=1)
    core = radius < CORE * 0.5 * scene.diameter
    distance = np.linalg.norm(surface.points - centre, axis=1)
    pressure = float((simulation.pressures[core] if core.any() else simulation.pressures).mean())
    return (
        simulation.time, pressure, float(distance.max() / distance.min()),
        mean_width(find_largest_part(surface.points, surface.triangles)) / scene.diameter,
        base_width(surface.points, simulation.law.spacing) / scene.diameter,
        drop_height(scene, surface.points) / scene.diameter, simulation.fastest,
        simulation.kinetic_energy, surface.energy, (surface.volume + surface.spray) / scene.volume,
        2.0 * sqrt(max(surface.wetted_area, 0.0) / pi) / scene.diameter, float(count_parts(surface.triangles)),
        surface.spray / scene.volume, float(surface.detachments),
    )  # fmt: skip
