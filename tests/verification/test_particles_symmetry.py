"""Half and quarter models of a drop against the full drop at rest."""

from functools import cache

import numpy as np
import pytest

from reflowshock.particles.parameters.scenes import Drop, Fluid
from reflowshock.particles.scenes.drop_at_rest import drop_to_rest

SCENES = {
    "uniform wall": ({"volume": 1e-9, "contact_angle": np.radians(120.0), "particles_per_edge": 7}, "off"),
    "pad": (
        {"volume": 0.1218e-9, "contact_angle": np.radians(5.0), "pad_radius": 0.2e-3, "particles_per_edge": 7},
        "on",
    ),
}


@cache
def metrics(name, symmetry):
    """Return the metrics of a drop at rest, computed in full, half or quarter."""
    scene, gravity = SCENES[name]
    drop = Drop(symmetry=symmetry, **scene)
    shape = drop_to_rest(drop, Fluid().resolve(drop, gravity)).shape
    assert shape.verdict == "ok"
    assert len(shape.points) == drop.particles
    return {name: value for name, (value, _) in shape.metrics.items()}


@pytest.mark.parametrize(
    ("scene", "symmetry"),
    [
        ("uniform wall", "quarter"),
        pytest.param("uniform wall", "half", marks=pytest.mark.long),
        pytest.param("pad", "quarter", marks=pytest.mark.long),
    ],
)
def test_a_part_of_a_drop_is_the_whole(scene, symmetry):
    whole, part = metrics(scene, "none"), metrics(scene, symmetry)
    assert part["particles"] < {"half": 0.6, "quarter": 0.35}[symmetry] * whole["particles"]
    for name in ("volume", "max_width", "contact_radius", "mean_pressure"):
        assert part[name] == pytest.approx(whole[name], rel=1e-3), name
    assert part["contact_angle"] == pytest.approx(whole["contact_angle"], abs=0.2)
    # The axis vertex of a quarter has 8 triangles and is 0.6 % above a smooth apex.
    assert part["height"] == pytest.approx(whole["height"], rel={"half": 5e-4, "quarter": 8e-3}[symmetry])
    assert abs(part["volume_drift"]) < 1e-6
