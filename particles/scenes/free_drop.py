"""Free drop with inertia: at rest (Laplace pressure) or oscillating in its second mode (Rayleigh)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, pi
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from reflowshock.arrays import Floats
from reflowshock.data_file import fields_of
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.cloud import sphere_cloud
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.parameters.effects import decide_oscillation, switched
from reflowshock.particles.parameters.scenes import Oscillation, rayleigh_period
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.reference.drop_oscillation import rayleigh_frequency, viscous_oscillation
from reflowshock.particles.scenes.flow_setup import build_physics
from reflowshock.particles.scenes.metrics import Metrics
from reflowshock.particles.steps.flow import FLOW_RECORDS
from reflowshock.particles.steps.inertial_step import InertialFlow, InertialStep
from reflowshock.particles.steps.shape import JointShape, Snapshot
from reflowshock.particles.steps.time_step import capillary_limit
from reflowshock.particles.surface.surface_quality import vertex_normals

METRICS = (
    "period",
    "period_error",
    "decay_rate",
    "decay_rate_error",
    "volume_drift",
    "particles",
    "particle_steps_per_second",
)
COLUMNS = ("time", "amplitude", "energy", "kinetic_energy", "volume", "momentum")
# Steps that relax the initial polyhedron, whose vertices at rest are not exactly on a sphere; the size of a step is in
# radians of the second mode.
SETTLING_STEP, SETTLING_STEPS = 3.0, 10
SNAPSHOTS_PER_PERIOD = 8
RECORDS = (*FLOW_RECORDS, Snapshot)  # dataclasses in a checkpoint of an oscillation
SECOND_MOMENT = np.array([-1.0, -1.0, 2.0])


@dataclass(frozen=True, slots=True)
class FreeDrop:
    """Motion of a free drop, and its final state.

    Attributes:
        points: Final positions of the particles, the s surface vertices first, shape (n, 3) [m].
        velocity: Final velocity, shape (n, 3) [m/s].
        pressure: Final pressure above ambient, shape (n,) [Pa].
        surface_points: Final positions of the surface vertices, shape (s, 3) [m].
        triangles: Outward triangles of the surface, shape (t, 3).
        history: Columns of equal length from the start on: time [s], amplitude of the second mode over the radius,
            energy (surface plus kinetic) [J], kinetic_energy [J], volume [m^3], momentum (its magnitude) [kg m/s].
        snapshots: Shapes at the start and at each eighth of a Rayleigh period.
        metrics: Name -> value and unit.
    """

    points: Floats
    velocity: Floats
    pressure: Floats
    surface_points: Floats
    triangles: NDArray[np.int32]
    history: dict[str, Floats]
    snapshots: list[Snapshot]
    metrics: dict[str, tuple[float, str]]


@dataclass(slots=True)
class _Swing:
    """State of a run.

    Attributes:
        flow: Flow of the drop.
        rows: Rows of the history, one for the start and one per step.
        snapshots: Shapes at regular times.
        seconds: Wall time [s].
    """

    flow: InertialFlow
    rows: list[tuple[float, ...]]
    snapshots: list[Snapshot]
    seconds: float = 0.0

    @classmethod
    def start(cls, solder: Solder, amplitude: float) -> "_Swing":
        """Return a ball with the velocity a omega/2 (-x, -y, 2 z), whose normal part on the surface is a omega R P2."""
        radius, spacing = _radius(solder), solder.numerics.spacing
        shells = round(radius / spacing)
        if shells < 2:
            raise ValueError(f"solder.numerics.spacing = {spacing:.4g} m must be below half the radius {radius:.4g} m")
        body = Body.at_rest(sphere_cloud(solder.volume, shells))
        settled = InertialFlow(body, _physics(solder), InertialStep(solder.density))
        omega = rayleigh_frequency(2, radius, solder.density, solder.surface_tension)
        settled.settle(SETTLING_STEP / omega, SETTLING_STEPS)
        body.velocity = 0.5 * amplitude * omega * SECOND_MOMENT * body.points
        swing = cls(settled, [_sample(settled, solder, 0.0)], [])
        swing.snap()
        if solder.numerics.scheme == "ispg":
            swing.flow = InertialFlow(body, _physics(solder), IspgStep())
        return swing

    def saved(self) -> dict[str, Any]:
        """Return the state for a checkpoint."""
        return fields_of(self) | {"flow": self.flow.saved(), "rows": np.array(self.rows)}

    @classmethod
    def restored(cls, saved: Mapping[str, Any], solder: Solder) -> "_Swing":
        """Return the run restored from the data of ``saved``."""
        solver = IspgStep() if solder.numerics.scheme == "ispg" else InertialStep(solder.density)
        flow = InertialFlow(saved["flow"]["body"], _physics(solder), solver)
        flow.restore(saved["flow"])
        return cls(**{**saved, "flow": flow, "rows": [tuple(row) for row in saved["rows"].tolist()]})

    def snap(self) -> None:
        """Store the current shape as a snapshot."""
        body = self.flow.body
        self.snapshots.append(Snapshot(self.rows[-1][0], body.points.copy(), body.triangles.copy()))


def solve_free_drop(  # noqa: PLR0913 - the motion, its resolution and its control
    solder: Solder,
    amplitude: float = 0.0,
    periods: float = 2.0,
    steps_per_period: int = 100,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> FreeDrop:
    """Compute a drop without walls and gravity that oscillates in its second mode, or rests.

    The steps use tetrahedra, or the scheme ispg if ``solder.numerics.scheme`` selects it, without mesh smoothing. The
    ball starts with the velocity of the mode, linear in space: a stretched initial shape would also excite modes of the
    grid, whose loss of phase in the first period looks like damping.

    Args:
        solder: Volume, fluid and spacing; viscosity acts unless ``solder.effects.viscosity`` is "off".
        amplitude: Amplitude of the second mode that the initial velocity causes, over the radius; 0 for a ball at rest.
        periods: Duration in Rayleigh periods of the second mode.
        steps_per_period: Number of time steps per period.
        progress: Function called with the fraction done, 0 to 1.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.

    Returns:
        Final particles and surface, history of amplitude and energies, snapshots and metrics.

    Raises:
        ValueError: The spacing leaves fewer than two shells of particles.
        SolveFailed: A linear solve failed.
    """
    saved = checkpoint.read(RECORDS) if checkpoint else None
    swing = _Swing.restored(saved, solder) if saved else _Swing.start(solder, amplitude)
    flow, rows = swing.flow, swing.rows
    period = 2.0 * pi / rayleigh_frequency(2, _radius(solder), solder.density, solder.surface_tension)
    steps, time_step = ceil(periods * steps_per_period), period / steps_per_period
    for step in range(len(rows), steps + 1):
        start = perf_counter()
        flow.step(time_step)
        rows.append(_sample(flow, solder, step * time_step))
        swing.seconds += perf_counter() - start
        if step % max(1, steps_per_period // SNAPSHOTS_PER_PERIOD) == 0:
            swing.snap()
        if checkpoint is not None and checkpoint.is_due():
            checkpoint.write(swing.saved())
        if progress is not None:
            progress(step / steps)
    body, count = flow.body, flow.body.cloud.surface_count
    history = dict(zip(COLUMNS, np.array(rows).T, strict=True))
    metrics = _rest_metrics(flow, solder, history)
    metrics["particle_steps_per_second"] = (steps * len(body.points) / swing.seconds, "1/s")
    if amplitude != 0.0:
        metrics |= _swing_metrics(solder, history)
    return FreeDrop(
        points=body.points,
        velocity=body.velocity,
        pressure=body.pressure,
        surface_points=body.points[:count],
        triangles=body.triangles,
        history=history,
        snapshots=swing.snapshots,
        metrics=metrics,
    )


def _radius(solder: Solder) -> float:
    """Return the radius of the ball [m]."""
    return float(np.cbrt(3.0 * solder.volume / (4.0 * pi)))


def _physics(solder: Solder) -> Physics:
    """Build the physics of a free drop."""
    effects = switched(decide_oscillation(solder))
    return build_physics(solder, effects | {"viscosity": solder.effects.viscosity != "off"}, ())


def _sample(flow: InertialFlow, solder: Solder, time: float) -> tuple[float, ...]:
    """Return one row of the history, with the entries ``COLUMNS``."""
    body, mass = flow.body, flow.mass
    offset = body.points - (mass @ body.points).sum(axis=0) / mass.sum()
    moment = SECOND_MOMENT @ (offset * (mass @ offset)).sum(axis=0) / mass.sum()
    momentum = solder.density * (mass @ body.velocity)
    kinetic = 0.5 * float((momentum * body.velocity).sum())
    energy = flow.physics.energy(body) + kinetic
    amplitude = 5.0 / 6.0 * float(moment) / _radius(solder) ** 2
    return time, amplitude, energy, kinetic, body.volume()[0], float(np.linalg.norm(momentum.sum(axis=0)))


def _rest_metrics(flow: InertialFlow, solder: Solder, history: dict[str, Floats]) -> dict[str, tuple[float, str]]:
    """Return the metrics of pressure, remaining surface motion and volume at the end."""
    body, weight = flow.body, np.asarray(flow.mass.sum(axis=0)).ravel()
    mean = float(np.average(body.pressure, weights=weight))
    scatter = float(np.sqrt(np.average((body.pressure - mean) ** 2, weights=weight)))
    normals = vertex_normals(body.points, body.triangles, body.cloud.surface_count)
    speed = float(np.abs((body.velocity[: len(normals)] * normals).sum(axis=1)).max())
    return {
        "mean_pressure": (mean, "Pa"),
        "pressure_scatter": (scatter / mean, ""),
        "mean_pressure_error": (mean * _radius(solder) / (2.0 * solder.surface_tension) - 1.0, ""),
        "capillary_number_at_rest": (solder.viscosity * speed / solder.surface_tension, ""),
        "volume_drift": (float(np.ptp(history["volume"]) / solder.volume), ""),
        "particles": (float(len(body.points)), ""),
    }


def _swing_metrics(solder: Solder, history: dict[str, Floats]) -> dict[str, tuple[float, str]]:
    """Return period and decay rate of a fitted damped oscillation, and their errors against Reid's solution."""
    radius = _radius(solder)
    omega = rayleigh_frequency(2, radius, solder.density, solder.surface_tension)
    exact_decay, exact_frequency = viscous_oscillation(2, omega, solder.viscosity / (solder.density * radius**2))
    decay, frequency = fit_oscillation(history["time"], history["amplitude"], exact_frequency)
    return {
        "period": (2.0 * pi / frequency, "s"),
        "decay_rate": (decay, "1/s"),
        "period_error": (exact_frequency / frequency - 1.0, ""),
        "decay_rate_error": (decay / exact_decay - 1.0, ""),
    }


def solve_oscillation(
    scene: Oscillation,
    solder: Solder,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> JointShape:
    """Compute an oscillating drop and return its final shape, with history and snapshots.

    Args:
        scene: Free drop: volume, amplitude of the second mode, duration and resolution.
        solder: Fluid, with the volume of the scene.
        progress: Function called with the fraction done, 0 to 1.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.

    Raises:
        SolveFailed: A linear solve failed.
    """
    drop = solve_free_drop(solder, scene.amplitude, scene.periods, scene.steps_per_period, progress, checkpoint)
    steps = len(drop.history["time"]) - 1
    limit = capillary_limit(solder.density, solder.numerics.spacing, solder.surface_tension)
    largest = rayleigh_period(scene, solder) / scene.steps_per_period
    metrics: Metrics = {name: drop.metrics[name] for name in METRICS}
    metrics |= {
        "amplitude": (float(np.abs(drop.history["amplitude"]).max()), ""),
        "time_step_over_capillary_limit": (largest / limit, ""),
        "steps": (float(steps), ""),
        "seconds": (steps * len(drop.points) / drop.metrics["particle_steps_per_second"][0], "s"),
    }
    return JointShape(
        points=drop.points,
        velocity=drop.velocity,
        pressure=drop.pressure,
        surface_points=drop.surface_points,
        triangles=drop.triangles,
        rings=(),
        history=drop.history,
        snapshots=drop.snapshots,
        metrics=metrics,
        verdict="ok",
    )


def fit_oscillation(time: Floats, values: Floats, frequency: float) -> tuple[float, float]:
    """Fit a damped oscillation and return its decay rate [1/s] and angular frequency [rad/s].

    The model is exp(-b t) cos(w t + ..) plus terms of second order: the harmonic exp(-2 b t) cos(2 w t + ..), the mean
    exp(-2 b t) and a constant. Variable projection eliminates their linear factors.

    Args:
        time: Times, shape (k,) [s], over more than a period.
        values: Values of the oscillation in any unit, shape (k,).
        frequency: Guess of the angular frequency within about 20 % [rad/s]; a guess of half the frequency is detected,
            since the harmonic is then larger.
    """

    def columns(unknowns: Floats) -> Floats:
        decay, angle = np.exp(-unknowns[0] * scaled), unknowns[1] * scaled
        first, second = decay * np.exp(1j * angle), decay**2 * np.exp(2j * angle)
        return np.column_stack((first.real, first.imag, second.real, second.imag, decay**2, np.ones_like(decay)))

    def factors(basis: Floats) -> Floats:
        return np.linalg.lstsq(basis, values, rcond=None)[0]

    def misfit(unknowns: Floats) -> Floats:
        basis = columns(unknowns)
        return basis @ factors(basis) - values

    scaled = time * frequency
    optimum = least_squares(misfit, (0.01, 1.0), x_scale=(0.01, 0.01), xtol=1e-12, ftol=1e-12).x
    first, second = np.hypot(*factors(columns(optimum))[:4].reshape(2, 2).T)
    if second > first:
        return fit_oscillation(time, values, 2.0 * frequency)
    return optimum[0] * frequency, optimum[1] * frequency
