"""What the stages of a structure found: its mesh, its motion against references, one solver against the other."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.problem import Problem
from reflowshock.workflow.case.run import Findings, at_least, at_most, in_words_continued, metric
from reflowshock.workflow.case.text import short
from reflowshock.workflow.structure import exact_bar, exact_cantilever, exact_layers
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.records import compared_with_record
from reflowshock.workflow.structure.references import BarWave, Cantilever, FrequencyRange, LayeredBar, Record

SOLVER_DIFFERENCE = 0.01  # of the histories of watch points, explicit against implicit, relative L2
JUDGED = ("displacement_difference", "strain_difference")
TWO_SCALE_ERROR = 0.01  # of the displacements of watch points, coupled models against a DNS, relative L2
ERRORS_JUDGED = ("two_scale_displacement_error",)
UNITS = {"wave_speed": "m/s", "tip_deflection": "m", "swing_frequency": "Hz"}

Arrays = Mapping[str, NDArray]


def of_mesh(elements: Mapping[str, int]) -> Findings:
    """Say how many elements each layer has."""
    counts = {f"elements_{layer}": metric(count) for layer, count in elements.items()}
    return Findings(metrics=counts | {"elements": metric(sum(elements.values()))})


def of_motion(results: Mapping[str, dict]) -> Findings:
    """Judge the motion by what each solver says of itself in ``result.json``; the figures of the first one count."""
    metrics: dict = {}
    health: dict = {}
    for solver, result in results.items():
        prefix = "" if solver == next(iter(results)) else f"{solver}_"
        metrics |= {prefix + name: value for name, value in result["metrics"].items()}
        health |= {prefix + name: value for name, value in result["health"].items()}
    effects = dict(next(iter(results.values()))["effects"])
    return Findings(metrics, health, effects, in_words_continued(results))


def of_comparison(case: StructureCase, folders: Mapping[str, Path]) -> Findings:
    """Judge the motion by the references of the case, and two solvers by each other.

    Args:
        case: the case.
        folders: folder of each solver's products, the one whose figures count first.
    """
    from reflowshock.fem.output.compare_structures import solver_differences

    histories = {solver: read_history(folder) for solver, folder in folders.items()}
    metrics: dict = {}
    health: dict = {}
    for solver, folder in folders.items():
        prefix = "" if solver == next(iter(folders)) else f"{solver}_"
        motion = Motion(read_modes(folder), histories[solver], read_places(folder))
        found, checks = compared_with_references(case, motion)
        metrics |= {prefix + name: value for name, value in found.items()}
        health |= {prefix + name: value for name, value in checks.items()}
    first = next(iter(histories.values()))
    if "implicit" in folders and len(folders) > 1:
        differences = solver_differences(first, histories["implicit"])
        metrics |= {name: metric(value) for name, value in differences.items()}
        health |= {name: at_most(differences[name], SOLVER_DIFFERENCE) for name in JUDGED if name in differences}
    if "dns" in folders and len(folders) > 1:
        errors = two_scale_errors(solver_differences(first, histories["dns"]))
        metrics |= {name: metric(value) for name, value in errors.items()} | cost_ratio(folders)
        health |= {name: at_most(errors[name], TWO_SCALE_ERROR) for name in ERRORS_JUDGED if name in errors}
    return Findings(metrics, health)


def two_scale_errors(differences: Mapping[str, float]) -> dict[str, float]:
    """Name differences from a DNS as what they are: errors of two scales."""
    return {f"two_scale_{name.replace('_difference', '_error')}": value for name, value in differences.items()}


def cost_ratio(folders: Mapping[str, Path]) -> dict:
    """Return core and wall time of a coupled run's windows over those of the DNS, on as many ranks."""
    results = [
        json.loads((folders[solver] / "result.json").read_text(encoding="utf-8")) for solver in ("explicit", "dns")
    ]
    coupled, dns = (result["timings"]["windows"] for result in results)
    cores = [result["balance"]["window_core_seconds"] / result["model"]["window"] for result in results]
    return {
        "two_scale_dns_core_ratio": metric(cores[0] / cores[1]),
        "two_scale_dns_time_ratio": metric(coupled / dns),
    }


def read_history(folder: Path) -> dict[str, NDArray]:
    """Read the history that a solver left."""
    with np.load(folder / "history.npz") as arrays:
        return dict(arrays)


def read_modes(folder: Path) -> list[dict]:
    """Read the natural modes that a solver left, lowest first; none where another solver has found them."""
    path = folder / "modes.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def read_places(folder: Path) -> dict[str, tuple[float, float, float]]:
    """Read where the motion of each watch point is recorded [m]: at the node that is nearest to it."""
    watch = json.loads((folder / "result.json").read_text(encoding="utf-8"))["model"]["watch"]
    return {name: point["node_at"] for name, point in watch.items()}


@dataclass(frozen=True, slots=True)
class Motion:
    """What a solver found.

    Attributes:
        modes: natural modes, lowest first.
        history: arrays of its ``history.npz``.
        places: watch point -> where its motion is recorded [m].
    """

    modes: list[dict]
    history: Arrays
    places: Mapping[str, tuple[float, float, float]]


def compared_with_references(case: StructureCase, motion: Motion) -> tuple[dict, dict]:
    """Return metrics and health checks of all references of a case, for one solver."""
    metrics: dict = {}
    health: dict = {}
    for reference in case.references.values():
        if isinstance(reference, BarWave | LayeredBar):
            found = _waves(case, reference, motion)
            limits = {"wave_speed_error": reference.speed_limit} | dict.fromkeys(
                ("transmitted_velocity_error", "reflected_velocity_error"), reference.amplitude_limit
            )
        elif isinstance(reference, Cantilever):
            tip = motion.history[f"displacement@{reference.tip}"][:, 2]
            found = exact_cantilever.measure(strip_of(case, reference), motion.history["time"], tip)
            limits = dict.fromkeys(("tip_deflection_error", "swing_frequency_error"), reference.limit)
        else:
            if isinstance(reference, FrequencyRange) and motion.modes:
                health |= _in_range(reference, motion.modes)
            elif isinstance(reference, Record):
                metrics |= compared_with_record(case, reference, motion.history)
            continue
        metrics |= {name: metric(value, UNITS.get(name.removesuffix("_exact"), "")) for name, value in found.items()}
        health |= {name: at_most(abs(found[name]), limit) for name, limit in limits.items()}
    return metrics, health


def bars_of(case: StructureCase, reference: BarWave) -> exact_bar.Bars:
    """Return the two layers as bars."""
    from reflowshock.materials.elasticity import elasticity_matrix

    layers, materials = case.structure.layers.values(), case.problem.layer_materials.values()
    lower, upper = (float(elasticity_matrix(material)[2, 2]) for material in materials)
    below, above = (material.density for material in materials)
    first, second = (layer.thickness for layer in layers)
    return exact_bar.Bars((first, second), (lower, upper), (below, above), case.loads[reference.load].duration or 0.0)


def layers_of(case: StructureCase) -> exact_layers.Layers:
    """Return all layers as bars."""
    from reflowshock.materials.elasticity import elasticity_matrix

    materials = case.problem.layer_materials.values()
    return exact_layers.Layers(
        tuple(layer.thickness for layer in case.structure.layers.values()),
        tuple(float(elasticity_matrix(material)[2, 2]) for material in materials),
        tuple(material.density for material in materials),
    )


def waves_that_do_not_pass(case: StructureCase) -> Iterator[Problem]:
    """Find runs that end before the waves that a layered bar compares have passed by half."""
    for key, reference in case.references.items():
        if isinstance(reference, LayeredBar):
            roles = zip(("near", "far", "beyond"), [*reference.incident, reference.transmitted], strict=True)
            heights = {role: case.watch[name].at[2] for role, name in roles}
            starts = [start for _, start in exact_layers.passes(layers_of(case), heights).values()]
            least = max(starts) + 0.5 * _pulse_of(case, reference.load).duration
            if case.dynamics.duration < least:
                message = f"ends before the waves of references.{key} have passed the watch points"
                yield Problem("dynamics.duration", message, short(case.dynamics.duration), f">= {short(least)}")


def strip_of(case: StructureCase, reference: Cantilever) -> exact_cantilever.Strip:
    """Return the only layer as a strip."""
    from reflowshock.materials.elasticity import elasticity_matrix

    (material,) = case.problem.layer_materials.values()
    pressure, body = case.loads[reference.load].peak or 0.0, case.structure
    return exact_cantilever.Strip(body.length, body.thickness, elasticity_matrix(material), material.density, pressure)


def wave_points(reference: BarWave | LayeredBar) -> list[str]:
    """Return the watch points of a bar, upwards."""
    return [*reference.incident, reference.transmitted]


def exact_velocities(
    case: StructureCase,
    reference: BarWave | LayeredBar,
    places: Mapping[str, tuple[float, float, float]],
    times: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the exact velocities (points x times,) [m/s] along a bar, one of ``wave_points`` after the other.

    Args:
        case: the case.
        reference: the bar.
        places: watch point -> where its motion is recorded [m].
        times: (times,) [s].
    """
    layers, pulse = layers_of(case), _pulse_of(case, reference.load)
    return np.concatenate([layers.velocity(places[name][2], times, pulse.value) for name in wave_points(reference)])


def _waves(case: StructureCase, reference: BarWave | LayeredBar, motion: Motion) -> dict[str, float]:
    points, history = wave_points(reference), motion.history
    velocities = [history[f"velocity@{name}"][:, 2] for name in points]
    heights = [motion.places[name][2] for name in points]
    roles = ("near", "far", "beyond")
    found = dict(zip(roles, velocities, strict=True)) | {"time": history["time"]}
    at, pulse = dict(zip(roles, heights, strict=True)), _pulse_of(case, reference.load)
    if isinstance(reference, LayeredBar):
        return exact_layers.measure(layers_of(case), pulse, at, found)
    curves = exact_layers.wave_error(layers_of(case), pulse, at, found)
    return exact_bar.measure(bars_of(case, reference), history["time"], velocities, heights) | {"wave_error": curves}


def _pulse_of(case: StructureCase, name: str) -> exact_layers.Pulse:
    from reflowshock.fem.loads.structure_pulses import pulse_durations, pulse_of

    load = case.loads[name]
    pulse = pulse_of(load)
    return exact_layers.Pulse(pulse.value, load.duration or max(pulse_durations({name: pulse})))


def _in_range(reference: FrequencyRange, modes: list[dict]) -> dict:
    name, value = f"frequency_{reference.mode}", modes[reference.mode - 1]["frequency"]
    return {f"{name}_low": at_least(value, reference.at_least), f"{name}_high": at_most(value, reference.at_most)}
