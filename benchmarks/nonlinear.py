"""Cost of finite rotation and plasticity against limits: forces, steps, windows, and two scales over one model.

    PYTHONPATH=. python benchmarks/nonlinear.py [PART ...]  (ten quiet minutes, one core; writes results/nonlinear.json)

Each part can run alone; figures of earlier runs are kept:
- ``forces``: the cube of 40^3 boxes in finite rotation, alone and in whole steps; yielding solder with one-point and
  incompatible-modes elements on 12^3 distorted elements that fit the cache; Akantu's linear loop if pip installs it.
- ``against_peers``: whole steps of those elements, rotated by 0.3, in Akantu (elastic) and Kratos (elastic, J2).
- ``bending``: moment of a plastic hinge of four elements over its height, and the elastic stiffness of a distorted
  one-point element over the stiffness with incompatible modes: the accuracy lost by the faster element.
- ``effects``: windows of bga_drop (held velocity, one fine joint, copper at its true mass) in finite rotation and with
  yielding solder, over the linear windows of the same scheme and of the scheme that a linear model would use.
- ``interpreter``: Python overhead of a substep, taken singly and in one call.
- ``two_scales``: core-seconds of a simulated second over those of one model, with three fine joints and with one, in
  finite rotation with yielding solder; ``errors``: their histories on a smaller board under a shorter pulse.
- ``implicit``: one model in implicit steps (``support/newton_steps.py``) on that board, under its pulse and one five
  times as long: processor seconds and errors against explicit steps and two scales.
- ``drift``: energy over 1e5 windows of two elastic undamped models in finite rotation, by each scheme.
- ``growth``: growth of one window of every scheme over the grid of coupling_stability.py, with models rotated by 40
  degrees and strained by 0.5 %, and the tangents of a flowing block. One-point elements; ``growth_of_modes`` and
  ``errors_of_modes``: elements with incompatible modes.

Sides take turns; ratios are of processor seconds. Wall times of whole cases are read from ``runs``; ``not_measured``
lists the commands of missing runs.
"""

import argparse
import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np
from mpi4py import MPI

from benchmarks import peers
from benchmarks.coupling_stability import GROWTH, sample_grid
from benchmarks.internal_force import RATE, STRAINS, corotational_force, linear_force, plastic_force
from benchmarks.support import results, turns
from benchmarks.support.cube import SOLDER, STEEL, cube, elements_of, random_displacement
from benchmarks.support.drop_scene import DropScene
from benchmarks.support.newton_steps import take_implicit_steps
from benchmarks.support.program_run import ProgramRun
from benchmarks.support.stored_rows import StoredRows
from benchmarks.support.whole_runs import read_run_figures
from benchmarks.two_scale import CRITICAL, PULSE, REDUCED, SHORT, STRETCH
from reflowshock.cases.hard.trials.beams import bent_moment
from reflowshock.cases.hard.trials.bodies import motion_of, nonlinear_body
from reflowshock.cases.hard.trials.coupled import Coupled
from reflowshock.cases.hard.trials.pairs import SCHEMES, Pair
from reflowshock.cases.hard.trials.windows import PUSH
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.elements.element import element_stiffness
from reflowshock.fem.loads.pulse import STANDARD_GRAVITY
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.assembly import ForceOptions, make_body
from reflowshock.fem.output.compare import compare_histories
from reflowshock.materials.parameters import JohnsonCook, Material
from tests.support.fem_tangent import flowing_pair

BUILD = results.FOLDER.parents[1] / "build"
FINITE = {"kinematics": "corotational", "plasticity": "on", "formulation": "one_point"}
ELASTIC = {"plasticity": "off", "formulation": "one_point"}
HELD = {"scheme": "held_velocity", "fine_joints": CRITICAL[:1]}
SIDES: dict[str, tuple[dict, dict]] = {
    "linear": (HELD, ELASTIC | {"kinematics": "small"}),
    "linear_as_chosen": ({"fine_joints": CRITICAL[:1]}, ELASTIC | {"kinematics": "small"}),
    "turning": (HELD, ELASTIC | {"kinematics": "corotational"}),
    "yielding": (HELD, FINITE | {"kinematics": "small"}),
    "turning_yielding": (HELD, FINITE),
}
FINE = {"three_joints": CRITICAL, "one_joint": CRITICAL[:1]}
MATERIAL = "materials.solder='SAC405'"
PEAK, DURATION = 4000 * STANDARD_GRAVITY, 1.2e-4  # [m/s^2], [s], of errors: solder flows
ALONG_PATHS = ("held_velocity, levels auto", "impulse", "gravouil_combescure")
WINDOWS, SAMPLES = 100_000, 2000  # 200 samples would show a slow beat of both models as a drift of 4e-3
DRIFTING = {
    "held_velocity": Pair(3, 3.0),
    "held_velocity, levels auto": Pair(12, 3.0, height=3, thinnest=0.2),
    "impulse": Pair(3, 3.0),
    "gravouil_combescure": Pair(3, 3.0),
}
SPARSE, STEPS_A_PULSE = 60, (50, 100)  # samples, and steps, of implicit runs
ROUNDS = 5
TURN = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])
STRETCHED = np.array([[1.0, 0.3, 0.0], [0.3, -0.36, 0.0], [0.0, 0.0, -0.36]])
ELASTIC_SOLDER = SOLDER.model_copy(update={"plasticity": None})
IDEAL_SOLDER = SOLDER.model_copy(update={"plasticity": JohnsonCook(A=SOLDER.plasticity.A)})
PEERS = {  # law -> material, strain, peers with this law, elements of this program
    "finite": (ELASTIC_SOLDER, 1e-4, ("akantu", "kratos"), ("incompatible_modes",)),
    "plastic": (IDEAL_SOLDER, 3e-3, ("kratos",), ("one_point", "incompatible_modes")),
}
PEER_BAR, SAME_FORCES = 20.0, 1e-3  # of J2 and of Green's strain instead of the stretch: of the order of the strain
Bars = dict[str, dict[str, Any]]


def measure_forces() -> tuple[Bars, dict]:
    """Return limits, and element updates per second of forces and steps by side (``updates_per_second``)."""
    boxes, small = cube(), cube(distorted=True, edge=12)
    body, critical = nonlinear_body(boxes, STEEL, ForceOptions("corotational", 1e-8), "incompatible_modes")
    motion = motion_of(body, 0.5 * critical)
    motion.displacement[:] = random_displacement(body.local.points, 1e-3)
    works = {
        "linear_boxes": linear_force(elements_of(boxes)),
        "turning_boxes": corotational_force(elements_of(boxes)),
        "turning_boxes_step": lambda: motion.take_steps(1),
        "turning_any": corotational_force(elements_of(small)),
    }
    for kind in ("one_point", "incompatible_modes"):
        for name, strain in STRAINS.items():
            works[f"{name}_{kind}"] = plastic_force(elements_of(small, kind, SOLDER), "finite", strain)
    counts = dict.fromkeys(works, len(small.cells)) | dict.fromkeys(list(works)[:3], len(boxes.cells))
    batches = {name: turns.make_batch(work) for name, work in works.items()}
    akantu = akantu_loop(boxes, random_displacement(boxes.points))
    if akantu:
        batches["akantu"] = lambda: akantu.ask("force")
        counts["akantu"] = len(boxes.cells)
    seconds = turns.measure_in_turns(batches)
    if akantu:
        akantu.end()
    rates = turns.rates(seconds, counts)
    bars = {
        "finite rotation, elastic boxes, force [updates/s]": turns.bar(rates["turning_boxes"], 18e6),
        "finite rotation, whole step / force": turns.bar(
            turns.speed_ratio(seconds, "turning_boxes_step", "turning_boxes"), 0.8
        ),
        "solder below yield, one point [updates/s]": turns.bar(rates["below_yield_one_point"], 4e6),
        f"solder that flows at {RATE:g} 1/s, one point [updates/s]": turns.bar(rates["yielding_one_point"], 2e6),
        "solder below yield, incompatible modes [updates/s]": turns.bar(rates["below_yield_incompatible_modes"], 4e6),
        "solder that flows, incompatible modes [updates/s]": turns.bar(rates["yielding_incompatible_modes"], 2e6),
    }
    if akantu:
        faster = turns.speed_ratio(seconds, "turning_boxes", "akantu")
        bars["finite rotation over Akantu's linear loop"] = turns.bar(faster, 60.0)
    return bars, {"updates_per_second": rates}


def akantu_loop(mesh, displacement: np.ndarray) -> "peers.Peer | None":
    """Return a process of Akantu with an elastic body at a displacement (n, 3) [m]; None if pip cannot install it."""
    peers.FOLDER.mkdir(parents=True, exist_ok=True)
    return peers.Peer("akantu", peers.write_problem(mesh, displacement, 1e-8)) if "akantu" in peers.install() else None


def compare_with_peers() -> tuple[Bars, dict]:
    """Return limits on the speed of whole steps over peers, from states with equal forces, and updates per second."""
    mesh, installed = cube(distorted=True, edge=12), peers.install()
    bars, rest = {}, {}
    for law, (material, strain, names, kinds) in PEERS.items():
        displacement = mesh.points @ (TURN @ (np.eye(3) + strain * STRETCHED) - np.eye(3)).T
        motions = {kind: move_body(mesh, material, kind, displacement) for kind in kinds}
        problem_file = peers.write_problem(mesh, displacement, motions[kinds[0]].step, material, finite=True)
        running = {name: peers.Peer(name, problem_file) for name in names if name in installed}
        force = np.zeros_like(displacement)
        force[motions[kinds[0]].body.local.nodes] = motions[kinds[0]].force
        batches = {kind: turns.make_batch(partial(motion.take_steps, 1)) for kind, motion in motions.items()}
        seconds = turns.measure_in_turns(batches | {name: partial(peer.ask, "step") for name, peer in running.items()})
        rest[law] = turns.rates(seconds, dict.fromkeys(seconds, len(mesh.cells)))
        for name, peer in running.items():
            peer.end()
            difference = float(np.abs(peer.force - force).max() / np.abs(force).max())
            bars[f"{law}: forces of {name} against ours"] = turns.bar(difference, SAME_FORCES, False)
            for kind in kinds:
                bars[f"{law}: steps, {kind} over {name}"] = turns.bar(turns.speed_ratio(seconds, kind, name), PEER_BAR)
    return bars, {"steps, updates_per_second": rest}


def move_body(mesh: MeshData, material: Material, kind: str, displacement: np.ndarray) -> ExplicitMotion:
    """Return the motion of a body in finite rotation at a displacement [m], shape (n, 3), with its force there."""
    step = 0.5 * nonlinear_body(mesh, material, ForceOptions("corotational"), kind)[1]
    motion = motion_of(nonlinear_body(mesh, material, ForceOptions("corotational", step), kind)[0], step)
    motion.displacement[:] = displacement[motion.body.local.nodes]
    motion.update_force()
    return motion


def measure_bending() -> tuple[Bars, dict]:
    """Return limits on the accuracy lost by the one-point element, and moments of a plastic hinge over theory."""
    moments = {name: bent_moment(name, 4) for name in ("one_point", "incompatible_modes")}
    stiffness = [element_stiffness(elements_of(cube(True, 4), name)) for name in moments]
    difference = np.abs(stiffness[0] - stiffness[1]).max() / np.abs(stiffness[1]).max()
    bars = {
        "plastic hinge of four elements, error of the moment": turns.bar(abs(moments["one_point"] - 1.0), 0.05, False),
        "elastic stiffness against incompatible modes": turns.bar(float(difference), 1e-9, False),
    }
    return bars, {"hinge_moments": moments}


def measure_effects() -> tuple[Bars, dict]:
    """Return limits, and the cost of windows (exchange intervals) with each effect over linear ones."""
    with tempfile.TemporaryDirectory() as folder:
        scene = DropScene.write(Path(folder), (*REDUCED, MATERIAL))
        runs = {name: ProgramRun(scene.request("two_scale", *side)) for name, side in SIDES.items()}
    seconds = seconds_of(runs)
    cost = {name: turns.speed_ratio(seconds, "linear", name) for name in runs}
    bars = {
        "finite rotation in bga_drop, over linear": turns.bar(cost["turning"] - 1.0, 1.2, False),
        "yielding in bga_drop, over linear": turns.bar(cost["yielding"] - 1.0, 1.0, False),
    }
    return bars, {"window_cost_over_linear": cost, "elements": {name: run.elements for name, run in runs.items()}}


def seconds_of(runs: dict[str, ProgramRun]) -> dict[str, np.ndarray]:
    """Return the processor seconds per simulated second of each run by name, one value for each round of turns."""
    for run in runs.values():
        run.step(STRETCH)
    return turns.measure_in_turns({name: lambda run=run: run.step(STRETCH) for name, run in runs.items()}, ROUNDS)


def measure_interpreter() -> tuple[Bars, dict]:
    """Return no limits, and the seconds of a substep of a meso model with and without the interpreter."""
    with tempfile.TemporaryDirectory() as folder:
        scene = DropScene.write(Path(folder), (*REDUCED, MATERIAL, "scale=quick"))
        run = ProgramRun(scene.request("two_scale", {"scheme": "held_velocity", "fine_joints": ["A4"]}, FINITE))
    motion = run.participants["meso"].motion
    steps = 20
    works: dict[str, Callable[[], object]] = {
        "at_once": lambda: motion.take_steps(steps),
        "one_by_one": lambda: ExplicitMotion._take_single_steps(motion, steps, None),
    }
    seconds = turns.measure_in_turns({name: turns.make_batch(work) for name, work in works.items()})
    spared = float(np.median(seconds["one_by_one"] - seconds["at_once"])) / steps
    each = {name: float(values.min()) / steps for name, values in seconds.items()}
    return {}, {"substep_seconds": each, "spared_a_substep": spared, "elements": run.elements}


def measure_two_scales() -> tuple[Bars, dict]:
    """Return limits, and core-seconds of two scales over those of one model, with windows and sizes."""
    with tempfile.TemporaryDirectory() as folder:
        scene = DropScene.write(Path(folder), (*REDUCED, MATERIAL))
        runs = {
            name: ProgramRun(scene.request("two_scale", HELD | {"fine_joints": fine}, FINITE))
            for name, fine in FINE.items()
        } | {"dns": ProgramRun(scene.request("dns", {}, FINITE))}
    seconds = seconds_of(runs)
    ratios = {name: turns.speed_ratio(seconds, "dns", name) for name in FINE}
    plans = {name: {"window_ns": 1e9 * run.plan.window, "substeps": run.plan.substeps} for name, run in runs.items()}
    bars = {
        "two scales over one model, 3 fine joints": turns.bar(ratios["three_joints"], 0.12, False),
        "two scales over one model, 1 fine joint": turns.bar(ratios["one_joint"], 0.077, False),
    }
    return bars, {"ratios": ratios, "plans": plans, "elements": {name: run.elements for name, run in runs.items()}}


def measure_errors(formulation: str = "one_point") -> tuple[Bars, dict]:
    """Return limits, and errors of the critical joint with two scales against one model, by number of fine joints."""
    shock = FINITE | {
        "formulation": formulation,
        "peak_acceleration": PEAK,
        "pulse_duration": PULSE,
        "duration": DURATION,
    }
    rows: dict[str, dict] = {}
    with tempfile.TemporaryDirectory() as folder:
        scene = DropScene.write(Path(folder), (*SHORT, MATERIAL))
        requests = {name: ("two_scale", HELD | {"fine_joints": fine}) for name, fine in FINE.items()}
        requests |= {"dns": ("dns", HELD | {"fine_joints": "all"})}
        for name, (mode, coupling) in requests.items():
            arrays, seconds = ProgramRun(scene.request(mode, coupling, shock)).to_end()
            np.savez(Path(folder) / f"{name}.npz", **arrays)
            rows[name] = {"seconds": seconds}
        for name, fine in FINE.items():
            rows[name] |= compare_histories(Path(folder) / f"{name}.npz", Path(folder) / "dns.npz", list(fine))
    limits = {"three_joints": ("3 fine joints", 0.03), "one_joint": ("1 fine joint", 0.05)}
    bars = {
        f"{words}, {formulation}: {metric}": turns.bar(rows[name][metric], limit, False)
        for name, (words, limit) in limits.items()
        for metric in ("critical_joint_peel_error", "critical_joint_work_error")
        if metric in rows[name]
    }
    return bars, rows


def measure_implicit() -> tuple[Bars, dict]:
    """Return no limits, and seconds and errors of implicit steps for the pulse of ``errors`` and a longer one."""
    rows: dict[str, dict] = {}
    for pulse in (PULSE, 5.0 * PULSE):
        shock = FINITE | {"peak_acceleration": PEAK, "pulse_duration": pulse, "history_samples": SPARSE}
        with tempfile.TemporaryDirectory() as folder:
            scene = DropScene.write(Path(folder), (*SHORT, MATERIAL))
            request = partial(scene.request, shock=shock | {"duration": DURATION / PULSE * pulse})
            runs = {"explicit": request("dns", HELD | {"fine_joints": "all"})}
            runs |= {name: request("two_scale", HELD | {"fine_joints": fine}) for name, fine in FINE.items()}
            runs |= {f"{count} steps a pulse": runs["explicit"] for count in STEPS_A_PULSE}
            for name, request_of_run in runs.items():
                run = ProgramRun(request_of_run)
                if request_of_run is runs["explicit"] and name != "explicit":
                    take_implicit_steps(run, pulse / int(name.split()[0]))
                arrays, seconds = run.to_end()
                path = Path(folder) / f"{name}.npz"
                np.savez(path, **arrays)
                errors_found = compare_histories(
                    path, Path(folder) / "explicit.npz", list(FINE.get(name, CRITICAL[:1]))
                )
                rows[f"{name}, pulse of {pulse:g} s"] = {"seconds": seconds, **errors_found}
                print(name, pulse, seconds, errors_found, flush=True)
    return {}, rows


def measure_drift() -> tuple[Bars, dict]:
    """Return limits on the energy drift of each scheme over many windows in finite rotation, and the runs' sizes."""
    bars, rows = {}, {}
    for name, pair in DRIFTING.items():
        models = pair.divided(SCHEMES[name])
        response = ForceOptions("corotational", models.division.meso_step)
        bodies = {
            role: make_body(MPI.COMM_SELF, *part, np.ones(len(part[0].steps)), response)
            for role, part in models.parts.items()
        }
        coupled = Coupled(bodies, models.division.plan, scheme_of(models.division.scheme))
        coupled.swing(PUSH)
        change, interface = coupled.drift(WINDOWS, SAMPLES)
        bars[f"1e5 windows, elastic finite, no damping: energy drift, {name}"] = turns.bar(change, 1e-3, False)
        rows[name] = {
            "interface_energy": interface,
            "substeps": models.division.ratios,
            "elements": {role: len(body.elements.cells) for role, body in bodies.items()},
        }
        print(name, change, rows[name], flush=True)
    return bars, rows


def measure_growth(every: int = 1, formulation: str = "one_point") -> tuple[Bars, dict]:
    """Return limits on the windows that grow, by scheme, and the largest growths, over every ``every``-th pair.

    Each pair is stored in ``build`` when it is done, so that an interrupted run continues.
    """
    stored_rows = StoredRows(BUILD / f"growth-{formulation}.jsonl", formulation)
    growth_rates: dict[str, dict[str, float]] = {name: {} for name in ALONG_PATHS}
    levels: dict[str, int] = {}
    for number, (pair, fraction) in enumerate(list(sample_grid())[::every], 1):
        label = f"{pair!r} at {fraction}"
        row = stored_rows.get(label, partial(measure_window_growth, pair, fraction, formulation))
        for name, values in growth_rates.items():
            values[label] = row[name]
        levels[label] = row["levels"]
        print(number, label, f"{max(row[name] for name in ALONG_PATHS):.1e}", flush=True)
    grown = {name: sum(value > GROWTH for value in values.values()) for name, values in growth_rates.items()}
    bars = {
        f"nonlinear windows that grow by more than {GROWTH:g}, {formulation}, {name}": turns.bar(count, 0, False)
        for name, count in grown.items()
    }
    worst = {name: max(values.values()) for name, values in growth_rates.items()}
    return bars, {"samples": len(levels), "with_levels": sum(count > 1 for count in levels.values()), "worst": worst}


def measure_window_growth(pair: Pair, fraction: float, formulation: str) -> dict[str, float]:
    """Return scheme -> spectral radius minus 1 of a window, and ``levels``, the step levels of the first scheme."""
    growth_rates: dict[str, float] = {}
    for name in ALONG_PATHS:
        coupled = flowing_pair(pair, SCHEMES[name], fraction, formulation)
        growth_rates[name] = coupled.spectral_radius() - 1.0
        if name == ALONG_PATHS[0]:
            growth_rates["levels"] = len(coupled.meso.motion.body.schedule)
    return growth_rates


PARTS: dict[str, Callable[..., tuple[Bars, dict]]] = {
    "forces": measure_forces,
    "against_peers": compare_with_peers,
    "bending": measure_bending,
    "effects": measure_effects,
    "interpreter": measure_interpreter,
    "two_scales": measure_two_scales,
    "errors": measure_errors,
    "implicit": measure_implicit,
    "drift": measure_drift,
    "growth": measure_growth,
    "errors_of_modes": partial(measure_errors, formulation="incompatible_modes"),
    "growth_of_modes": partial(measure_growth, formulation="incompatible_modes"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", help=f"parts among {', '.join(PARTS)} (default: all)")
    parser.add_argument("--every", type=int, default=1, help="growth: take every N-th pair of the grid")
    options = parser.parse_args()
    parts = PARTS | {name: partial(PARTS[name], options.every) for name in ("growth", "growth_of_modes")}
    chosen = options.parts or list(parts)
    figures = results.read_figures("nonlinear") or {"bars": {}}
    for name in chosen:
        bars, rest = parts[name]()
        figures["bars"] |= bars
        figures[name] = rest
        bars, figures["not_measured"] = read_run_figures()
        figures["bars"] |= bars
        results.write_and_print("nonlinear", figures)


if __name__ == "__main__":
    main()
