"""Metrics and health checks of a structure: mesh, motion, comparison with references and between solvers."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reflowshock.problem import Problem
from reflowshock.workflow.case.run import Findings, at_least, at_most, in_words_continued, metric
from reflowshock.workflow.case.text import short
from reflowshock.workflow.structure import exact_bar, exact_cantilever, exact_layers
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.records import compare_with_record
from reflowshock.workflow.structure.references import BarWave, Cantilever, FrequencyRange, LayeredBar, Record

SOLVER_DIFFERENCE = 0.01  # limit of the relative L2 difference of histories, explicit against implicit
JUDGED = ("displacement_difference", "strain_difference")
TWO_SCALE_ERROR = 0.01  # limit of the relative L2 error of displacements, coupled models against a DNS
ERRORS_JUDGED = ("two_scale_displacement_error",)
UNITS = {"wave_speed": "m/s", "tip_deflection": "m", "swing_frequency": "Hz"}

Arrays = Mapping[str, NDArray]


def of_mesh(elements: Mapping[str, int]) -> Findings:
    """Return the numbers of elements of the layers as metrics.

    Args:
        elements: Name of a layer -> number of its elements.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    counts = {f"elements_{layer}": metric(count) for layer, count in elements.items()}
    return Findings(metrics=counts | {"elements": metric(sum(elements.values()))})


def of_motion(results: Mapping[str, dict]) -> Findings:
    """Collect metrics and health checks from the ``result.json`` of each solver.

    Names of all solvers but the first get the solver as a prefix.

    Args:
        results: Solver -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``,
            ``coupling``), the main solver first.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    metrics: dict = {}
    health: dict = {}
    for solver, result in results.items():
        prefix = "" if solver == next(iter(results)) else f"{solver}_"
        metrics |= {prefix + name: value for name, value in result["metrics"].items()}
        health |= {prefix + name: value for name, value in result["health"].items()}
    effects = dict(next(iter(results.values()))["effects"])
    return Findings(metrics, health, effects, in_words_continued(results))


def of_comparison(case: StructureCase, folders: Mapping[str, Path]) -> Findings:
    """Compare the motion with the references of the case, and the solvers with each other.

    Args:
        case: Case of a structure.
        folders: Solver -> folder with its products, which are read; the first solver gives the main metrics.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.fem.output.compare_structures import solver_differences

    histories = {solver: read_history(folder) for solver, folder in folders.items()}
    metrics: dict = {}
    health: dict = {}
    for solver, folder in folders.items():
        prefix = "" if solver == next(iter(folders)) else f"{solver}_"
        motion = Motion(read_modes(folder), histories[solver], read_positions(folder))
        values, checks = compare_with_references(case, motion)
        metrics |= {prefix + name: value for name, value in values.items()}
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
    """Rename differences from a DNS, such as ``strain_difference``, to ``two_scale_strain_error``; values stay.

    Args:
        differences: Name, such as "displacement_difference" -> relative L2 difference of a history.

    Returns:
        Name, such as "two_scale_displacement_error" -> the same value.
    """
    return {f"two_scale_{name.replace('_difference', '_error')}": value for name, value in differences.items()}


def cost_ratio(folders: Mapping[str, Path]) -> dict:
    """Return the cost of the coupled run over the cost of the DNS (one explicit model), without start-up, as metrics.

    Args:
        folders: Folders of the solvers "explicit" (the coupled run) and "dns", whose ``result.json`` is read.

    Returns:
        Metrics ``two_scale_dns_core_ratio`` (processor time) and ``two_scale_dns_time_ratio`` (wall time).
    """
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
    """Return the arrays that a solver wrote to ``history.npz``.

    Args:
        folder: Folder of the solver.

    Returns:
        Name -> array: ``time``, shape (k,) [s], and k rows of each quantity, such as ``displacement@<watch point>``,
        shape (k, 3) [m].
    """
    with np.load(folder / "history.npz") as arrays:
        return dict(arrays)


def read_modes(folder: Path) -> list[dict]:
    """Read the natural modes that a solver wrote, lowest first; empty if it wrote none.

    Args:
        folder: Folder of the solver.

    Returns:
        Records with ``mode`` (number), ``frequency`` [Hz] and ``mass_fraction`` by axis.
    """
    path = folder / "modes.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def read_positions(folder: Path) -> dict[str, tuple[float, float, float]]:
    """Return, by watch point, the position of the node at which its motion is recorded, (x, y, z) [m].

    Args:
        folder: Folder of the solver, whose ``result.json`` is read.
    """
    watch = json.loads((folder / "result.json").read_text(encoding="utf-8"))["model"]["watch"]
    return {name: point["node_at"] for name, point in watch.items()}


@dataclass(frozen=True, slots=True)
class Motion:
    """Computed motion of a structure.

    Attributes:
        modes: Natural modes, lowest first.
        history: Arrays of ``history.npz``.
        positions: Node position at which each watch point is recorded [m].
    """

    modes: list[dict]
    history: Arrays
    positions: Mapping[str, tuple[float, float, float]]


def compare_with_references(case: StructureCase, motion: Motion) -> tuple[dict, dict]:
    """Compare the motion that one solver computed with all references of a case.

    Args:
        case: Case of a structure.
        motion: Natural modes, histories (name -> array over time) and positions (x, y, z) [m] of the watch points.

    Returns:
        Metrics (``value``, ``unit``) by name, and health checks (``value``, ``limit``, ``ok``) by name.
    """
    metrics: dict = {}
    health: dict = {}
    for reference in case.references.values():
        compare = COMPARISONS.get(reference.kind)
        if compare is not None:
            values, checks = compare(case, reference, motion)
            metrics |= values
            health |= checks
    return metrics, health


def _compare_waves(case: StructureCase, reference: BarWave | LayeredBar, motion: Motion) -> tuple[dict, dict]:
    limits = {"wave_speed_error": reference.speed_limit} | dict.fromkeys(
        ("transmitted_velocity_error", "reflected_velocity_error"), reference.amplitude_limit
    )
    return _within_limits(_waves(case, reference, motion), limits)


def _compare_cantilever(case: StructureCase, reference: Cantilever, motion: Motion) -> tuple[dict, dict]:
    tip = motion.history[f"displacement@{reference.tip}"][:, 2]
    measured = exact_cantilever.measure(strip_of(case, reference), motion.history["time"], tip)
    return _within_limits(measured, dict.fromkeys(("tip_deflection_error", "swing_frequency_error"), reference.limit))


def _compare_frequency(_: StructureCase, reference: FrequencyRange, motion: Motion) -> tuple[dict, dict]:
    return {}, _in_range(reference, motion.modes) if motion.modes else {}


def _compare_record(case: StructureCase, reference: Record, motion: Motion) -> tuple[dict, dict]:
    return compare_with_record(case, reference, motion.history), {}


def _within_limits(measured: dict[str, float], limits: Mapping[str, float]) -> tuple[dict, dict]:
    """Return measured values as metrics, and the checks of their errors."""
    metrics = {name: metric(value, UNITS.get(name.removesuffix("_exact"), "")) for name, value in measured.items()}
    return metrics, {name: at_most(abs(measured[name]), limit) for name, limit in limits.items()}


COMPARISONS: dict[str, Callable[[StructureCase, Any, Motion], tuple[dict, dict]]] = {
    "bar_wave": _compare_waves,
    "layered_bar": _compare_waves,
    "cantilever": _compare_cantilever,
    "frequency": _compare_frequency,
    "record": _compare_record,
}


def bars_of(case: StructureCase, reference: BarWave) -> exact_bar.Bars:
    """Return the two layers of a case as bars with their exact solution for a stress wave.

    Args:
        case: Case with two layers.
        reference: Reference that names the half-sine pressure and the watch points.
    """
    from reflowshock.materials.elasticity import elasticity_matrix

    layers, materials = case.structure.layers.values(), case.problem.layer_materials.values()
    lower, upper = (float(elasticity_matrix(material)[2, 2]) for material in materials)
    below, above = (material.density for material in materials)
    first, second = (layer.thickness for layer in layers)
    return exact_bar.Bars((first, second), (lower, upper), (below, above), case.loads[reference.load].duration or 0.0)


def layers_of(case: StructureCase) -> exact_layers.Layers:
    """Return all layers of a case as a layered bar with its exact solution for a stress wave.

    Args:
        case: Case of a structure.
    """
    from reflowshock.materials.elasticity import elasticity_matrix

    materials = case.problem.layer_materials.values()
    return exact_layers.Layers(
        tuple(layer.thickness for layer in case.structure.layers.values()),
        tuple(float(elasticity_matrix(material)[2, 2]) for material in materials),
        tuple(material.density for material in materials),
    )


def truncated_waves(case: StructureCase) -> Iterator[Problem]:
    """Yield a problem for each layered bar whose run ends before half a pulse has passed the watch points.

    Args:
        case: Case of a structure with its references; only references to layered bars are checked.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    for key, reference in case.references.items():
        if reference.kind == "layered_bar":
            roles = zip(("near", "far", "beyond"), [*reference.incident, reference.transmitted], strict=True)
            heights = {role: case.watch[name].at[2] for role, name in roles}
            starts = [start for _, start in exact_layers.passage_times(layers_of(case), heights).values()]
            least = max(starts) + 0.5 * _pulse_of(case, reference.load).duration
            if case.dynamics.duration < least:
                message = f"the run ends before the waves of references.{key} have passed the watch points"
                yield Problem("dynamics.duration", message, short(case.dynamics.duration), f">= {short(least)}")


def strip_of(case: StructureCase, reference: Cantilever) -> exact_cantilever.Strip:
    """Return the only layer of a case as a cantilever strip under pressure, with its exact solution.

    Args:
        case: Case with one layer.
        reference: Reference that names the load.
    """
    from reflowshock.materials.elasticity import elasticity_matrix

    (material,) = case.problem.layer_materials.values()
    pressure, body = case.loads[reference.load].peak or 0.0, case.structure
    return exact_cantilever.Strip(body.length, body.thickness, elasticity_matrix(material), material.density, pressure)


def wave_points(reference: BarWave | LayeredBar) -> list[str]:
    """Return the names of the three watch points of a bar, the lowest first.

    Args:
        reference: Reference solution of a bar with its watch points.

    Returns:
        Two points for the incident and reflected wave, and one for the transmitted wave.
    """
    return [*reference.incident, reference.transmitted]


def exact_velocities(
    case: StructureCase,
    reference: BarWave | LayeredBar,
    positions: Mapping[str, tuple[float, float, float]],
    times: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the exact velocities at all ``wave_points``, concatenated, shape (points * n,) [m/s].

    Args:
        case: Case of a structure.
        reference: Reference solution of a bar.
        positions: Position (x, y, z) of each watch point by name [m].
        times: Times, shape (n,) [s].
    """
    layers, pulse = layers_of(case), _pulse_of(case, reference.load)
    return np.concatenate([layers.velocity(positions[name][2], times, pulse.value) for name in wave_points(reference)])


def _waves(case: StructureCase, reference: BarWave | LayeredBar, motion: Motion) -> dict[str, float]:
    points, history = wave_points(reference), motion.history
    velocities = [history[f"velocity@{name}"][:, 2] for name in points]
    heights = [motion.positions[name][2] for name in points]
    roles = ("near", "far", "beyond")
    by_role = dict(zip(roles, velocities, strict=True)) | {"time": history["time"]}
    height_by_role, pulse = dict(zip(roles, heights, strict=True)), _pulse_of(case, reference.load)
    if reference.kind == "layered_bar":
        return exact_layers.measure(layers_of(case), pulse, height_by_role, by_role)
    error = exact_layers.wave_error(layers_of(case), pulse, height_by_role, by_role)
    return exact_bar.measure(bars_of(case, reference), history["time"], velocities, heights) | {"wave_error": error}


def _pulse_of(case: StructureCase, name: str) -> exact_layers.Pulse:
    from reflowshock.fem.loads.structure_pulses import pulse_durations, pulse_of

    load = case.loads[name]
    pulse = pulse_of(load)
    return exact_layers.Pulse(pulse.value, load.duration or max(pulse_durations({name: pulse})))


def _in_range(reference: FrequencyRange, modes: list[dict]) -> dict:
    name, value = f"frequency_{reference.mode}", modes[reference.mode - 1]["frequency"]
    return {f"{name}_low": at_least(value, reference.at_least), f"{name}_high": at_most(value, reference.at_most)}
