"""Delta-SPH drops with four models of surface tension: at rest, on a wall, swinging and merging, with their errors.

Density, tension and diameter are one; the unit of time is sqrt(rho D^3 / gamma). Only a tracked surface prevents
shifting from moving particles out of the liquid; the other models therefore run without shifting, as in their
publications.
"""

from collections.abc import Callable
from math import cos, pi, radians, sqrt
from time import process_time

import numpy as np
from scipy.optimize import curve_fit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from benchmarks.tension.colour import ColourFunction
from benchmarks.tension.free_pressure import FreeSurfacePressure
from benchmarks.tension.half_level import RAYS, fill_lattice, level_points
from benchmarks.tension.pairwise import Pairwise, cohesion
from reflowshock.arrays import Floats
from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.flows.droplet_metrics import base_width
from reflowshock.particles.reference.drop_oscillation import rayleigh_frequency, viscous_oscillation
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.fluid_state import Fields, Law
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.sph.smoothing import SUPPORT
from reflowshock.particles.sph_flows.droplet import droplet
from reflowshock.particles.surface.remeshing import EDGE
from reflowshock.particles.surface.surface_mesh import SurfaceLost

TRACKED = "tracked surface"
MODELS = ("colour function", "pairwise", "free-surface pressure", TRACKED)
UNIT = {"diameter": 1.0, "density": 1.0, "surface_tension": 1.0, "duration": 1.0, "gravity": 0.0}
# Stretch of a drop over the sphere; speed of two approaching drops.
STRETCH, APPROACH = 1.05, 0.3
# Largest share of detached particles before a run counts as torn apart; number of checks.
LOST, LOOKS = 0.02, 40
# Length over width of a nearly round drop.
ROUND = 1.05
# The height of a cap is the mean over the steepest rays: a single ray depends on particle positions.
TOP = 10


def set_up_drop(scene: Droplet, model: str, strength: float = 1.0) -> Simulation:
    """Set up the drop of a scene with one of the models of surface tension, at the pressure of a sphere.

    Args:
        scene: Parameters of the droplet.
        model: Model: tracked surface, "pairwise", "colour function" or "free-surface pressure".
        strength: Strength of pairwise forces over theory; ignored by other models.
    """
    tracked = droplet(scene)
    if model == TRACKED:
        return tracked
    law = tracked.law._replace(tracked=0, shifting=0.0)
    return make_untracked(law, fields_at(scene, law, np.array(tracked.fields[:3])), scene, model, strength)


def fields_at(scene: Droplet, law: Law, points: Floats) -> Fields:
    """Return the fields of particles at rest at ``points``, shape (3, n) [m], at the pressure of a sphere."""
    return flow.make_fields(points, np.empty((3, 0)), np.full(points.shape[1], scene.laplace_pressure), law)


def make_untracked(law: Law, fields: Fields, scene: Droplet, model: str, strength: float) -> Simulation:
    """Return a simulation of particles whose surface is not tracked by triangles.

    Args:
        law: Parameters of the pair interactions.
        fields: Positions, velocities, densities and masses at the start.
        scene: Surface tension and contact angle.
        model: "pairwise", "colour function" or "free-surface pressure".
        strength: Strength of pairwise forces over theory; ignored by other models.
    """
    parameters = (law, scene.surface_tension, cos(scene.angle))
    if model == "pairwise":
        surface = Pairwise(*parameters, factor=strength)
        rest = law.rest_density + strength * cohesion(law, scene.surface_tension) / law.sound**2
        law = law._replace(rest_density=rest)
    else:
        surface = {"colour function": ColourFunction, "free-surface pressure": FreeSurfacePressure}[model](*parameters)
    return Simulation(fields, len(fields.x), law, surface)


def unit_drop(across: int, ohnesorge: float, **more) -> Droplet:
    """Return a drop with unit density, tension and diameter.

    Args:
        across: Number of particles across the diameter.
        ohnesorge: Ohnesorge number, equal to the viscosity.
        more: Further parameters of the droplet.
    """
    return Droplet(**UNIT | more, viscosity=ohnesorge, numerics=DropletNumerics(particles_per_diameter=across))


def run_until(simulation: Simulation, until: float, sample: Callable[[Simulation], tuple[float, ...]]) -> dict:
    """Run a simulation, in place, to a time or until the liquid comes apart.

    Args:
        simulation: Simulation at its start.
        until: Final time.
        sample: Function of the simulation that returns a row after each step, the time first.

    Returns:
        ``particles``, ``steps``, ``seconds`` (processor time), number of ``lost`` particles, ``us_per_particle_step``,
        ``rows`` as an array and, if the liquid came apart, ``torn_apart_at`` and ``why``.
    """
    simulation.step(1e-9)  # compiles the kernels
    rows, seconds, looked, torn = [], 0.0, 0, {}
    try:
        while simulation.time < until and not torn:
            begin = process_time()
            simulation.step(simulation.time_step())
            seconds += process_time() - begin
            rows.append(sample(simulation))
            if simulation.time > looked * until / LOOKS:
                looked, torn = looked + 1, check_break_up(simulation)
    except (SurfaceLost, FloatingPointError) as error:
        torn = {"torn_apart_at": simulation.time, "why": str(error)}
    count = simulation.fluids
    figures = {
        "particles": count,
        "steps": simulation.steps,
        "seconds": seconds,
        "lost": count_detached(simulation),
    } | torn
    return figures | {"us_per_particle_step": 1e6 * seconds / (count * simulation.steps), "rows": np.array(rows)}


def count_detached(simulation: Simulation) -> int:
    """Return the number of particles detached from the largest part of the liquid."""
    points = np.stack(simulation.fields[:3], axis=1)
    pairs = cKDTree(points).query_pairs(SUPPORT * simulation.law.length, output_type="ndarray")
    touch = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    return len(points) - int(np.bincount(connected_components(touch, directed=False)[1]).max())


def check_break_up(simulation: Simulation) -> dict:
    """Return ``torn_apart_at`` (time) and ``why`` if the liquid has come apart; empty if it has not."""
    fields = simulation.fields
    if not np.isfinite(np.array(fields[:3])).all():
        return {"torn_apart_at": simulation.time, "why": "positions are not finite"}
    lost = count_detached(simulation)
    return (
        {"torn_apart_at": simulation.time, "why": f"{lost} particles left"} if lost > LOST * simulation.fluids else {}
    )


def particle_volumes(fields: Fields) -> Floats:
    """Return the volume of each particle, mass over density, shape (n,) [m^3]."""
    return fields.mass / fields.density


def core_pressure(simulation: Simulation, radius: float) -> float:
    """Return the mean pressure within half a radius of the drop's centre, including the model's own forces [Pa].

    Args:
        simulation: Drop at any time; not changed.
        radius: Radius of the drop [m].
    """
    points = np.stack(simulation.fields[:3], axis=1)
    model_pressure = getattr(simulation.surface, "bulk_pressure", lambda *_: 0.0)(points, simulation.fields)
    core = np.linalg.norm(points - points.mean(axis=0), axis=1) < 0.5 * radius
    return float((simulation.pressures + model_pressure)[core].mean())


def level_radii(simulation: Simulation) -> Floats:
    """Return the distances of a drop's surface, the level 1/2 of the colour, from its centre, shape (400,) [m]."""
    points, volume = np.stack(simulation.fields[:3], axis=1), particle_volumes(simulation.fields)
    level = level_points(points, volume, simulation.law.spacing, half=False)
    return np.linalg.norm(level - volume @ points / volume.sum(), axis=1)


def last_tenth(rows: Floats) -> Floats:
    """Return the rows of the last tenth of the time; the first column of ``rows``, shape (n, c), is the time."""
    return rows[rows[:, 0] >= 0.9 * rows[-1, 0]]


def run_to_rest(model: str, across: int, strength: float, shape: str = "cube") -> dict:
    """Let a free drop come to rest as a sphere.

    Args:
        model: Model of surface tension.
        across: Number of particles across the diameter.
        strength: Strength of pairwise forces over theory.
        shape: Initial shape, "cube" or "sphere".

    Returns:
        Figures of ``run_until`` without rows, and ``pressure_error``, ``pressure_drift``, ``roundness``,
        ``capillary_number`` and ``volume_error`` unless the liquid came apart.
    """
    scene = unit_drop(across, 0.2, start=shape)

    def sample(flow_state):
        return (
            flow_state.time,
            core_pressure(flow_state, 0.5) if flow_state.steps % 10 == 0 else np.nan,
            flow_state.fastest,
        )

    simulation = set_up_drop(scene, model, strength)
    figures = run_until(simulation, 2.0, sample)
    rows = figures.pop("rows")
    if "torn_apart_at" in figures:
        return figures
    radius = level_radii(simulation)
    return figures | {
        "pressure_error": float(np.nanmean(last_tenth(rows)[:, 1])) / scene.laplace_pressure - 1.0,
        "pressure_drift": float(np.nanstd(last_tenth(rows)[:, 1])) / scene.laplace_pressure,
        "roundness": float(radius.max() / radius.min()),
        "capillary_number": float(last_tenth(rows)[:, 2].max()) * scene.viscosity / scene.surface_tension,
        "volume_error": float(particle_volumes(simulation.fields).sum() / scene.volume - 1.0),
    }


def run_cap_to_rest(degrees: float, model: str, across: int, strength: float) -> dict:
    """Let a half sphere on a wall come to rest as a spherical cap.

    Args:
        degrees: Contact angle [degrees].
        model: Model of surface tension.
        across: Number of particles across the diameter.
        strength: Strength of pairwise forces over theory.

    Returns:
        Figures of ``run_until`` without rows, and ``height_error``, ``base_error``, ``capillary_number`` and
        ``volume_error``; ``why`` for a model without a contact angle.
    """
    if model == "free-surface pressure":
        return {"why": "the model has no contact angle; at a mirror the angle is 90 degrees"}
    scene = unit_drop(across, 0.2, contact_angle=radians(degrees))
    simulation = set_up_drop(scene, model, strength)
    figures = run_until(simulation, 2.5, lambda flow_state: (flow_state.time, flow_state.fastest))
    rows = figures.pop("rows")
    if "torn_apart_at" in figures:
        return figures
    spacing, angle = simulation.law.spacing, scene.angle
    radius = 0.5 * (4.0 / ((2.0 + cos(angle)) * (1.0 - cos(angle)) ** 2)) ** (1.0 / 3.0)

    def inside(points):
        below = np.array([0.0, 0.0, -radius * cos(angle)])
        return (points[:, 2] > 0.0) & (np.linalg.norm(points - below, axis=1) < radius)

    points = np.stack(simulation.fields[:3], axis=1)
    level = level_points(points, particle_volumes(simulation.fields), spacing, half=True)
    exact = level_points(*fill_lattice(inside, 2.0 * radius, spacing), spacing, half=True)
    bases = [base_width(shape, spacing) for shape in (level, exact)]
    tops = [shape[: RAYS // TOP, 2].mean() for shape in (level, exact)]
    return figures | {
        "height_error": float(tops[0] / tops[1] - 1.0),
        "base_error": bases[0] / bases[1] - 1.0,
        "capillary_number": float(last_tenth(rows)[:, 1].max()) * scene.viscosity / scene.surface_tension,
        "volume_error": float(particle_volumes(simulation.fields).sum() / scene.volume - 1.0),
    }


def stretch_drop(simulation: Simulation) -> Simulation:
    """Return a new simulation of a drop stretched along z at constant volume; the given one must not be used again."""
    fields, factors = simulation.fields, np.array([STRETCH**-0.5, STRETCH**-0.5, STRETCH])
    for axis in range(3):
        fields[axis][:] *= factors[axis]
    if hasattr(simulation.surface, "points"):
        simulation.surface.mesh.points *= factors
    return Simulation(fields, simulation.fluids, simulation.law, simulation.surface)


def run_swing(model: str, across: int, strength: float) -> dict:
    """Let a stretched drop swing and fit a damped cosine to its second moments.

    Args:
        model: Model of surface tension.
        across: Number of particles across the diameter.
        strength: Strength of pairwise forces over theory.

    Returns:
        Figures of ``run_until`` without rows, and ``period_error``, ``decay_error`` and ``fit_residual``; ``why``
        without a fit.
    """
    scene = unit_drop(across, 0.05)
    frequency = rayleigh_frequency(2, 0.5, 1.0, 1.0)
    decay, exact = viscous_oscillation(2, frequency, scene.viscosity / 0.25)

    def sample(flow_state):
        x, y, z = flow_state.fields[:3]
        return flow_state.time * frequency, float(flow_state.fields.mass @ (z**2 - 0.5 * (x**2 + y**2)))

    figures = run_until(stretch_drop(set_up_drop(scene, model, strength)), 2.5 * 2.0 * pi / frequency, sample)
    rows = figures.pop("rows")
    if "torn_apart_at" in figures:
        return figures
    time, moment = rows[rows[:, 0] > 0.5].T

    def damped(t, rate, turn, *parts):
        return np.exp(-rate * t) * (parts[0] * np.cos(turn * t) + parts[1] * np.sin(turn * t)) + parts[2]

    first = (decay / frequency, 1.0, 1.0, 0.0, 0.0)
    try:
        fit, _ = curve_fit(damped, time, moment / rows[0, 1], first)
    except RuntimeError:
        return figures | {"why": "the motion does not fit a damped oscillation"}
    left = np.std(moment / rows[0, 1] - damped(time, *fit)) / np.std(moment / rows[0, 1])
    return figures | {
        "period_error": float(exact / frequency / fit[1] - 1.0),
        "decay_error": float(fit[0] * frequency / decay - 1.0),
        "fit_residual": float(left),
    }


def make_pair(scene: Droplet, model: str, strength: float, gap: float = EDGE, speed: float = APPROACH) -> Simulation:
    """Return two drops along x that approach each other.

    Args:
        scene: Parameters of one drop.
        model: Model of surface tension.
        strength: Strength of pairwise forces over theory.
        gap: Gap between the drops [spacings].
        speed: Speed of each drop [m/s].
    """
    drop = droplet(scene)
    aside = np.array([0.5 * scene.diameter + 0.5 * gap * drop.law.spacing, 0.0, 0.0])
    points, surface = np.array(drop.fields[:3]), drop.surface
    both = np.concatenate((points - aside[:, None], points + aside[:, None]), axis=1)
    if model != TRACKED:
        law = drop.law._replace(tracked=0, shifting=0.0)
        fields = fields_at(scene, law, both)
        fields.u[:] = -speed * np.sign(both[0])
        return make_untracked(law, fields, scene, model, strength)
    corners, triangles = surface.points.copy(), surface.triangles.copy()
    surface.mesh.points = corners - aside
    surface.add(corners + aside, triangles)
    fields = flow.make_fields(both, np.empty((3, 0)), np.zeros(both.shape[1]), drop.law)
    fields.u[:] = -speed * np.sign(both[0])
    return Simulation(fields, both.shape[1], drop.law, surface)


def run_merging(model: str, across: int, strength: float) -> dict:
    """Let two drops merge to a sphere.

    Args:
        model: Model of surface tension.
        across: Number of particles across the diameter of a drop.
        strength: Strength of pairwise forces over theory.

    Returns:
        Figures of ``run_until`` without rows, and ``radius_error``, ``roundness``, ``pressure_error``,
        ``volume_error``, ``capillary_number``, and ``round_after``, the time until it is nearly round.
    """
    scene = unit_drop(across, 0.2)
    simulation = make_pair(scene, model, strength)

    def sample(flow_state):
        x, y, z = (axis - axis.mean() for axis in flow_state.fields[:3])
        return flow_state.time, sqrt(float((x**2).sum() / (0.5 * (y**2 + z**2).sum()))), flow_state.fastest

    figures = run_until(simulation, 3.0, sample)
    rows = figures.pop("rows")
    if "torn_apart_at" in figures:
        return figures
    radius, spacing = np.cbrt(0.25), simulation.law.spacing
    exact = fill_lattice(lambda points: np.linalg.norm(points, axis=1) < radius, radius, spacing)
    distance = level_radii(simulation)
    level = np.linalg.norm(level_points(*exact, spacing, half=False), axis=1).mean()
    longer = np.flatnonzero(rows[:, 1] > ROUND)
    return figures | {
        "radius_error": float(distance.mean() / level - 1.0),
        "roundness": float(distance.max() / distance.min()),
        "pressure_error": core_pressure(simulation, radius) * radius / 2.0 - 1.0,
        "volume_error": float(particle_volumes(simulation.fields).sum() / (2.0 * scene.volume) - 1.0),
        "round_after": float(rows[longer[-1], 0]) if len(longer) else 0.0,
        "capillary_number": float(last_tenth(rows)[:, 2].max()) * scene.viscosity / scene.surface_tension,
    }
