"""Mesh convergence of a drop with plastic solder: measures of the critical joint on three meshes.

    PYTHONPATH=. python benchmarks/halved_drop.py [SIZE ...]  (half an hour on one core; halved_drop.json)

A quarter of the 4 x 4 package of ``cases/jedec_bga`` on a board of 50 x 30 mm, held near its corners. The half sine of
0.15 ms bends the board and drives the corner joint beyond yield. The corner joint is fine, with matching columns of
board and substrate; the others are coarse. The element sizes scale as in the command ``accuracy``: twice, once and half
as long.
"""

import argparse
import json
import os
import tempfile
from math import hypot
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from benchmarks.support import results
from benchmarks.support.drop_scene import CASES, DropScene
from benchmarks.support.program_run import ProgramRun
from reflowshock.workflow.convergence.errors import richardson
from reflowshock.workflow.convergence.packages import board_drop_study
from reflowshock.workflow.pipeline.reader import read_case

RESULTS = "halved_drop"
NAME, JOINT = "jedec_bga", "A4"
SCENE = ("scale=quick", "board.holes.inset_x='3 mm'", "shock.numerics.kinematics=corotational")
SHOCK = {
    "service_condition": None,
    "peak_acceleration": 6000 * 9.80665,
    "pulse_duration": 1e-4,
    "duration": 1.5e-4,
    "history_samples": 150,
    "mass_scaled": ["copper"],
}
LAYERS = (25e-6, 12.5e-6, 50e-6)
ENDS = ("board", "package")
SIZES = (2.0, 1.0, 0.5)
AVERAGES = ("von_mises", "plastic_strain", "plastic_work")
RESULTANTS = {"axial_force": [0], "shear_force": [1, 2], "torsion": [3], "bending_moment": [4, 5]}
Measures = dict[str, float]


def mesh_scene(size: float, folder: Path) -> DropScene:
    """Mesh the package and board of the drop with element sizes multiplied by ``size``.

    Args:
        size: Factor of the element sizes.
        folder: Folder of the meshes.

    Returns:
        Meshes, with the inputs of runs on them.
    """
    run = board_drop_study(read_case(CASES / NAME / "case.toml", SCENE)).parameters[0].run_at(size)
    sized = (f"{key}={value}" for key, value in run.settings.items() if key.startswith(("board.", "package.")))
    return DropScene.write(folder, (*SCENE, *sized), NAME)


def measure_drop(size: float) -> dict:
    """Run the drop on a mesh whose element sizes are multiplied by ``size``.

    Returns:
        ``seconds``, ``elements``, ``window_ns``, ``substeps`` and ``values``: peaks over time of stress [Pa], section
        forces [N, N m] and averages of the fine joint, named ``<measure>@<end>``.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene, coupling = mesh_scene(size, Path(folder)), {"fine_joints": [JOINT]}
        first, *others = (scene.request("two_scale", coupling, SHOCK | {"joint_layer": layer}) for layer in LAYERS)
        run = ProgramRun(first, others)
    arrays, seconds = run.to_end()
    joint = list(arrays["joints"]).index(JOINT)
    values = {}
    for end in ENDS:
        values[f"peel@{end}"] = float(arrays[f"peel_{end}"][:, joint].max())
        section = arrays[f"section_{end}"][:, joint]
        for name, parts in RESULTANTS.items():
            values[f"{name}@{end}"] = float(np.linalg.norm(section[:, parts], axis=1).max())
        for layer, history in zip(LAYERS, (run.history, *run.others), strict=True):
            averages = history.arrays()
            for name in AVERAGES:
                values[f"{name}:{1e6 * layer:g}um@{end}"] = float(averages[f"{name}_{end}"][:, joint].max())
    return {
        "seconds": seconds,
        "elements": run.elements,
        "window_ns": 1e9 * run.plan.window,
        "substeps": run.plan.substeps,
        "values": values,
    }


def relative_changes(coarse: Measures, fine: Measures) -> Measures:
    """Return the relative differences of measures between two meshes, by their names.

    Forces are relative to the section force of the fine mesh, moments to this force times the pad radius, others to
    their own value.

    Args:
        coarse: Measures on the coarse mesh, named ``<measure>@<end>``.
        fine: Measures on the fine mesh.
    """
    scale = {}
    for end in ENDS:
        force = hypot(fine[f"axial_force@{end}"], fine[f"shear_force@{end}"])
        radius = (fine[f"axial_force@{end}"] / fine[f"peel@{end}"] / np.pi) ** 0.5
        scale |= {f"{name}@{end}": force for name in ("axial_force", "shear_force")}
        scale |= {f"{name}@{end}": force * radius for name in ("torsion", "bending_moment")}
    return {key: float((coarse[key] - value) / scale.get(key, value)) for key, value in fine.items()}


def main() -> None:
    """Run the drop on each mesh; store and print changes and fitted orders."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sizes", nargs="*", type=float, help=f"element size factors, default {SIZES}")
    chosen = parser.parse_args().sizes or SIZES
    figures = results.read_figures(RESULTS) or {"meshes": {}}
    for size in chosen:
        figures["meshes"][f"{size:g}"] = measure_drop(size)
        print(f"{size:g}", json.dumps(figures["meshes"][f"{size:g}"]), flush=True)
        sizes = sorted(map(float, figures["meshes"]), reverse=True)
        values = [figures["meshes"][f"{size:g}"]["values"] for size in sizes]
        figures["changes"] = {
            f"{size:g}": relative_changes(value, values[-1]) for size, value in zip(sizes, values, strict=True)
        }
        limits = {key: richardson(sizes[-3:], [value[key] for value in values[-3:]], None) for key in values[0]}
        figures["orders"] = {key: limit[1] for key, limit in limits.items() if limit}
        results.write_figures(RESULTS, figures)
    print(json.dumps({key: figures[key] for key in ("changes", "orders")}, indent=1))


if __name__ == "__main__":
    main()
