"""Waves through tie and interface of coupled models: reflection, error against exact waves and order."""

from pathlib import Path

import numpy as np
import pytest

from reflowshock.fem.loads.pulse import Haversine
from reflowshock.fem.output.compare import relative_error
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import LIBRARY
from reflowshock.workflow.structure.exact_layers import Layers
from tests.support.fem_bars import PEAK, bar_layers, run_bar, speed_of, write_bar

SCHEMES = ("held_velocity", "gravouil_combescure", "local_steps")
SPEED = speed_of("FR4")
PULSE = 20e-3 / SPEED  # as long as 20 macro elements
END, SECTION = 30e-3, 3e-3
HEIGHTS = {"near": 18e-3, "beyond": END + SECTION + 10e-3}
REFLECTED = 0.005  # of the incident velocity
GRADED = 0.006  # limit where the element length changes along the bar: 0.004 at any step


def bar(cells: int, finer: int = 1) -> dict[str, dict]:
    """Return an FR4 bar with a section of 5 x 5 in-plane elements, all element counts multiplied by ``finer``."""
    end = ("FR4", END, 30 * finer, (2 * finer, 2 * finer))
    return bar_layers(end, ("FR4", SECTION, cells * finer, (5 * finer, 5 * finer)), end)


def run(directory: Path, layers: dict, coupling: dict | None = None, **numerics) -> tuple[dict, dict]:
    """Run a bar until the pulse has returned from its middle."""
    numerics = {"history_samples": 200, "field_samples": 2} | numerics
    dynamics = {"duration": (2 * END - HEIGHTS["near"]) / SPEED + 1.05 * PULSE, "numerics": numerics}
    dynamics |= {"coupling": coupling} if coupling else {}
    watch = {name: {"at": [0, 0, z]} for name, z in HEIGHTS.items()}
    return run_bar(write_bar(directory, 2e-3, layers, PULSE, watch=watch, dynamics=dynamics))


@pytest.mark.parametrize(("cells", "limit"), [(3, REFLECTED), (6, GRADED)], ids=["as long", "half as long"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_reflection_at_the_interface_is_small(scheme, cells, limit, tmp_path):
    """The bar has one material, so the difference from a coarse-mesh bar at the same step is the reflection.

    The section has 5 x 5 in-plane elements between layers of 2 x 2, with equal or half the length along the bar.
    """
    result, history = run(tmp_path / "two", bar(cells), {"scheme": scheme, "fine": ["layer_1"]})
    assert result["coupling"]["scheme"] == scheme
    even = bar_layers(("FR4", END, 30, (2, 2)), ("FR4", SECTION, 3, (2, 2)), ("FR4", END, 30, (2, 2)))
    _, reference = run(tmp_path / "even", even, explicit_step=result["model"]["window"] * (1.0 + 1e-9))
    assert len(history["time"]) == len(reference["time"])
    difference = history["velocity@near"] - reference["velocity@near"]
    assert np.abs(difference).max() < limit * np.abs(reference["velocity@near"]).max()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_second_order_against_exact_waves(scheme, tmp_path):
    """Elements and all steps are halved together."""
    material = LIBRARY["FR4"]
    stiffness = float(elasticity_matrix(material)[2, 2])
    exact = Layers((END, SECTION, END), (stiffness,) * 3, (material.density,) * 3)
    errors = []
    for finer in (1, 2):
        # Samples consist of whole windows: first one window per sample, then two.
        coupling = {"scheme": scheme, "fine": ["layer_1"]}
        _, history = run(tmp_path / f"{finer}", bar(6, finer), coupling, history_samples=117)
        values = [history[f"velocity@{name}"][:, 2] for name in HEIGHTS]
        waves = [exact.velocity(z, history["time"], Haversine(PEAK, PULSE).value) for z in HEIGHTS.values()]
        errors.append(relative_error(np.array(values), np.array(waves)))
    assert errors[0] < 0.03
    assert np.log2(errors[0] / errors[1]) > 1.8
