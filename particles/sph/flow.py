"""Runs of delta-SPH from scene to result: parameters, initial fields, history, pictures and checkpoint."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.threads import threads_for
from reflowshock.particles.flows.flow import FlowScene
from reflowshock.particles.flows.flow_effects import artificial_viscosity, decide_flow, sph_numerics, sph_sound
from reflowshock.particles.flows.result import FlowResult, Metrics, Picture
from reflowshock.particles.sph.fluid_state import GRADIENTS, Fields, Law
from reflowshock.particles.sph.shear_viscosity import LAWS, NEWTON
from reflowshock.particles.sph.simulation import Particles, Simulation
from reflowshock.particles.sph.smoothing import KERNELS, SUPPORT, norm
from reflowshock.particles.sph.threads import ThreadParticles
from reflowshock.particles.surface.morphological_closing import TopologyChange

# Number of pictures and of rows of the history.
PICTURES = 24
SAMPLES = 2000

Sample = Callable[[Simulation], tuple[float, ...]]
Vector = tuple[float, float, float]


@dataclass(slots=True)
class FlowRun:
    """State of a run.

    Attributes:
        simulation: Simulation at the present time.
        rows: Rows of the history.
        pictures: Pictures so far.
        seconds: Wall time [s].
    """

    simulation: Simulation
    rows: list[tuple[float, ...]] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    seconds: float = 0.0

    def saved(self) -> dict[str, Any]:
        """Return the state, for a checkpoint."""
        rows, pictures = np.array(self.rows), self.pictures
        return {
            "simulation": self.simulation.saved(), "rows": rows, "pictures": pictures, "seconds": self.seconds,
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Continue from the data that ``saved`` returned."""
        self.simulation.restore(saved["simulation"])
        self.rows = [tuple(row) for row in saved["rows"].tolist()]
        self.pictures, self.seconds = saved["pictures"], saved["seconds"]

    def history(self, names: tuple[str, ...]) -> dict[str, Floats]:
        """Return the columns of the history by name."""
        return dict(zip(names, np.array(self.rows).T, strict=True))

    def picture(self) -> None:
        """Store a picture of the present particles, moved into the periodic domain."""
        simulation, liquid = self.simulation, slice(self.simulation.fluids)
        points, velocity = (
            np.stack([values[liquid] for values in simulation.fields[k : k + 3]], axis=1) for k in (0, 3)
        )
        law = simulation.law
        for axis, period in enumerate((law.period_x, law.period_y, law.period_z)):
            if period > 0.0:
                points[:, axis] %= period
        self.pictures.append(Picture(simulation.time, points, velocity, simulation.pressures))


def run_flow(
    simulation: Simulation,
    until: float,
    sample: Sample,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> FlowRun:
    """Run a simulation to a final time with about 2000 rows of history and 24 pictures (snapshots of the particles).

    Args:
        simulation: Particles, their surface if it is tracked, and time, in the initial state; advanced in place.
        until: Final time [s].
        sample: Function of the simulation that returns a row of the history, the time [s] first.
        progress: Function called after each step with the completed fraction, 0 to 1; None for no call.
        checkpoint: Checkpoint that is written whenever it is due; a saved state in it is continued with identical bits.
            None for no checkpoint.

    Returns:
        Simulation at the final time, rows of the history (as ``sample`` returned them), pictures and wall time [s].

    Raises:
        FloatingPointError: A position is not finite.
    """
    run = FlowRun(simulation)
    saved = checkpoint.read((Picture, TopologyChange)) if checkpoint else None
    if saved:
        run.restore(saved)
    else:
        run.rows.append(sample(simulation))
        run.picture()
    with threads_for(len(simulation.fields.x)):
        _flow_until(run, until, sample, progress, checkpoint)
    return run


def _flow_until(
    run: FlowRun,
    until: float,
    sample: Sample,
    progress: Callable[[float], None] | None,
    checkpoint: Checkpoint | None,
) -> None:
    """Advance the simulation to the final time; arguments as for ``run_flow``."""
    simulation = run.simulation
    while simulation.time < until:
        start = perf_counter()
        simulation.step(min(simulation.time_step(), until - simulation.time))
        if simulation.time >= len(run.rows) * until / SAMPLES or simulation.time >= until:
            run.rows.append(sample(simulation))
        if simulation.time >= len(run.pictures) * until / PICTURES:
            run.picture()
        run.seconds += perf_counter() - start
        if checkpoint is not None and checkpoint.is_due():
            checkpoint.write(run.saved())
        if progress is not None:
            progress(min(1.0, simulation.time / until))


def device_of(scene: FlowScene) -> Callable[[Fields, int, Law], Particles]:
    """Return the class of particles for the device of a flow; CUDA is imported only if it is requested.

    The class takes the initial ``Fields``, the number of liquid particles and the ``Law``; its objects move the
    particles in parallel on threads, or on a GPU if the numerical parameters of the scene name the device "cuda".

    Args:
        scene: Parameters of the flow, whose numerics name the device, "cpu" or "cuda".

    Raises:
        NoDeviceError: The machine has no CUDA device.
    """
    if sph_numerics(scene).device == "cpu":
        return ThreadParticles
    from reflowshock.particles.sph.cuda_particles import CudaParticles

    return CudaParticles


def law_of(scene: FlowScene, periods: Vector, gravity: Vector, has_surface: bool) -> Law:
    """Return the parameters of the pair interactions of a flow in the plane of x and z.

    Args:
        scene: Parameters of the flow: liquid, sizes, effects and numerics.
        periods: Periods along x, y and z [m]; 0 if not periodic.
        gravity: Gravity along x, y and z [m/s^2].
        has_surface: Whether the liquid has a free surface, near which particles cannot be shifted.

    Returns:
        Kernel, smoothing length, density, speed of sound, viscosity and the other constants of the pairs.
    """
    numerics, spacing, sound = sph_numerics(scene), scene.spacing, sph_sound(scene)
    length, kernel = numerics.smoothing_length * spacing, KERNELS[numerics.kernel]
    return Law(
        kernel=kernel,
        dimension=2,
        length=length,
        norm=norm(kernel, 2, length),
        rest_density=scene.density,
        sound=sound,
        diffusion=numerics.density_diffusion * length * sound,
        gradient=GRADIENTS[numerics.density_gradient],
        artificial=artificial_viscosity(scene) * length * sound * scene.density,
        viscosity=scene.liquid_viscosity if decide_flow(scene)["flow_viscosity"]["on"] else 0.0,
        **shear_law(scene),
        has_surface=int(has_surface),
        tracked=0,
        no_slip=int(not has_surface),
        mirror=0,
        spacing=spacing,
        xsph=numerics.xsph,
        shifting=0.0 if has_surface else 1.0,
        period_x=periods[0],
        period_y=periods[1],
        period_z=periods[2],
        gravity_x=gravity[0],
        gravity_y=gravity[1],
        gravity_z=gravity[2],
    )


def shear_law(scene: FlowScene) -> dict[str, Any]:
    """Return the parameters of a shear-dependent viscosity, by their names in ``Law``; neutral ones without it.

    Args:
        scene: Parameters of the flow, with its rheology (None without shear dependence) and viscosity.

    Returns:
        Dict of ``rheology`` (number of the viscosity law), ``exponent``, ``shear_rate`` [1/s], ``least_viscosity`` and
        ``most_viscosity`` [Pa s].
    """
    rheology = scene.rheology
    if rheology is None or not decide_flow(scene)["shear_dependent_viscosity"]["on"]:
        return {"rheology": NEWTON, "exponent": 1.0, "shear_rate": 1.0, "least_viscosity": 0.0, "most_viscosity": 0.0}
    least, most = rheology.viscosity_at_infinity, scene.liquid_viscosity
    if rheology.law == "power_law":
        least, most = scene.liquid_viscosity / rheology.bound, scene.liquid_viscosity * rheology.bound
    return {
        "rheology": LAWS[rheology.law], "exponent": rheology.exponent, "shear_rate": rheology.shear_rate,
        "least_viscosity": least, "most_viscosity": most,
    }  # fmt: skip


def law_in_space(law: Law, spacing: float, mirror: bool, no_slip: bool) -> Law:
    """Return the parameters of the pair interactions of the same flow in three dimensions.

    Args:
        law: Parameters of the pair interactions of a flow in a plane.
        spacing: Particle spacing in space [m].
        mirror: Whether the plane z = 0 is a wall with mirror images.
        no_slip: Whether walls act on the liquid by viscosity.
    """
    length = law.length / law.spacing * spacing
    return law._replace(
        dimension=3, spacing=spacing, length=length, norm=norm(law.kernel, 3, length), mirror=int(mirror),
        no_slip=int(no_slip),
    )  # fmt: skip


def wall_layers(scene: FlowScene) -> int:
    """Return the number of layers of wall particles that fill the kernel support of liquid near a wall.

    Args:
        scene: Parameters of a flow by delta-SPH, whose smoothing length over the spacing decides.
    """
    return int(np.ceil(SUPPORT * sph_numerics(scene).smoothing_length))


def make_fields(liquid: Floats, walls: Floats, pressure: Floats, law: Law) -> Fields:
    """Return the initial fields (positions, velocities, densities, pressures, masses, ...) of liquid and walls at rest.

    Args:
        liquid: Positions of the liquid particles, shape (3, n) [m].
        walls: Positions of the wall particles, shape (3, m) [m].
        pressure: Pressures of the liquid particles, shape (n,) [Pa].
        law: Parameters of the pair interactions, such as kernel, smoothing length and density.
    """
    points = np.concatenate((liquid, walls), axis=1)
    count, fixed = points.shape[1], walls.shape[1]
    density = np.full(count, law.rest_density)
    density[: count - fixed] += pressure / law.sound**2
    mass = density * law.spacing**law.dimension
    places = {name: points[axis].copy() for axis, name in enumerate("xyz")}
    still = {name: np.zeros(count) for name in ("u", "v", "w", "pressure", "slope_x", "slope_y", "slope_z")}
    shares, viscosity = np.ones(fixed), np.zeros(count)
    walls_at_rest = {name: np.zeros(fixed) for name in ("wall_u", "wall_v", "wall_w", "wall_room")}
    return Fields(
        **places, **still, density=density, mass=mass, **walls_at_rest, wall_share=shares, viscosity=viscosity
    )  # fmt: skip


def result_of(run: FlowRun, history: dict[str, Floats], metrics: Metrics) -> FlowResult:
    """Return the result of a run, with the metrics that all flows share added to its own.

    Args:
        run: Finished run: final simulation, pictures and wall time.
        history: Column name -> samples over time, shape (n,).
        metrics: Metric name -> (value, unit) of this kind of flow. Added are ``volume_drift`` (relative change of
            volume), ``particles``, ``steps``, ``particle_steps_per_second`` [1/s] and ``seconds`` (wall time) [s].

    Returns:
        Pictures, wall particles, history and all metrics.
    """
    simulation = run.simulation
    fluids, fields = simulation.fluids, simulation.fields
    at_start = fluids * simulation.law.spacing**simulation.law.dimension
    shared = {
        "volume_drift": (simulation.volume / at_start - 1.0, ""),
        "particles": (float(fluids), ""),
        "steps": (float(simulation.steps), ""),
        "particle_steps_per_second": (simulation.steps * fluids / run.seconds, "1/s"),
        "seconds": (run.seconds, "s"),
    }
    walls = np.stack([values[fluids:] for values in fields[:3]], axis=1)
    return FlowResult(run.pictures, walls, history, metrics | shared)
