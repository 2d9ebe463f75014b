"""The same sessile drop by OpenFOAM's interFoam (volume of fluid) and by this program: time to rest and errors.

Run: .venv/bin/python benchmarks/interfoam_drop.py   (four minutes; writes results/interfoam_drop.json)
Without interFoam (Debian package openfoam) it says so and measures nothing. 1 mm^3, 60 degrees, slip wall, no gravity,
the values that Hu et al. print. interFoam starts from a cylinder as high as the cube and solves a wedge of a body of
revolution: one layer of cells against particles in three dimensions, which is to its advantage; its lengths are
compared at the volume that its cells hold. It does not stop swinging: its lengths are means over the last third of the
run, and it is at rest from when on both stay within 2 % of them. Where it is never, the ratio is a lower bound.
Seconds are those of the processor, one core each.
"""

import json
import os
import platform
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from reflowshock.particles.parameters.scenes import Drop
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.reference.young_laplace import Meridian, sessile_meridian
from reflowshock.particles.scenes.drop_at_rest import flow_to_rest
from reflowshock.particles.steps.time_step import capillary_limit

CASE, RESULTS = Path(__file__).parent / "interfoam", Path(__file__).parent / "results" / "interfoam_drop.json"
VOLUME, ANGLE = 1e-9, 60.0
PAPER = {"density": 8930.0, "surface_tension": 4.985, "viscosity": 0.227}
CELL, COLUMNS, ROWS = 5e-5, 32, 40
HALF_WEDGE = np.radians(2.5)
# Width of a cell along the radius of the circle whose sector has the area of the flat wedge.
RADIAL = CELL * np.sqrt(np.sin(2.0 * HALF_WEDGE) / (2.0 * HALF_WEDGE))
START_COLUMNS, START_ROWS = 11, 21
END_TIME, SAMPLES = 0.02, 80
CAPILLARY_SHARE = 1.0
STILL = 0.02
PER_EDGE = 11
NUMBERS = re.compile(r"List<scalar>\s*\d+\s*\((.*?)\)\s*;", re.DOTALL)
VECTORS = re.compile(r"List<vector>\s*\d+\s*\((.*?)\)\s*;", re.DOTALL)
CLOCK = re.compile(r"^Time = (\S+)$.*?^ExecutionTime = (\S+) s", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Sample:
    """The drop at one time: time and run time [s], height and width [m], volume [m^3], capillary number."""

    time: float
    seconds: float
    height: float
    width: float
    volume: float
    capillary_number: float


def parameters(solder: Solder) -> str:
    """The dictionary that the OpenFOAM case includes."""
    values = {
        "across": COLUMNS * CELL * np.cos(HALF_WEDGE),
        "aside": COLUMNS * CELL * np.sin(HALF_WEDGE),
        "back": -COLUMNS * CELL * np.sin(HALF_WEDGE),
        "height": ROWS * CELL,
        "columns": COLUMNS,
        "rows": ROWS,
        "startHeight": START_ROWS * CELL,
        "startRadius": START_COLUMNS * CELL,
        "contactAngle": ANGLE,
        "solderViscosity": solder.viscosity / solder.density,
        "solderDensity": solder.density,
        "surfaceTension": solder.surface_tension,
        "endTime": END_TIME,
        "writeInterval": END_TIME / SAMPLES,
        "largestStep": CAPILLARY_SHARE * capillary_limit(solder.density, CELL, solder.surface_tension),
    }
    return "\n".join(f"{name} {value:.12g};" for name, value in values.items()) + "\n"


def openfoam(command: str, folder: Path) -> str:
    """Run a command of OpenFOAM in a folder and return its log; its settings lie in the share folder beside it."""
    installed = Path(shutil.which(command)).parent.parent / "share" / "openfoam"
    surroundings = {"WM_PROJECT_DIR": str(installed)} | dict(os.environ)
    return subprocess.run([command], cwd=folder, env=surroundings, check=True, capture_output=True, text=True).stdout


def run_interfoam(folder: Path, solder: Solder) -> str:
    """Mesh, start and run the case in a folder; return the log of interFoam."""
    shutil.copytree(CASE, folder, dirs_exist_ok=True)
    shutil.copytree(folder / "0.orig", folder / "0")
    (folder / "parameters").write_text(parameters(solder))
    for command in ("blockMesh", "setFields"):
        openfoam(command, folder)
    return openfoam("interFoam", folder)


def samples(folder: Path, log: str, solder: Solder) -> list[Sample]:
    """The drop at each time that was written."""
    clock = {float(time): float(seconds) for time, seconds in CLOCK.findall(log)}
    times = np.array(sorted(clock))
    found = []
    for path in sorted((path for path in folder.iterdir() if is_time(path.name)), key=lambda path: float(path.name)):
        time = float(path.name)
        seconds = clock[times[np.abs(times - time).argmin()]]
        alpha = np.fromstring(NUMBERS.search((path / "alpha.solder").read_text())[1], sep=" ").reshape(ROWS, COLUMNS)
        words = VECTORS.search((path / "U").read_text())[1].replace("(", " ").replace(")", " ")
        speed = np.linalg.norm(np.fromstring(words, sep=" ").reshape(-1, 3), axis=1).reshape(ROWS, COLUMNS)
        fastest = float(speed[alpha > 0.9].max())
        number = solder.viscosity * fastest / solder.surface_tension
        found.append(Sample(time, seconds, *extent(alpha), number))
    return found


def is_time(name: str) -> bool:
    """Whether a folder is that of a written time after the start."""
    return re.fullmatch(r"[0-9.e-]+", name) is not None and float(name) > 0.0


def extent(alpha: np.ndarray) -> tuple[float, float, float]:
    """Height along the axis and width at the wall [m] from the volume fractions `(rows, columns)`; volume [m^3].

    The radius of a row of cells is that of the disc with its volume; at the wall the two lowest rows are extrapolated.
    """
    edges = RADIAL * np.arange(COLUMNS + 1)
    radius = np.sqrt((alpha * np.diff(edges**2)).sum(axis=1))
    volume = np.pi * CELL * float((radius**2).sum())
    return CELL * float(alpha[:, 0].sum()), 2.0 * float(1.5 * radius[0] - 0.5 * radius[1]), volume


def settled(found: list[Sample]) -> tuple[Sample | None, list[Sample]]:
    """The first sample from which on height and width stay near their means over the last third, and that third."""
    third = found[-len(found) // 3 :]
    means = {name: np.mean([getattr(sample, name) for sample in third]) for name in ("height", "width")}
    moving = [
        number
        for number, sample in enumerate(found)
        if any(abs(getattr(sample, name) / mean - 1.0) > STILL for name, mean in means.items())
    ]
    first = moving[-1] + 1 if moving else 0
    return (found[first] if first < len(found) - len(third) else None), third


def by_interfoam(solder: Solder, exact: Meridian) -> dict:
    """Time to rest and errors of interFoam."""
    with tempfile.TemporaryDirectory() as name:
        log = run_interfoam(Path(name), solder)
        found = samples(Path(name), log, solder)
    rest, third = settled(found)
    volume, height, width, number = np.mean(
        [(sample.volume, sample.height, sample.width, sample.capillary_number) for sample in third], axis=0
    )
    scale = np.cbrt(VOLUME / volume)
    return {
        "version": re.search(r"^Build\s*:\s*(.+)$", log, re.MULTILINE)[1],
        "cells": ROWS * COLUMNS,
        "seconds": found[-1].seconds,
        "physical_time_to_rest": rest and rest.time,
        "seconds_to_rest": rest and rest.seconds,
        "height_swing": float(np.ptp([sample.height for sample in third]) / height / 2.0),
        "volume_error": volume / VOLUME - 1.0,
    } | errors(scale * height, scale * width, exact, number)


def by_particles(exact: Meridian) -> dict:
    """Time to rest and errors of this program, which leaves inertia out where only the rest is asked for."""
    solder = molten(SolderNumerics(time_step_limit=100.0))
    coarse, drop = (
        Drop(volume=VOLUME, contact_angle=solder.pad_contact_angle, particles_per_edge=count) for count in (5, PER_EDGE)
    )
    flow_to_rest(coarse, solder)
    start = process_time()
    flow, run = flow_to_rest(drop, solder)
    profile = run.profiles[-1]
    number = solder.viscosity * run.records[-1].speed / solder.surface_tension
    return {
        "particles": len(flow.body.points),
        "steps": len(run.records),
        "seconds_to_rest": process_time() - start,
    } | errors(profile.drop_height(walls=1), profile.max_width, exact, number)


def errors(height: float, width: float, exact: Meridian, capillary_number: float) -> dict:
    """Signed relative errors, and the capillary number that is left."""
    return {
        "height_error": height / exact.height - 1.0,
        "width_error": width / exact.max_width - 1.0,
        "capillary_number": capillary_number,
    }


def molten(numerics: SolderNumerics | None = None) -> Solder:
    """The solder that both solve."""
    return Solder(
        volume=VOLUME,
        pad_contact_angle=np.radians(ANGLE),
        effects=SolderEffects(gravity="off"),
        numerics=numerics or SolderNumerics(),
        **PAPER,
    )


def main() -> None:
    """Measure both, one after the other, and write the ratio."""
    if shutil.which("interFoam") is None:
        print("interFoam is not installed (Debian package openfoam): nothing to compare with")
        return
    solder = molten()
    exact = sessile_meridian(VOLUME, solder.pad_contact_angle, solder.surface_tension)
    foam, particles = by_interfoam(solder, exact), by_particles(exact)
    spent = foam["seconds_to_rest"] or foam["seconds"]
    found = {
        "machine": platform.machine(),
        "interfoam": foam,
        "particles": particles,
        "interfoam_came_to_rest": foam["seconds_to_rest"] is not None,
        "interfoam_over_particles": spent / particles["seconds_to_rest"],
    }
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(found, indent=1) + "\n")
    print(RESULTS.read_text())


if __name__ == "__main__":
    main()
