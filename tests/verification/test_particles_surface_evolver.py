"""Drops on pads and an offset joint against stored numbers of Surface Evolver (an independent energy minimiser)."""

import json
from pathlib import Path

import numpy as np
import pytest

from reflowshock.particles.parameters.scenes import Drop, Fluid, Joint
from reflowshock.particles.scenes.drop_at_rest import drop_to_rest
from reflowshock.particles.scenes.reflow import solve_joint

REFERENCE = json.loads((Path(__file__).parent / "references" / "surface_evolver.json").read_text())
MM, GAMMA = 1e-3, 0.4985


SMALLEST, *BETWEEN, LARGEST = REFERENCE["drops"]


@pytest.mark.parametrize(
    "evolver",
    [SMALLEST, *(pytest.param(row, marks=pytest.mark.long) for row in (*BETWEEN, LARGEST))],
    ids=lambda row: f"{row['volume']}",
)
def test_five_volumes_on_a_pad(evolver):
    """Hu et al. 4.2: pad 5 degrees, mask 148 degrees, pinned at the pad edge; 343 particles."""
    drop = Drop(
        volume=evolver["volume"] * MM**3, contact_angle=np.radians(5), pad_radius=0.2 * MM, particles_per_edge=7
    )
    solder = Fluid(numerics={"time_step_limit": 100.0}).resolve(drop, "off")
    shape = drop_to_rest(drop, solder).shape
    assert shape.metrics["height"][0] == pytest.approx(evolver["height"] * MM, rel=0.01)
    assert shape.metrics["max_width"][0] == pytest.approx(evolver["max_width"] * MM, rel=0.01)
    assert abs(shape.metrics["contact_angle_error"][0]) <= 2.0


def test_an_offset_joint():
    """Free surface area and pressure of a joint without axial symmetry."""
    evolver = REFERENCE["offset_joint"]
    joint = Joint(
        volume=evolver["volume"] * MM**3, pad_bottom=0.24 * MM, pad_top=0.24 * MM, standoff=0.35 * MM, offset=0.07 * MM
    )
    shape = solve_joint(joint.geometry, Fluid().resolve(joint, "off"))
    assert shape.verdict == "ok"
    assert shape.history["energy"][-1] / GAMMA == pytest.approx(evolver["area"] * MM**2, rel=2e-3)
    assert shape.metrics["mean_pressure"][0] / GAMMA == pytest.approx(evolver["pressure"] / MM, rel=0.01)
