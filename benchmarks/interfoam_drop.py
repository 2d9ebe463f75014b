"""Sessile drop by OpenFOAM's interFoam (volume of fluid) and by this program: time to rest and errors.

Run: PYTHONPATH=. .venv/bin/python benchmarks/interfoam_drop.py   (four minutes; writes results/interfoam_drop.json) The
benchmark is skipped without interFoam (Debian package openfoam). The drop has 1 mm^3, a contact angle of 60 degrees, a
slip wall, no gravity, and the parameters of Hu et al. interFoam starts from a cylinder of the height of the cube and
solves an axisymmetric wedge; one layer of cells against three-dimensional particles is in its favour. Its lengths are
scaled to the exact volume and averaged over the last third of the run, since it keeps swinging; it counts as at rest
once both lengths stay within 2 % of these means. If it never is, the ratio is a lower bound. Times are processor
seconds of one core.
"""

import json
import shutil
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.support import interfoam, results
from benchmarks.support.interfoam import State, Wedge
from reflowshock.particles.parameters.scenes import Drop
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.reference.young_laplace import Meridian, sessile_meridian
from reflowshock.particles.scenes.drop_at_rest import flow_to_rest
from reflowshock.particles.steps.time_step import capillary_limit

NAME = "interfoam_drop"
VOLUME, ANGLE = 1e-9, 60.0
PAPER = {"density": 8930.0, "surface_tension": 4.985, "viscosity": 0.227}
WEDGE = Wedge(cell=5e-5, columns=32, rows=40)
START = f"""cylinderToCell {{ p1 (0 0 -1); p2 (0 0 {21 * WEDGE.cell}); radius {11 * WEDGE.cell};
fieldValues ( volScalarFieldValue alpha.solder 1 ); }}"""
END_TIME, SAMPLES = 0.02, 80
CAPILLARY_SHARE = 1.0
STILL = 0.02
PER_EDGE = 11


@dataclass(frozen=True, slots=True)
class Sample:
    """State of the drop at one time: time and run time [s], height and width [m], volume [m^3], capillary number."""

    time: float
    seconds: float
    height: float
    width: float
    volume: float
    capillary_number: float


def case_parameters(solder: Solder) -> dict[str, float | str]:
    """Return the parameters of OpenFOAM's case, name -> word or number in SI units (contact angle in degrees)."""
    return {
        "contactAngle": ANGLE,
        "onWall": "slip",
        "solderViscosity": solder.viscosity / solder.density,
        "solderDensity": solder.density,
        "surfaceTension": solder.surface_tension,
        "endTime": END_TIME,
        "writeInterval": END_TIME / SAMPLES,
        "firstStep": 1e-8,
        "largestStep": CAPILLARY_SHARE * capillary_limit(solder.density, WEDGE.cell, solder.surface_tension),
    }


def measure_samples(states: Iterable[State], solder: Solder) -> list[Sample]:
    """Measure height, width, volume and capillary number of the drop at each written time.

    Args:
        states: Fields that interFoam wrote, in order.
        solder: Viscosity and surface tension.
    """
    drop_samples = []
    for state in states:
        fastest = float(state.speed[state.alpha > 0.9].max())
        number = solder.viscosity * fastest / solder.surface_tension
        drop_samples.append(Sample(state.time, state.seconds, *measure_extent(state.alpha), number))
    return drop_samples


def measure_extent(alpha: np.ndarray) -> tuple[float, float, float]:
    """Return height [m], width at the wall [m] and volume [m^3] of a drop in a wedge of cells.

    The width at the wall is extrapolated from the radii of the two lowest rows.

    Args:
        alpha: Volume fraction of the liquid in each cell, shape (rows, columns).
    """
    radius = WEDGE.radii(alpha)
    volume = np.pi * WEDGE.cell * float((radius**2).sum())
    return WEDGE.cell * float(alpha[:, 0].sum()), 2.0 * float(1.5 * radius[0] - 0.5 * radius[1]), volume


def find_rest(drop_samples: list[Sample]) -> tuple[Sample | None, list[Sample]]:
    """Find the sample from which on height and width stay near their means over the last third of the samples.

    Args:
        drop_samples: Samples in order of time: height, width and others.

    Returns:
        That sample, None if the drop does not come to rest, and the last third of the samples.
    """
    third = drop_samples[-len(drop_samples) // 3 :]
    means = {name: np.mean([getattr(sample, name) for sample in third]) for name in ("height", "width")}
    moving = [
        number
        for number, sample in enumerate(drop_samples)
        if any(abs(getattr(sample, name) / mean - 1.0) > STILL for name, mean in means.items())
    ]
    first = moving[-1] + 1 if moving else 0
    return (drop_samples[first] if first < len(drop_samples) - len(third) else None), third


def run_interfoam(solder: Solder, exact: Meridian) -> dict:
    """Compute the drop by interFoam.

    Args:
        solder: Fluid and contact angle.
        exact: Exact meridian of the drop.

    Returns:
        ``version``, ``cells``, ``seconds``, ``physical_time_to_rest`` [s] and ``seconds_to_rest`` (None without rest),
        ``height_swing``, ``volume_error``, and the figures of ``relative_errors``.
    """
    with tempfile.TemporaryDirectory() as name:
        log = interfoam.run_case(Path(name), WEDGE, case_parameters(solder), START)
        drop_samples = measure_samples(interfoam.read_states(Path(name), log, WEDGE), solder)
    rest, third = find_rest(drop_samples)
    volume, height, width, number = np.mean(
        [(sample.volume, sample.height, sample.width, sample.capillary_number) for sample in third], axis=0
    )
    scale = np.cbrt(VOLUME / volume)
    return {
        "version": interfoam.read_version(log),
        "cells": WEDGE.rows * WEDGE.columns,
        "seconds": drop_samples[-1].seconds,
        "physical_time_to_rest": rest and rest.time,
        "seconds_to_rest": rest and rest.seconds,
        "height_swing": float(np.ptp([sample.height for sample in third]) / height / 2.0),
        "volume_error": volume / VOLUME - 1.0,
    } | relative_errors(scale * height, scale * width, exact, number)


def run_particles(exact: Meridian) -> dict:
    """Compute the drop by this program without inertia.

    Args:
        exact: Exact meridian of the drop.

    Returns:
        ``particles``, ``steps``, ``seconds_to_rest`` (processor time), and the figures of ``relative_errors``.
    """
    solder = molten_solder(SolderNumerics(time_step_limit=100.0))
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
    } | relative_errors(profile.drop_height(walls=1), profile.max_width, exact, number)


def relative_errors(height: float, width: float, exact: Meridian, capillary_number: float) -> dict:
    """Return signed relative errors of a drop, and the capillary number of its remaining motion.

    Args:
        height: Height [m].
        width: Largest width [m].
        exact: Exact meridian.
        capillary_number: Viscosity times speed over surface tension.

    Returns:
        ``height_error``, ``width_error`` and ``capillary_number``.
    """
    return {
        "height_error": height / exact.height - 1.0,
        "width_error": width / exact.max_width - 1.0,
        "capillary_number": capillary_number,
    }


def molten_solder(numerics: SolderNumerics | None = None) -> Solder:
    """Return the solder of both codes: volume, fluid and contact angle; default numerics if ``numerics`` is None."""
    return Solder(
        volume=VOLUME,
        pad_contact_angle=np.radians(ANGLE),
        effects=SolderEffects(gravity="off"),
        numerics=numerics or SolderNumerics(),
        **PAPER,
    )


def main() -> None:
    """Run both codes and store the ratio of their times."""
    if shutil.which("interFoam") is None:
        print("interFoam is not installed (Debian package openfoam): skipping the benchmark")
        return
    solder = molten_solder()
    exact = sessile_meridian(VOLUME, solder.pad_contact_angle, solder.surface_tension)
    foam, particles = run_interfoam(solder, exact), run_particles(exact)
    spent = foam["seconds_to_rest"] or foam["seconds"]
    figures = {
        "interfoam": foam,
        "particles": particles,
        "interfoam_came_to_rest": foam["seconds_to_rest"] is not None,
        "interfoam_over_particles": spent / particles["seconds_to_rest"],
    }
    results.write_figures(NAME, figures)
    print(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
