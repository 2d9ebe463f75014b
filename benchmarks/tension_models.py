"""Four models of surface tension in one delta-SPH code: error against cost at rest, on a wall, swinging and merging.

    PYTHONPATH=. .venv/bin/python benchmarks/tension_models.py         (all; results/tension_models.json and .png)
    PYTHONPATH=. .venv/bin/python benchmarks/tension_models.py swing   (one of them)

The models are a colour function with corrected normals, pairwise forces, a pressure on the free surface (``tension/``),
and the program's own tracked surface. Particles, equation of state, viscosity, walls and steps are the same; parameters
are the published ones. The strength of the pairwise forces is calibrated on the pressure of a sphere, as their authors
do (``strength``: relative to theory). Shapes are measured by the same level of a smoothed colour function for all
models. ``cost`` takes turns between the models; run times are seconds of one core. Ten minutes.
"""

import json
import os
from functools import cache, partial

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.ticker import NullFormatter

from benchmarks.support import results
from benchmarks.support.tables import write_tables
from benchmarks.support.turns import make_batch, measure_in_turns
from benchmarks.tension.scenes import (
    MODELS,
    TRACKED,
    run_cap_to_rest,
    run_merging,
    run_swing,
    run_to_rest,
    set_up_drop,
    unit_drop,
)

mpl.use("Agg")
NAME = "tension_models"
# Particles per diameter of the scenes, and of the sphere for calibration and cost.
SIZES, SMALLER, SPHERE = (10, 14), (8, 10), 14
# Axis ticks of core-seconds.
TICKS = (2, 5, 10, 20)
# Plotted quantity of each scene: metric, exact value, title.
DRAWN = {
    "rest": ("pressure_error", 0.0, "pressure at rest"),
    "cap_60": ("height_error", 0.0, "height of the cap, 60 degrees"),
    "cap_120": ("height_error", 0.0, "height of the cap, 120 degrees"),
    "swing": ("period_error", 0.0, "period of a swing"),
    "merging": ("roundness", 1.0, "roundness after merging"),
}


def calibrate_strength() -> float:
    """Return the strength of the pairwise forces over theory that gives a sphere its exact pressure."""
    return 1.0 / (1.0 + run_to_rest("pairwise", SPHERE, 1.0, "sphere")["pressure_error"])


@cache
def read_or_calibrate_strength() -> float:
    """Return the strength of the pairwise forces over theory: the stored value, or a calibrated one without it."""
    figures = results.read_figures(NAME)
    return figures.get("strength") or calibrate_strength()


def run_models(scene, sizes: tuple[int, ...]) -> dict:
    """Run a scene with each model of surface tension and each size.

    Args:
        scene: Function of model, particles across the diameter and strength that returns figures.
        sizes: Numbers of particles across the diameter.

    Returns:
        Model -> size as text -> figures of the scene.
    """
    rows = {}
    for model in MODELS:
        rows[model] = {
            str(size): scene(model, size, read_or_calibrate_strength() if model == "pairwise" else 1.0)
            for size in sizes
        }
        for size, row in rows[model].items():
            printed = {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()}
            print(f"  {model}, {size}:", "  ".join(f"{key} {value}" for key, value in printed.items()), flush=True)
    return rows


def measure_cost() -> dict:
    """Return the cost of a drop at rest with each model of surface tension.

    Returns:
        Model -> ``us_per_particle_step`` and ``over_tracked``, the ratio to the tracked surface.
    """

    def step_of(simulation):
        return make_batch(lambda: simulation.step(simulation.time_step()), 0.5)

    drops = {model: set_up_drop(unit_drop(SPHERE, 0.2), model, read_or_calibrate_strength()) for model in MODELS}
    seconds = measure_in_turns({model: step_of(drop) for model, drop in drops.items()})
    tracked = seconds[TRACKED]
    figures = {
        model: {
            "us_per_particle_step": 1e6 * float(np.median(seconds[model])) / drops[model].fluids,
            "over_tracked": float(np.median(seconds[model] / tracked)),
        }
        for model in MODELS
    }  # fmt: skip
    print(json.dumps(figures, indent=1))
    return figures


def draw(figures: dict) -> None:
    """Plot errors against core-seconds to a PNG file, one panel for each scene; failed runs are omitted.

    Args:
        figures: Scene -> result of ``run_models``.
    """
    figure, panels = plt.subplots(1, len(figures), figsize=(3.4 * len(figures), 3.2), layout="constrained")
    for panel, (scene, sides) in zip(np.atleast_1d(panels), figures.items(), strict=True):
        name, exact, title = DRAWN[scene]
        for model, marker in zip(MODELS, "so^D", strict=True):
            rows = [row for row in sides[model].values() if name in row]
            errors = [100.0 * abs(row[name] - exact) for row in rows]
            panel.loglog([row["seconds"] for row in rows], errors, f"{marker}-", label=model)
        panel.set(title=title, xlabel="core-seconds")
        panel.grid(alpha=0.3)
        panel.set_xticks(TICKS, TICKS)
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.yaxis.set_major_formatter("{x:g}")
        panel.yaxis.set_minor_formatter(NullFormatter())
    panels[0].set_ylabel("error (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", fontsize=8)
    figure.savefig(results.path_of(NAME).with_suffix(".png"), dpi=120)


if __name__ == "__main__":
    write_tables(
        __doc__.splitlines()[0],
        {
            "strength": calibrate_strength,
            "cost": measure_cost,
            "rest": partial(run_models, run_to_rest, SIZES),
            "swing": partial(run_models, run_swing, SIZES),
            "merging": partial(run_models, run_merging, SMALLER),
            "cap_60": partial(run_models, partial(run_cap_to_rest, 60.0), SIZES),
            "cap_120": partial(run_models, partial(run_cap_to_rest, 120.0), SIZES),
        },
        NAME,
    )
    figures = results.read_figures(NAME)
    draw({scene: figures[scene] for scene in DRAWN if scene in figures})
