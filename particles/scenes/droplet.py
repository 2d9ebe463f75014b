"""A droplet in space by delta-SPH: free, at rest on a wall, or striking it."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from math import cos, pi, sqrt

import numpy as np
from scipy.spatial import ConvexHull

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.parameters.droplets import Droplet, cap
from reflowshock.particles.parameters.flow_effects import decide_flow
from reflowshock.particles.reference.impact_spread import of_measured, wildeman
from reflowshock.particles.sph import flow
from reflowshock.particles.sph.capillary_forces import Capillarity
from reflowshock.particles.sph.flow import FlowResult, Metrics
from reflowshock.particles.sph.fluid_state import Law
from reflowshock.particles.sph.liquid_surface import LiquidSurface
from reflowshock.particles.sph.simulation import Simulation
from reflowshock.particles.surface.breakup import largest_part
from reflowshock.particles.surface.cloud_level_set import boundary_loops
from reflowshock.particles.surface.level_set import LevelSet, extract_surface, relax
from reflowshock.particles.surface.morphological_closing import count_parts
from reflowshock.particles.surface.profile import width
from reflowshock.particles.surface.remeshing import EDGE
from reflowshock.particles.surface.surface_mesh import SurfaceLost, SurfaceMesh

COLUMNS = (
    "time", "mean_pressure", "roundness", "spread", "base", "height", "largest_speed", "kinetic_energy",
    "surface_energy", "surface_volume", "foot", "parts", "spray", "shed",
)  # fmt: skip
# Share of the radius within which the pressure of a free drop is averaged: the surface is far.
CORE = 0.5
# In spacings, and over the height: where the profile of a drop on a wall is read. Next to the wall it is rounded.
FOOT, SHOULDER = 1.5, 0.7
FEWEST = 12
# Over the diameter, times Re^(2/5): thickness of the film that an impact leaves (Roisman 2009).
RESIDUAL_FILM = 0.79
# Newton steps until the surface encloses the volume.
ENCLOSURES = 3


def solve_droplet(
    scene: Droplet, progress: Callable[[float], None] | None = None, checkpoint: Checkpoint | None = None
) -> FlowResult:
    """Let a droplet move.

    Raises: as `follow`.
    """
    return follow(scene, droplet(scene), progress, checkpoint)


def follow(
    scene: Droplet,
    simulation: Simulation,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> FlowResult:
    """Let the liquid of a simulation move as a droplet does, whatever state it begins in.

    Raises:
        FloatingPointError: a position is not finite.
        SurfaceLost: the liquid has left its surface, or that is none any more.
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
    words = {"outcome": outcome(history), "film": _film(scene)} | _expected(scene) if scene.impact_speed else {}
    return replace(flow.result_of(run, history, _metrics(scene, history)), words=words)


def _film(scene: Droplet) -> str:
    """Tell how thick the film is that an impact leaves, and with how many particles it has two."""
    film = RESIDUAL_FILM / scene.reynolds_number**0.4
    return f"{film:.2g} D thick; {2.0 / film:.0f} particles a diameter put two across it"


def _expected(scene: Droplet) -> dict[str, str]:
    """Tell how wide such drops spread, measured ones and computed ones; nothing where that is not known."""
    numbers = scene.weber_number, scene.reynolds_number, scene.advancing
    if not (between := of_measured(*numbers)):
        return {}
    measured = f"{between[0]:.2f} to {between[1]:.2f} D by correlations of measured drops"
    return {"spread_expected": f"{measured}, {wildeman(*numbers):.2f} D by that of computed ones"}


def droplet(scene: Droplet) -> Simulation:
    """Set up the particles and the surface about them, whose tension is in balance with the pressure of a sphere."""
    points, triangles, spacing = start_shape(scene)
    law, tension = liquid_of(scene, spacing)
    fields = flow.liquid_and_walls(points, np.empty((3, 0)), np.zeros(points.shape[1]), law)
    fields.w[:] = -scene.impact_speed
    mesh = SurfaceMesh(*triangles, law.spacing, bool(law.mirror))
    surface = LiquidSurface(mesh, Capillarity(tension, cos(scene.angle), law, scene.bounds))
    for _ in range(ENCLOSURES):
        surface.enclose(scene.volume)
    return Simulation(fields, points.shape[1], law, surface, flow.device_of(scene))


def liquid_of(scene: Droplet, spacing: float) -> tuple[Law, float]:
    """What acts between particles of a droplet that are a spacing apart [m], and its surface tension [N/m]."""
    effects = decide_flow(scene)
    weight = -scene.gravity if effects["droplet_gravity"]["on"] else 0.0
    law = flow.law_of(scene, (0.0, 0.0, 0.0), (0.0, 0.0, weight), has_surface=True)
    law = flow.in_space(law, spacing, mirror=scene.has_wall, no_slip=scene.impact_speed > 0.0)
    law = law._replace(tracked=1, shifting=1.0)
    return law, scene.surface_tension if effects["droplet_tension"]["on"] else 0.0


def start_shape(scene: Droplet) -> tuple[Floats, tuple[Floats, Indices], float]:
    """Points `(3, n)` of a cubic lattice, surface about them, and the spacing at which they have the volume [m]."""
    radius, edge = 0.5 * scene.diameter, scene.volume ** (1.0 / 3.0)
    across = int(np.ceil(2.0 * scene.diameter / scene.spacing)) + 1
    places = np.arange(-across, across) + 0.5
    if scene.start == "cube" and not scene.has_wall:
        count = round(edge / scene.spacing)
        places = np.arange(count) + 0.5 - 0.5 * count
    lattice = scene.spacing * np.stack(np.meshgrid(places, places, places, indexing="ij")).reshape(3, -1)
    points, triangles = _sphere(radius, EDGE * scene.spacing)
    inside = np.ones(lattice.shape[1], dtype=bool)
    if scene.start == "cube" and not scene.has_wall:
        points, triangles = _cube(edge, EDGE * scene.spacing)
    elif scene.impact_speed or not scene.has_wall:
        inside = (lattice**2).sum(axis=0) < radius**2
    else:
        inside = ((lattice**2).sum(axis=0) < 2.0 ** (2.0 / 3.0) * radius**2) & (lattice[2] > 0.0)
        points, triangles = _half(*_sphere(2.0 ** (1.0 / 3.0) * radius, EDGE * scene.spacing), EDGE * scene.spacing)
    spacing = float(np.cbrt(scene.volume / inside.sum()))
    liquid = lattice[:, inside] * (spacing / scene.spacing)
    if scene.impact_speed:
        lift = radius + 0.5 * EDGE * scene.spacing
        liquid[2] += lift
        points[:, 2] += lift
    return liquid, (points, triangles), spacing


def _sphere(radius: float, edge: float) -> tuple[Floats, Indices]:
    """Triangles of about an edge [m] on a sphere, of the volume of the sphere: points on a spiral, and their hull."""
    count = int(4.0 * pi * radius**2 / (0.5 * sqrt(3.0) * edge**2))
    turn, height = pi * (1.0 + sqrt(5.0)) * (np.arange(count) + 0.5), 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    across = np.sqrt(1.0 - height**2)
    points = np.stack((across * np.cos(turn), across * np.sin(turn), height), axis=1)
    hull = ConvexHull(points)
    triangles = hull.simplices.astype(np.int32)
    corner = points[triangles]
    inward = np.einsum("td,td->t", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return points * radius * float(np.cbrt(4.0 * pi / 3.0 / hull.volume)), triangles


def _cube(width: float, edge: float) -> tuple[Floats, Indices]:
    """Triangles of about an edge [m] on a cube of a width [m], whose edges they round."""
    grid = Grid.around(width * np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]), edge)
    x, y, z = np.meshgrid(*grid.axes(), indexing="ij")
    level = LevelSet(grid, np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z)) - 0.5 * width)
    return relax(level, *extract_surface(level), ())


def _half(points: Floats, triangles: Indices, edge: float) -> tuple[Floats, Indices]:
    """The upper half of a sphere, its edge on the wall."""
    radius = float(np.linalg.norm(points, axis=1).mean())
    low = np.abs(points[:, 2]) < 0.4 * edge
    points[low, 2] = 0.0
    points[low] *= radius / np.linalg.norm(points[low], axis=1)[:, None]
    kept = triangles[(points[triangles, 2] >= 0.0).all(axis=1)]
    used, numbers = np.unique(kept, return_inverse=True)
    points, triangles = points[used], numbers.reshape(-1, 3).astype(np.int32)
    for ring in boundary_loops(triangles):  # of some triangles all corners are too high to be on it by now
        points[ring, 2] = 0.0
        points[ring] *= radius / np.linalg.norm(points[ring], axis=1)[:, None]
    return points, triangles


def _sample(scene: Droplet, simulation: Simulation) -> tuple[float, ...]:
    """One row of the history; lengths in diameters."""
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
        width(largest_part(surface.points, surface.triangles)) / scene.diameter,
        base_width(surface.points, simulation.law.spacing) / scene.diameter,
        _height(scene, surface.points) / scene.diameter, simulation.fastest,
        simulation.kinetic_energy, surface.energy, (surface.volume + surface.spray) / scene.volume,
        2.0 * sqrt(max(surface.wetted_area, 0.0) / pi) / scene.diameter, float(count_parts(surface.triangles)),
        surface.spray / scene.volume, float(surface.detachments),
    )  # fmt: skip


def _height(scene: Droplet, points: Floats) -> float:
    """Height of a surface `(m, 3)` above the wall, or of a free one in itself [m]."""
    return float(points[:, 2].max() if scene.has_wall else np.ptp(points[:, 2]))


def base_width(points: Floats, spacing: float) -> float:
    """Width on the wall of a drop [m]: the square of its radius, a parabola in height for a cap, continued to the wall.

    nan where there is too little of a profile.
    """
    height = points[:, 2]
    read = (height > FOOT * spacing) & (height < SHOULDER * height.max())
    if read.sum() < FEWEST:
        return float("nan")
    offset = points[:, :2] - points[:, :2].mean(axis=0)
    at_wall = float(np.polynomial.Polynomial.fit(height[read], (offset[read] ** 2).sum(axis=1), 2)(0.0))
    return 2.0 * sqrt(max(at_wall, 0.0))


def outcome(history: Mapping[str, Floats]) -> str:
    """Tell in words what became of a drop that struck a wall, from its history."""
    wets, in_parts = history["foot"] > 0.0, history["parts"][-1] > 1.0
    if not wets.any():
        return "does not touch the wall"
    if wets[-1]:
        told = "a part rebounds" if in_parts else "stays on the wall"
    else:
        told = "rebounds in parts" if in_parts else "rebounds"
    return f"{told}, sheds satellites" if history["shed"][-1] else told


def rest_metrics(scene: Droplet) -> tuple[str, ...]:
    """Return the metrics whose values at rest are known: of a free sphere, of a cap of one angle without weight."""
    if not scene.has_wall:
        return ("pressure_error", "roundness")
    weighs = decide_flow(scene)["droplet_gravity"]["on"]
    return () if weighs or scene.impact_speed or scene.bounds else ("base_error", "height_error")


def _metrics(scene: Droplet, history: dict[str, Floats]) -> Metrics:
    """What the drop became: means over the last tenth of the time, in which it is to be at rest.

    `surface_volume_drift` is the largest change of what the surface encloses, with the spray, at any time sampled: when
    triangles are evened out, every few steps, it is set to the volume of the particles. `parts_shed` counts events, in
    each of which one part or several were given up.
    """
    late = history["time"] >= 0.9 * history["time"][-1]
    mean = {name: float(column[late].mean()) for name, column in history.items()}
    fastest = float(history["largest_speed"][late].max())
    change = history["surface_volume"] / history["surface_volume"][0] - 1.0
    found: Metrics = {
        "capillary_number": (fastest * scene.liquid_viscosity / scene.surface_tension, ""),
        "surface_volume_drift": (float(change[np.abs(change).argmax()]), ""),
        "spray_share": (float(history["spray"].max()), ""),
        "parts_shed": (float(history["shed"][-1]), ""),
        "ohnesorge": (scene.ohnesorge, ""),
    }
    if not scene.has_wall:
        found["mean_pressure"] = (mean["mean_pressure"], "Pa")
        found["pressure_error"] = (mean["mean_pressure"] / scene.laplace_pressure - 1.0, "")
        found["roundness"] = (mean["roundness"], "")
        return found
    base, height = cap(scene.angle)
    found["base_over_diameter"], found["height_over_diameter"] = (mean["base"], ""), (mean["height"], "")
    if rest_metrics(scene):
        found["base_error"] = (mean["base"] / base - 1.0, "")
        found["height_error"] = (mean["height"] / height - 1.0, "")
    if scene.impact_speed:
        widest = int(np.argmax(history["spread"]))
        found["weber"], found["reynolds"] = (scene.weber_number, ""), (scene.reynolds_number, "")
        found["spread_max"] = (float(history["spread"][widest]), "")
        found["time_of_spread_max"] = (float(history["time"][widest]), "s")
        if history["foot"][widest] > 0.0:
            film = scene.volume / (0.25 * pi * (history["foot"][widest] * scene.diameter) ** 2)
            found["film_over_spacing"] = (float(film / scene.spacing), "")
        wets = np.flatnonzero(history["foot"] > 0.0)
        if len(wets) and wets[-1] + 1 < len(history["time"]):
            found["contact_time"] = (float(history["time"][wets[-1] + 1] - history["time"][wets[0]]), "s")
    return found
