"""Two scales against Akantu with one step for all: the same package, error against cost, in one run.

    PYTHONPATH=. python benchmarks/two_scale_peers.py  (two minutes, one core each; writes two_scale_peers.json)

The quarter of a small package whose joints match the board node for node (Akantu knows no ties), copper of 0.02 mm,
under a half sine. Errors are relative L2 over the histories of the centres of board and die against this program's DNS
on elements half as large. Costs are processor seconds of a simulated second, in turns. This program's own ``dns`` shows
what is gained by its kernels, ``two_scale`` what by the steps.

Kratos' wheel of CoSimulationApplication has a dual multi-time-step method (``feti_dynamic_coupled_solver``). It is not
run here: with Kratos' own elements, at 2.3e5 updates a second (``peers.py``), two models of it would still cost more
than Akantu's one where the fine share is above a half.
"""

import os
import tempfile
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.peers import FOLDER, Peer, install
from benchmarks.support import turns
from benchmarks.support.conforming_package import MATERIALS, conforming_package
from benchmarks.support.program_run import ProgramRun
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.mesh.supports import held_components
from reflowshock.fem.mesh.watch_table import centre_nodes
from reflowshock.fem.output.compare import relative_error
from reflowshock.fem.problem.inputs import RunInput
from tests.support.fem_models import write_msh

PEAK, PULSE, DURATION, SAMPLES = 1.5e4, 1e-5, 2e-5, 200  # [m/s^2], [s]
STRETCH = 4e-7  # [s] simulated by one side before it is the other's turn
BAR = 10.0


def request(mode: str, mesh: Path) -> RunInput:
    """Return the input of a run of this program."""
    return RunInput(
        mode=mode,
        meshes=(mesh,),
        shock={
            "peak_acceleration": PEAK,
            "pulse_duration": PULSE,
            "duration": DURATION,
            "gravity": "off",
            "ranks": {"total": 1, "placement": "shared"},
            "numerics": {"history_samples": SAMPLES},
        },
        materials=MATERIALS,
        output=mesh.parent,
    )


def problem(path: Path, mesh: MeshData, dns: ProgramRun) -> Path:
    """Write the problem for Akantu, with the steps of a DNS; return the file's path."""
    materials = path.with_suffix(".dat")
    names = [name for name in mesh.part_names if (mesh.part == mesh.part_names.index(name)).any()]
    materials.write_text("\n".join(material_text(name) for name in names))
    stride = dns.plan.stride * dns.plan.substeps
    np.savez(
        path.with_suffix(".npz"),
        mesh=str(path),
        materials=str(materials),
        points=mesh.points,
        held=held_components(mesh),
        watched=centre_nodes(mesh),
        step=dns.plan.step,
        stride=stride,
        samples=dns.plan.windows // dns.plan.stride,
        peak=PEAK,
        pulse=PULSE,
    )
    return path.with_suffix(".npz")


def material_text(part: str) -> str:
    """Return the material of a part in Akantu's language."""
    material = MATERIALS.by_role[part.split("@")[0].split("_")[0]]
    values = {"rho": material.density, "E": material.young_modulus, "nu": material.poisson_ratio}
    return "\n".join([f"material elastic [\n name = {part}", *(f" {key} = {values[key]:.17g}" for key in values), "]"])


def centres(arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Return the heights of board and die ``(samples, 2)`` [m] from a history."""
    return np.column_stack([arrays["board_centre"][:, 2], arrays["die_centre"][:, 2]])


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    if "akantu" not in install():
        raise SystemExit("Akantu cannot be installed: nothing to compare with")
    with tempfile.TemporaryDirectory() as directory:
        path, fine = Path(directory) / "package.msh", Path(directory) / "fine.msh"
        write_msh(conforming_package(), path)
        write_msh(conforming_package(2), fine)
        exact = ProgramRun(request("dns", fine)).to_end()[0]
        runs = {mode: ProgramRun(request(mode, path)) for mode in ("two_scale", "dns")}
        plan, histories = runs["dns"].plan, {mode: run.to_end()[0] for mode, run in runs.items()}
        reference = CubicSpline(exact["time"], centres(exact))(histories["dns"]["time"])
        found = {mode: centres(arrays) for mode, arrays in histories.items()}
        peer = Peer("akantu_shock", problem(path, read_mesh(path), runs["dns"]))
        found["akantu"] = peer.force
        batches = {mode: lambda run=run: run.step(STRETCH) for mode, run in runs.items()}
        seconds = turns.in_turns(batches | {"akantu": lambda: peer.ask("step") / plan.step})
        peer.end()
    errors = {name: relative_error(values, reference) for name, values in found.items()}
    result = {
        "elements": runs["two_scale"].elements,
        "substeps": runs["two_scale"].plan.substeps,
        "seconds_per_simulated_us": {name: 1e-6 * float(np.median(values)) for name, values in seconds.items()},
        "errors": errors,
        "difference_of_akantu_and_dns": relative_error(found["akantu"], found["dns"]),
        "bars": {
            f"{mode} / akantu": turns.bar(turns.ratio(seconds, mode, "akantu"), BAR) for mode in ("two_scale", "dns")
        }
        | {"two_scale error / akantu error": turns.bar(errors["two_scale"] / errors["akantu"], 1.0, at_least=False)},
    }
    turns.write("two_scale_peers", result)


if __name__ == "__main__":
    main()
