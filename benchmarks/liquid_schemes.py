"""Comparison of delta-SPH and ISPG on one liquid: two merging drops and a drop on a wall; errors and core-seconds.

    PYTHONPATH=. .venv/bin/python benchmarks/liquid_schemes.py            (both, five minutes)
    PYTHONPATH=. .venv/bin/python benchmarks/liquid_schemes.py merging    (one of them)

Balls of 1 mm^3 of the liquid of the paper, with an Ohnesorge number mu / sqrt(rho gamma D) of 0.031, and of a liquid
with the same tension and density but 6.6 times the viscosity (0.2). Merging starts with touching balls at rest and runs
for 4 sqrt(rho D^3 / gamma). The neck radius r between two spheres of radius R first grows with the square root of time,
d(r^2)/dt = C^2 (gamma R / rho)^(1/2), fitted from 0.65 to 0.8 R. On a wall delta-SPH starts from a half sphere and runs
for a fixed time; ISPG starts from a cube and runs to rest.
"""

import os
from math import pi, radians
from time import process_time

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from benchmarks.support.tables import write_tables
from benchmarks.tension.scenes import TRACKED, make_pair
from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.parameters.effects import decide_drop, switched
from reflowshock.particles.parameters.scenes import PROPERTIES, Drop, Drops, Fluid
from reflowshock.particles.parameters.solder import FlowEffects, SchemeNumerics
from reflowshock.particles.scenes.drop_at_rest import drop_to_rest
from reflowshock.particles.scenes.drop_pair import start_clouds
from reflowshock.particles.scenes.flow_setup import start_flow
from reflowshock.particles.scenes.rebuild import hand_over, rebuild
from reflowshock.particles.sph_flows.droplet import solve_droplet
from reflowshock.particles.surface.profile import section_areas

NAME = "liquid_schemes"
VOLUME = 1e-9
RADIUS = float(np.cbrt(0.75 * VOLUME / pi))
# Radius of the merged sphere [m].
MERGED = RADIUS * 2.0 ** (1.0 / 3.0)
PAPER = PROPERTIES["paper"]
OHNESORGE = (0.0305, 0.2)
# Particles per diameter, radius and cube edge; duration of merging; fitted range of the neck's
# growth, in radii.
ACROSS, IN_RADIUS, PER_EDGE = (10, 14), (4, 6), 7
FOLLOWED, GROWTH = 4.0, (0.65, 0.8)
# Period of the merged drop over the unit of time of one drop.
PERIOD = 2.0 * pi / 32.0**0.5
ANGLES = (60.0, 120.0)
UNIT = float(np.sqrt(PAPER["density"] * (2.0 * RADIUS) ** 3 / PAPER["surface_tension"]))


def viscosity(ohnesorge: float) -> float:
    """Return the viscosity [Pa s] of a ball with an Ohnesorge number."""
    return ohnesorge * float(np.sqrt(PAPER["density"] * PAPER["surface_tension"] * 2.0 * RADIUS))


def ink(ohnesorge: float, across: int, **more) -> Droplet:
    """Return the parameters of a ball of the liquid for delta-SPH.

    Args:
        ohnesorge: Ohnesorge number, which sets the viscosity.
        across: Number of particles across the diameter.
        more: Further parameters of the droplet.
    """
    numerics = DropletNumerics(particles_per_diameter=across)
    parameters = PAPER | {"diameter": 2.0 * RADIUS, "viscosity": viscosity(ohnesorge), "gravity": 0.0}
    return Droplet(**parameters | {"duration": 1.0} | more, numerics=numerics)


def solder(ohnesorge: float) -> Fluid:
    """Return the same liquid for the scheme ispg, from its Ohnesorge number."""
    effects, numerics = FlowEffects(inertia="on"), SchemeNumerics(scheme="ispg")
    return Fluid(parameters="paper", viscosity=viscosity(ohnesorge), effects=effects, numerics=numerics)


def measure_neck(points: np.ndarray, triangles: np.ndarray) -> float:
    """Return the radius of the neck between two drops that lie along x, over the radius R of a drop.

    It is the radius of a disc with the area of the smallest cross-section.

    Args:
        points: Vertices of the surface, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
    """
    heights = np.linspace(-0.3, 0.3, 25) * RADIUS + 1e-9
    turned = np.ascontiguousarray(points[:, [1, 2, 0]])
    return float(np.sqrt(section_areas(turned, triangles, heights).min() / pi)) / RADIUS


def measure_state(time: float, points: np.ndarray, triangles: np.ndarray, grown: bool) -> tuple[float, float, float]:
    """Return time [sqrt(rho D^3 / gamma)], neck over R, and length over the diameter of the merged drop.

    Args:
        time: Time [s].
        points: Vertices of the surface, shape (m, 3) [m].
        triangles: Outward oriented triangles, shape (t, 3).
        grown: Whether the neck has reached its full width; it is then not measured, but infinite.
    """
    length = float(np.ptp(points[:, 0])) / (2.0 * MERGED)
    return time / UNIT, np.inf if grown else measure_neck(points, triangles), length


def summarise_merging(rows: list, points: np.ndarray, seconds: float) -> dict:
    """Summarise how two drops merged.

    Args:
        rows: Rows of ``measure_state``, one for each step.
        points: Final vertices of the surface, shape (m, 3) [m].
        seconds: Processor time [s].

    Returns:
        ``growth`` of the neck, time ``neck_grown_after``, ``last_swing`` of the length, mean and largest
        ``radius_error`` of the merged sphere, and ``seconds``.
    """
    time, width, length = np.array(rows).T
    low, high = (int(np.argmax(width > share)) for share in GROWTH)
    slope = np.polyfit(time[low:high], width[low:high] ** 2, 1)[0] if high > low + 1 else float("nan")
    swings = time > time[-1] - PERIOD
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1) / MERGED
    return {
        "growth": float(np.sqrt(slope)) / 8.0**0.25,  # times are in units of D, the growth law in units of R
        "neck_grown_after": float(time[high]),
        "last_swing": float(np.abs(length[swings] - 1.0).max()),
        "radius_error": float(distance.mean() - 1.0),
        "largest_radius_error": float(np.abs(distance - 1.0).max()),
        "seconds": seconds,
    }


def merge_by_sph(ohnesorge: float, across: int) -> dict:
    """Merge two balls by delta-SPH, close enough to merge in the first step.

    Args:
        ohnesorge: Ohnesorge number of the liquid.
        across: Number of particles across the diameter of a ball.

    Returns:
        ``particles``, ``steps``, ``volume_error``, and the figures of ``summarise_merging``.
    """
    scene = ink(ohnesorge, across)
    simulation = make_pair(scene, TRACKED, 1.0, gap=0.9, speed=0.0)
    simulation.step(1e-9 * UNIT)  # compiles the kernels
    begin, rows = process_time(), []
    while simulation.time < FOLLOWED * UNIT:
        simulation.step(simulation.time_step())
        surface, grown = simulation.surface, bool(rows) and rows[-1][1] > 1.0
        rows.append(measure_state(simulation.time, surface.points, surface.triangles, grown))
    figures = summarise_merging(rows, surface.points, process_time() - begin)
    volume = surface.volume / (2.0 * VOLUME) - 1.0
    return {"particles": simulation.fluids, "steps": simulation.steps, "volume_error": volume} | figures


def merge_by_ispg(ohnesorge: float, in_radius: int) -> dict:
    """Merge two touching balls by the scheme ispg.

    Args:
        ohnesorge: Ohnesorge number of the liquid.
        in_radius: Number of particles along the radius of a ball.

    Returns:
        ``particles``, ``steps``, ``volume_error``, and the figures of ``summarise_merging``.
    """
    scene = Drops(
        volume_left=VOLUME, volume_right=VOLUME, distance=2.000002 * RADIUS, spacing=RADIUS / in_radius
    )  # fmt: skip
    liquid = solder(ohnesorge).resolve(scene, "off")
    acting = switched(decide_drop(liquid, True))
    old = [start_flow(cloud, liquid, acting, ()) for cloud in start_clouds(scene)]
    made = rebuild(*(flow.body for flow in old)).cloud
    start_flow(made, liquid, acting, ()).step()  # compiles the kernels
    begin, rows, steps = process_time(), [], 0
    flow = start_flow(made, liquid, acting, ())
    hand_over(old, [flow])
    while flow.time < FOLLOWED * UNIT:
        flow.step()
        steps += 1
        grown, count = bool(rows) and rows[-1][1] > 1.0, flow.body.cloud.surface_count
        rows.append(measure_state(flow.time, flow.body.points[:count], flow.body.triangles, grown))
    surface = flow.body.points[: flow.body.cloud.surface_count]
    figures = summarise_merging(rows, surface, process_time() - begin)
    volume = flow.body.volume()[0] / (2.0 * VOLUME) - 1.0
    return {"particles": len(flow.body.points), "steps": steps, "volume_error": float(volume)} | figures


def relax_cap_by_sph(ohnesorge: float, degrees: float, across: int) -> dict:
    """Let a half sphere relax on a wall by delta-SPH.

    Args:
        ohnesorge: Ohnesorge number of the liquid.
        degrees: Contact angle [degrees].
        across: Number of particles across the diameter of the sphere.

    Returns:
        ``particles``, ``seconds`` (processor time), ``height_error`` and ``base_error``.
    """
    scene = ink(ohnesorge, across, contact_angle=radians(degrees), duration=FOLLOWED * UNIT)
    begin = process_time()
    metrics = {name: value for name, (value, _) in solve_droplet(scene).metrics.items()}
    errors = {"height_error": metrics["height_error"], "base_error": metrics["base_error"]}
    return {"particles": int(metrics["particles"]), "seconds": process_time() - begin} | errors


def relax_cap_by_ispg(ohnesorge: float, degrees: float, per_edge: int) -> dict:
    """Let a cube relax on a wall by the scheme ispg.

    Args:
        ohnesorge: Ohnesorge number of the liquid.
        degrees: Contact angle [degrees].
        per_edge: Number of particles along an edge.

    Returns:
        ``particles``, ``seconds`` (processor time), ``height_error``, ``max_width_error`` and ``at_rest``.
    """
    drop = Drop(volume=VOLUME, contact_angle=radians(degrees), particles_per_edge=per_edge)
    begin = process_time()
    metrics = drop_to_rest(drop, solder(ohnesorge).resolve(drop, "off")).shape.metrics
    figures = {name: metrics[name][0] for name in ("height_error", "max_width_error", "at_rest")}
    return {"particles": per_edge**3, "seconds": process_time() - begin} | figures


def print_row(name: str, row: dict) -> dict:
    """Print the name and the figures of a row, and return the figures unchanged."""
    words = (f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items())
    print(f"  {name}:", "  ".join(words), flush=True)
    return row


def run_merging() -> dict:
    """Merge two drops by both schemes at every size; return words for the run -> its figures."""
    rows = {}
    for ohnesorge in OHNESORGE:
        for scheme, run, sizes in (("delta-SPH", merge_by_sph, ACROSS), ("ISPG", merge_by_ispg, IN_RADIUS)):
            for size in sizes:
                name = f"Oh {ohnesorge:g}, {scheme}, {size}"
                rows[name] = print_row(name, run(ohnesorge, size))
    return rows


def run_caps() -> dict:
    """Let caps relax by both schemes; return words for the run -> its figures.

    Only the more viscous liquid is computed, since the other one still swings.
    """
    rows, ohnesorge = {}, OHNESORGE[-1]
    for degrees in ANGLES:
        for scheme, run, size in (("delta-SPH", relax_cap_by_sph, ACROSS[-1]), ("ISPG", relax_cap_by_ispg, PER_EDGE)):
            name = f"{degrees:g} degrees, {scheme}, {size}"
            rows[name] = print_row(name, run(ohnesorge, degrees, size))
    return rows


if __name__ == "__main__":
    write_tables(__doc__.splitlines()[0], {"merging": run_merging, "caps": run_caps}, NAME)
