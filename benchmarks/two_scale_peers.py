"""Two scales against Akantu and Kratos with a uniform step: the same package, error against cost, in one run.

    PYTHONPATH=. python benchmarks/two_scale_peers.py  (five minutes, one core each; writes two_scale_peers.json)

A quarter of a small package whose joints match the board node for node (Akantu has no ties), copper of 0.02 mm, under a
half sine. Errors are relative L2 over the histories of the centres of board and die, against this program's DNS on
elements half as large. Costs are processor seconds per simulated second, in turns. This program's own ``dns`` shows the
gain by its kernels, ``two_scale`` the gain by local steps. ``linear`` is against Akantu. ``nonlinear`` is against
Kratos, with finite rotation and J2 solder without hardening, since Akantu's J2 law does not support rotations.

Kratos' CoSimulationApplication has a dual multi-time-step method (``feti_dynamic_coupled_solver``). It is not run here:
with Kratos' own elements, at 2.3e5 updates per second (``peers.py``), two of its models would still cost more than one
Akantu model if more than half of the elements are fine.
"""

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.peers import FOLDER, Peer, install, model_arrays
from benchmarks.support import results, turns
from benchmarks.support.conforming_package import MATERIALS, conforming_package
from benchmarks.support.program_run import ProgramRun
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.mesh.supports import held_components
from reflowshock.fem.mesh.watch_table import centre_nodes
from reflowshock.fem.output.compare import relative_error
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.materials.library import SAC405
from reflowshock.materials.parameters import JohnsonCook
from reflowshock.materials.roles import Materials
from tests.support.fem_models import write_msh

PULSE, DURATION, SAMPLES = 1e-5, 2e-5, 200  # [s]
STRETCH = 4e-7  # [s] simulated by one side per turn
BAR = 10.0
MODES = ("two_scale", "dns")


@dataclass(frozen=True, slots=True)
class Scene:
    """Shock of the package.

    Attributes:
        peer: Name of the peer.
        peak: Peak of the half sine [m/s^2].
        numerics: Numerical settings of this program.
        materials: Materials of the parts.
        finite: Whether strains are finite.
    """

    peer: str
    peak: float
    numerics: dict[str, str]
    materials: Materials
    finite: bool

    def request(self, mode: str, mesh: Path) -> RunInput:
        """Return the input of a run of this program."""
        return RunInput(
            mode=mode,
            meshes=(mesh,),
            shock={
                "peak_acceleration": self.peak,
                "pulse_duration": PULSE,
                "duration": DURATION,
                "gravity": "off",
                "ranks": {"total": 1, "placement": "shared"},
                "numerics": {"history_samples": SAMPLES} | self.numerics,
            },
            materials=self.materials,
            output=mesh.parent,
        )

    def problem(self, path: Path, dns: ProgramRun) -> Path:
        """Write the problem of the peer with the steps of a DNS; return the file's path."""
        mesh = read_mesh(path)
        roles = np.array([part.split("@")[0].split("_")[0] for part in mesh.part_names])[mesh.part]
        names, material = np.unique(roles, return_inverse=True)
        arrays = model_arrays(mesh, material, [self.materials.by_role[str(name)] for name in names])
        text = path.with_suffix(".dat")
        text.write_text(
            "\n".join(material_text(name, self.materials) for name in np.array(mesh.part_names)[np.unique(mesh.part)])
        )
        stride = dns.plan.stride * dns.plan.substeps
        np.savez(
            path.with_suffix(".npz"),
            mesh=str(path),
            materials=str(text),
            held=held_components(mesh),
            watched=centre_nodes(mesh),
            step=dns.plan.step,
            stride=stride,
            samples=dns.plan.windows // dns.plan.stride,
            peak=self.peak,
            pulse=PULSE,
            finite=self.finite,
            **arrays,
        )
        return path.with_suffix(".npz")


IDEAL = MATERIALS.solder.model_copy(update={"plasticity": JohnsonCook(A=SAC405.plasticity.A)})
SCENES = {
    "linear": Scene("akantu", 1.5e4, {}, MATERIALS, False),
    "nonlinear": Scene(
        "kratos",
        5e5,
        {"kinematics": "corotational", "plasticity": "on", "formulation": "one_point"},
        MATERIALS.model_copy(update={"solder": IDEAL}),
        True,
    ),
}


def material_text(part: str, materials: Materials) -> str:
    """Return the material of a mesh part in Akantu's input format.

    Args:
        part: Name of the part, which begins with its role, e.g. "solder@A1".
        materials: Material of each role.
    """
    material = materials.by_role[part.split("@")[0].split("_")[0]]
    values = {"rho": material.density, "E": material.young_modulus, "nu": material.poisson_ratio}
    return "\n".join([f"material elastic [\n name = {part}", *(f" {key} = {values[key]:.17g}" for key in values), "]"])


def heights_of_centres(arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Return the vertical displacements of the centres of board and die [m], shape (samples, 2), from a history."""
    return np.column_stack([arrays["board_centre"][:, 2], arrays["die_centre"][:, 2]])


def compare_with_peer(scene: Scene) -> tuple[dict, dict]:
    """Run a shock by this program with one model and two scales, and by a peer, and compare errors and cost.

    Returns:
        Limits by name, and figures: elements, substeps, seconds per simulated us, errors against a fine mesh,
        difference of peer and one model, and largest plastic strain.
    """
    with tempfile.TemporaryDirectory() as directory:
        path, fine = Path(directory) / "package.msh", Path(directory) / "fine.msh"
        write_msh(conforming_package(), path)
        write_msh(conforming_package(2), fine)
        exact = ProgramRun(scene.request("dns", fine)).to_end()[0]
        runs = {mode: ProgramRun(scene.request(mode, path)) for mode in MODES}
        plan, histories = runs["dns"].plan, {mode: run.to_end()[0] for mode, run in runs.items()}
        reference = CubicSpline(exact["time"], heights_of_centres(exact))(histories["dns"]["time"])
        heights = {mode: heights_of_centres(arrays) for mode, arrays in histories.items()}
        peer = Peer(f"{scene.peer}_shock", scene.problem(path, runs["dns"]))
        heights[scene.peer] = peer.force
        batches = {mode: lambda run=run: run.step(STRETCH) for mode, run in runs.items()}
        seconds = turns.measure_in_turns(batches | {scene.peer: lambda: peer.ask("step") / plan.step})
        peer.end()
    errors = {name: relative_error(values, reference) for name, values in heights.items()}
    rest = {
        "elements": runs["two_scale"].elements,
        "substeps": runs["two_scale"].plan.substeps,
        "seconds_per_simulated_us": {name: 1e-6 * float(np.median(values)) for name, values in seconds.items()},
        "errors": errors,
        "difference_of_peer_and_dns": relative_error(heights[scene.peer], heights["dns"]),
        "largest_plastic_strain": float(histories["dns"].get("plastic_strain_max", np.zeros(1)).max()),
    }
    bars = {f"{mode} / {scene.peer}": turns.bar(turns.speed_ratio(seconds, mode, scene.peer), BAR) for mode in MODES}
    share = errors["two_scale"] / errors[scene.peer]
    return bars | {f"two_scale error / {scene.peer} error": turns.bar(share, 1.0, at_least=False)}, rest


def main() -> None:
    """Compare with each peer that can be installed; store and print figures and limits."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    installed, result = install(), {"bars": {}}
    for name, scene in SCENES.items():
        if scene.peer in installed:
            bars, result[name] = compare_with_peer(scene)
            result["bars"] |= bars
    if not result["bars"]:
        raise SystemExit("no peer can be installed; the benchmark needs one of them")
    results.write_and_print("two_scale_peers", result)


if __name__ == "__main__":
    main()
