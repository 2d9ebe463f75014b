"""Droplet impacts and a dam break compared with OpenFOAM's interFoam (volume of fluid) and PySPH (delta-SPH).

    PYTHONPATH=. .venv/bin/python benchmarks/droplet_peers.py         (all, half an hour; results/droplet_peers.json)
    PYTHONPATH=. .venv/bin/python benchmarks/droplet_peers.py impact  (one of them)

``impact``: drops that strike a no-slip wall with a contact angle of 90 degrees, at several Weber and Reynolds numbers:
width over time, maximum width, and seconds of one core. interFoam (Debian package openfoam) solves an axisymmetric
wedge with air and 40 cells per diameter; one layer of cells against three-dimensional particles is in its favour.

``widths``: why both codes spread wider than measured drops: maximum width with 20 to 60 cells per diameter, with the
advancing contact angle of the measured drops, and by correlations with both angles.

``dam_break``: front of a column with an aspect ratio of 2 against Martin & Moyce (1952), and seconds per
particle-step, for both codes with the same resolution, kernel, smoothing length and speed of sound. The PySPH example
has a stiffer equation of state, an artificial viscosity of 0.1 instead of 0.02, and no density diffusion. With 80
particles over the height its values become nan at 1.9 sqrt(a / 2 g), so that it runs with fewer. PySPH is built from
PyPI in an environment under ``build/`` (two minutes).
"""

import json
import os
import shutil
import subprocess
import tempfile
import venv
from math import sqrt
from pathlib import Path
from time import process_time
from typing import NamedTuple

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt

from benchmarks.support import interfoam, results
from benchmarks.support.interfoam import Wedge
from benchmarks.support.tables import write_tables
from reflowshock.particles.flows.dam_break import DamBreak
from reflowshock.particles.flows.droplet import Droplet, DropletNumerics
from reflowshock.particles.flows.sph_numerics import SphNumerics
from reflowshock.particles.reference.impact_spread import laan, of_measured, pasandideh_fard, roisman, wildeman
from reflowshock.particles.sph_flows.dam_break import solve_dam_break
from reflowshock.particles.sph_flows.droplet import solve_droplet
from reflowshock.particles.steps.time_step import capillary_limit
from reflowshock.particles.surface.surface_mesh import SurfaceLost

mpl.use("Agg")
NAME = "droplet_peers"
FOLDER = Path(__file__).parents[1] / "build" / "peers"
PYTHON = FOLDER / "pysph" / "bin" / "python"
INK = {"diameter": 23e-6, "density": 1000.0, "surface_tension": 0.072}
SOLDER = {"diameter": 78e-6, "density": 8150.0, "surface_tension": 0.55}


class Impact(NamedTuple):
    """Impact scene: liquid, Weber and Reynolds number, duration in D / U, particles per diameter."""

    liquid: dict
    weber: float
    reynolds: float
    units: float
    across: int


IMPACTS = {
    "ink, We 8, Re 7.7": Impact(INK, 8.0, 7.7, 1.8, 14),
    "solder, We 2.4, Re 280": Impact(SOLDER, 2.4, 280.0, 1.5, 14),
    "solder, We 30, Re 500": Impact(SOLDER, 30.0, 500.0, 2.5, 20),
    "solder, We 100, Re 1000": Impact(SOLDER, 100.0, 1000.0, 2.5, 20),
    "solder, We 300, Re 2000": Impact(SOLDER, 300.0, 2000.0, 3.5, 20),
}
# The fastest impacts, which are limited by film and rim.
FAST = list(IMPACTS)[2:]
CELLS, SAMPLES = 40, 100
# Static and advancing contact angle [degrees]; cells per diameter with the static one.
ANGLES, FINENESS = (90.0, 120.0), (20, 40, 60)
# Column of the PySPH example [m]; column heights in particles.
WIDTH, HEIGHT, TANK = 1.0, 2.0, 4.0
IN_HEIGHT, FOLLOWED = (40, 60), 0.47
# Time over sqrt(a / 2 g), front position over the width a: Martin & Moyce's figure 3 (a = 1.125, 2.25 inches), as
# digitised for PySPH (BSD-3), `pysph/examples/db_exp_data.py`.
MEASURED = ((1.212, 1.443), (1.219, 1.474), (1.602, 1.884), (1.997, 2.292))


def run_impacts() -> dict:
    """Run every impact with both codes and draw their widths; return name of the impact -> result of ``run_impact``."""
    spreads = {name: run_impact(impact_scene) for name, impact_scene in IMPACTS.items()}
    draw(spreads)
    return spreads


def draw(spreads: dict) -> None:
    """Plot the widths over time of each impact (name -> result of ``run_impact``) to a PNG file, one panel for each."""
    figure, panels = plt.subplots(1, len(spreads), figsize=(3.2 * len(spreads), 3.2), sharey=True, layout="constrained")
    for panel, (name, sides) in zip(panels, spreads.items(), strict=True):
        for side, label, line in (("delta_sph", "delta-SPH, 3D", "-"), ("interfoam", "interFoam, wedge", "--")):
            row = sides[side]
            if row is not None and "time" in row:
                panel.plot(row["time"], row["spread"], line, label=label)
        if between := of_measured(*IMPACTS[name][1:3], np.radians(ANGLES[0])):
            panel.axhspan(*between, color="grey", alpha=0.25, linewidth=0.0, label="correlations of measured drops")
        panel.set(title=name, xlabel="time (D / U)")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("largest width over D")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    figure.savefig(results.path_of(NAME).with_suffix(".png"), dpi=100)


def run_impact(impact_scene: Impact) -> dict:
    """Run one impact with both codes.

    Args:
        impact_scene: Liquid, Weber and Reynolds number, duration and resolution.

    Returns:
        ``delta_sph`` and ``interfoam``, the figures of ``summarise_width`` with number of particles or cells; None for
        interFoam if it is not installed.
    """
    scene = make_impact_scene(impact_scene, ANGLES[0])
    return {"delta_sph": impact_by_particles(scene), "interfoam": impact_by_interfoam(scene, CELLS)}


def make_impact_scene(impact_scene: Impact, advancing: float) -> Droplet:
    """Return the parameters of an impact for this program.

    Args:
        impact_scene: Liquid, Weber and Reynolds number, duration and resolution.
        advancing: Advancing contact angle [degrees].
    """
    numerics = DropletNumerics(particles_per_diameter=impact_scene.across)
    angles = {"contact_angle": np.radians(ANGLES[0]), "advancing_angle": np.radians(advancing)}
    scene = Droplet(
        weber=impact_scene.weber, reynolds=impact_scene.reynolds, **angles, **impact_scene.liquid, numerics=numerics
    )
    return scene.model_copy(update={"duration": impact_scene.units * scene.unit_of_time})


def impact_by_particles(scene: Droplet) -> dict:
    """Compute an impact with this program.

    Returns:
        Number of ``particles`` and the figures of ``summarise_width``; ``seconds`` and the message ``broke`` if the
        surface was lost.
    """
    start = process_time()
    try:
        history = solve_droplet(scene).history
    except SurfaceLost as error:
        return {"particles": scene.particles, "seconds": process_time() - start, "broke": str(error)}
    time, spread = history["time"] / scene.unit_of_time, history["spread"]
    return {"particles": scene.particles} | summarise_width(time, spread, process_time() - start)


def summarise_width(time: np.ndarray, spread: np.ndarray, seconds: float) -> dict:
    """Return the figures of a width over time.

    Args:
        time: Times, shape (n,) [D / U].
        spread: Width over the diameter D, shape (n,).
        seconds: Processor time of the run [s].

    Returns:
        Largest width ``spread_max`` and its time ``after``, ``seconds``, and lists ``time`` and ``spread``, rounded.
    """
    widest = int(np.argmax(spread))
    figures = {"time": np.round(time, 4).tolist(), "spread": np.round(spread, 4).tolist()}
    return {"spread_max": float(spread[widest]), "after": float(time[widest]), "seconds": seconds} | figures


def impact_by_interfoam(scene: Droplet, cells: int) -> dict | None:
    """Compute an impact with interFoam; return None if it is not installed.

    Args:
        scene: Parameters of the impact.
        cells: Number of cells across the diameter.

    Returns:
        ``version``, number of ``cells``, and the figures of ``summarise_width``.
    """
    if shutil.which("interFoam") is None:
        print("interFoam is not installed (Debian package openfoam): skipping it")
        return None
    cell, units = scene.diameter / cells, scene.until / scene.unit_of_time
    wedge = Wedge(cell, columns=int((0.8 + 0.45 * units) * cells), rows=int(1.3 * cells))
    parameters = {
        "contactAngle": np.degrees(scene.advancing),
        "onWall": "noSlip",
        "solderViscosity": scene.liquid_viscosity / scene.density,
        "solderDensity": scene.density,
        "surfaceTension": scene.surface_tension,
        "endTime": scene.duration,
        "writeInterval": scene.duration / SAMPLES,
        "firstStep": 1e-4 * scene.unit_of_time / cells,
        "largestStep": capillary_limit(scene.density, cell, scene.surface_tension),
    }
    start = (
        f"sphereToCell {{ centre (0 0 {0.5 * scene.diameter}); radius {0.5 * scene.diameter};\n"
        f"fieldValues ( volScalarFieldValue alpha.solder 1 volVectorFieldValue U (0 0 {-scene.impact_speed}) ); }}"
    )
    with tempfile.TemporaryDirectory() as name:
        log = interfoam.run_case(Path(name), wedge, parameters, start)
        states = list(interfoam.read_states(Path(name), log, wedge))
    time = np.array([state.time for state in states]) / scene.unit_of_time
    spread = np.array([2.0 * measure_reach(state.alpha, wedge) for state in states]) / scene.diameter
    return {"version": interfoam.read_version(log), "cells": wedge.rows * wedge.columns} | summarise_width(
        time, spread, states[-1].seconds
    )


def measure_reach(alpha: np.ndarray, wedge: Wedge) -> float:
    """Return the largest radius of half-full cells, interpolated linearly between cells [m].

    Args:
        alpha: Volume fractions of the liquid, shape (rows, columns).
        wedge: Mesh of cells.
    """
    middles, largest = 0.5 * (wedge.edges[1:] + wedge.edges[:-1]), 0.0
    for fractions in alpha:
        full = np.flatnonzero(fractions >= 0.5)
        if len(full) and full[-1] + 1 < len(fractions):
            last = full[-1]
            inner, outer = fractions[last], fractions[last + 1]
            share = (inner - 0.5) / (inner - outer)
            largest = max(largest, float(middles[last] + share * (middles[last + 1] - middles[last])))
    return largest


def run_widths() -> dict:
    """Compute and draw the maximum widths of the fastest impacts; return name -> result of ``compare_widths``."""
    largest_widths = {name: compare_widths(IMPACTS[name]) for name in FAST}
    draw_widths(largest_widths)
    return largest_widths


def compare_widths(impact_scene: Impact) -> dict:
    """Return the maximum widths of one impact by both codes and by correlations.

    Args:
        impact_scene: Liquid, Weber and Reynolds number, duration and resolution.

    Returns:
        Name of a correlation without angle -> width over diameter, and "A degrees" for each advancing angle A ->
        figures of ``delta_sph``, of ``interfoam`` by number of cells, and widths by the other correlations.
    """
    numbers, static = impact_scene[1:3], ANGLES[0]
    largest_widths: dict = {correlation.__name__: correlation(*numbers) for correlation in (roisman, laan)}
    for angle in ANGLES:
        scene, fineness = make_impact_scene(impact_scene, angle), FINENESS if angle == static else (CELLS,)
        largest_widths[f"{angle:.0f} degrees"] = {
            "delta_sph": impact_by_particles(scene),
            "interfoam": {cells: impact_by_interfoam(scene, cells) for cells in fineness},
        } | {
            correlation.__name__: correlation(*numbers, np.radians(angle))
            for correlation in (pasandideh_fard, wildeman)
        }
    return largest_widths


def draw_widths(largest_widths: dict) -> None:
    """Plot the widths of each impact (name -> result of ``compare_widths``) over the contact angle to a PNG file."""
    figure, panels = plt.subplots(
        1, len(largest_widths), figsize=(4.0 * len(largest_widths), 3.4), layout="constrained"
    )
    degrees = np.linspace(ANGLES[0], 180.0, 46)
    for panel, (name, sides) in zip(panels, largest_widths.items(), strict=True):
        numbers = IMPACTS[name][1:3]
        for correlation, label in ((pasandideh_fard, "measured: Pasandideh-Fard"), (wildeman, "computed: Wildeman")):
            panel.plot(degrees, [correlation(*numbers, np.radians(angle)) for angle in degrees], label=label)
        for correlation, line in ((roisman, ":"), (laan, "-.")):
            panel.axhline(
                correlation(*numbers), color="C0", linestyle=line, label=f"measured: {correlation.__name__.title()}"
            )
        for angle in ANGLES:
            row, first = sides[f"{angle:.0f} degrees"], angle == ANGLES[0]
            panel.plot(angle, row["delta_sph"]["spread_max"], "C3o", label="delta-SPH" if first else None)
            if (finest := list(row["interfoam"].values())[-1]) is not None:
                panel.plot(angle, finest["spread_max"], "kx", label="interFoam, finest" if first else None)
        panel.set(title=name, xlabel="advancing contact angle (degrees)")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("largest width over D")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    figure.savefig(results.path_of("droplet_widths").with_suffix(".png"), dpi=100)


def run_dam_breaks() -> dict:
    """Compute the dam break by both codes for each resolution.

    Returns:
        Number of particles over the height, as text -> ``delta_sph`` and, if it can be installed, ``pysph``: particles,
        steps, processor seconds, particle-steps per second and errors of the front.
    """
    there = install()
    return {
        str(count): {"delta_sph": run_dam_break(count)} | ({"pysph": run_pysph_dam_break(count)} if there else {})
        for count in IN_HEIGHT
    }


def run_dam_break(count: int) -> dict:
    """Compute the dam break by this program with ``count`` particles over the height of the column.

    Returns:
        ``particles``, ``steps``, ``seconds`` (processor time), ``particle_steps_per_second`` and ``front_error``, a
        list.
    """
    scene = DamBreak(
        height=HEIGHT, width=WIDTH, tank_length=TANK, sensor_height=0.4, duration=FOLLOWED, density=1000.0,
        viscosity=1e-3, numerics=SphNumerics(particles_across=count),
    )  # fmt: skip
    start = process_time()
    result = solve_dam_break(scene)
    seconds, steps = process_time() - start, int(result.metrics["steps"][0])
    front = front_errors(result.history["time"], result.history["front"] + 0.5 * scene.spacing)
    spent = {"particles": scene.particles, "steps": steps, "seconds": seconds}
    return spent | steps_per_second(scene.particles, steps, seconds) | front


def run_pysph_dam_break(count: int) -> dict:
    """Compute the dam break by PySPH with ``count`` particles over the height, half a spacing from the wall.

    Returns:
        ``particles``, ``steps``, ``seconds``, ``particle_steps_per_second`` and ``front_error``, a list.
    """
    spacing = HEIGHT / count
    with tempfile.TemporaryDirectory() as name:
        command = [str(PYTHON), str(Path(__file__).parent / "support" / "peer_pysph.py")]
        done = subprocess.run(
            [*command, str(spacing), str(FOLLOWED), name], capture_output=True, text=True, check=True,
            env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        )  # fmt: skip
    figures = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("@"))[1:])
    position = np.array(figures.pop("front"))
    front = front_errors(np.array(figures.pop("time")), position + WIDTH - position[0])
    return figures | steps_per_second(figures["particles"], figures["steps"], figures["seconds"]) | front


def front_errors(time: np.ndarray, front: np.ndarray) -> dict:
    """Compare the front of a dam break with measured positions.

    Args:
        time: Times, shape (n,) [s].
        front: Position of the front from the wall behind the column, shape (n,) [m].

    Returns:
        ``front_error``, list of the relative error at each measured time.
    """
    measured_positions = np.interp([at for at, _ in MEASURED], time * sqrt(2.0 * 9.81 / WIDTH), front / WIDTH)
    return {
        "front_error": [
            float(position / measured - 1.0)
            for position, (_, measured) in zip(measured_positions, MEASURED, strict=True)
        ]
    }


def steps_per_second(particles: int, steps: int, seconds: float) -> dict:
    """Return ``particle_steps_per_second`` of one core: number of liquid particles times steps over seconds."""
    return {"particle_steps_per_second": particles * steps / seconds}


def install() -> bool:
    """Install PySPH in its own environment; return whether it is available."""
    if not PYTHON.exists():
        venv.create(PYTHON.parents[1], with_pip=True)
    command = [
        str(PYTHON),
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "pysph==1.0b2",
        "setuptools",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"PySPH is left out, pip cannot install it: {done.stderr.strip().splitlines()[-1]}")
    return done.returncode == 0


if __name__ == "__main__":
    write_tables(
        __doc__.splitlines()[0], {"impact": run_impacts, "widths": run_widths, "dam_break": run_dam_breaks}, NAME
    )
