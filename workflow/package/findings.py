"""Metrics and health checks of the stages of a package, in the form of ``summary.json``, with their limits."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reflowshock.particles.core.geometry import LARGEST_WIDTH_CHANGE
from reflowshock.workflow.case.run import Findings, at_least, at_most, in_words_continued, metric, worst

WIDTH_ERROR = 0.01  # relative error of joint widths against the Young-Laplace solution
VOLUME_DRIFT = 1.0e-3  # relative change of a joint's volume during reflow
ENERGY_IMBALANCE = 0.02  # relative to the initial surface energy of a joint
SURFACE_VOLUME_ERROR = 1.0e-3  # relative volume error of a closed surface against the particles
VOLUME_ERROR = 0.003  # relative volume error of the hexahedra against the closed surface
SCALED_JACOBIAN = 0.2
STRESS_ERROR = 0.10  # relative L2 error of the critical joint's von Mises history, two-scale against DNS
LEAST_STRESS = 0.1  # share of the peak stress that a short DNS must reach to be compared
COMPARED = "compared_duration"  # metric of a DNS that ends before the shock

Records = Mapping[str, Mapping[str, Any]]


def of_geometry(joints: int, elements: Mapping[str, int]) -> Findings:
    """Return the number of joints, and the number of hexahedra in each part, as metrics.

    Args:
        joints: Number of joints.
        elements: Name of a part -> number of its hexahedra.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    counts = {f"elements_{part}": metric(count) for part, count in elements.items()}
    return Findings(metrics={"joint_count": metric(joints), **counts})


def of_reflow(joints: Records, effects: Mapping[str, Any]) -> Findings:
    """Return metrics and checks of joint shapes: volume drift, width against Young-Laplace, verdicts.

    Open joints and joints that lean too much for a coaxial reference are not compared. Joints with a given surface
    count only by width and bridging.

    Args:
        joints: Record of each joint, by name, from ``joints.json``.
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    flowed = [joint for joint in joints.values() if "given" not in joint]

    def values(name: str) -> list[float]:
        return [joint["metrics"][name]["value"] for joint in joints.values()]

    def count(verdict: str) -> int:
        return sum(joint["verdict"] == verdict for joint in joints.values())

    closed = [joint for joint in flowed if joint["verdict"] != "open" and _has_reference(joint["metrics"])]
    width_error = worst(joint["metrics"]["width_error"]["value"] for joint in closed)
    drift = worst(joint["metrics"]["volume_drift"]["value"] for joint in flowed)
    motion = _of_motion([joint["metrics"] for joint in flowed if "energy_imbalance" in joint["metrics"]])
    return Findings(
        metrics={
            "distinct_shapes": metric(len({joint["shape"] for joint in flowed})),
            "joint_width_min": metric(min(values("max_width")), "m"),
            "joint_width_max": metric(max(values("max_width")), "m"),
            "joint_width_error_max": metric(width_error),
            "joints_compared_in_width": metric(len(closed)),
            "joint_volume_drift_max": metric(drift),
        }
        | motion.metrics,
        health={
            "joint_width_error_max": at_most(width_error, WIDTH_ERROR),
            "joint_volume_drift_max": at_most(drift, VOLUME_DRIFT),
            "joints_bridged": at_most(count("bridged"), 0),
            "joints_open": at_most(count("open"), 0),
            "joints_not_ok": at_most(len(joints) - count("ok") - count("given"), 0),
        }
        | motion.health,
        effects=dict(effects),
    )


def _of_motion(joints: Sequence[Mapping[str, Any]]) -> Findings:
    """Return metrics and checks of joints that flowed with inertia; empty without any.

    Joints carried through load steps have no time at rest and no losses.
    """
    if not joints:
        return Findings()

    def values(name: str) -> list[float]:
        return [joint[name]["value"] for joint in joints if name in joint]

    imbalance, lost = worst(values("energy_imbalance")), sum(values("particles_lost"))
    resting = int(sum(values("at_rest")))
    losses = {
        "joint_time_at_rest_max": ([time for time in values("time_at_rest") if time == time], "s"),
        "joint_viscous_loss_max": (values("viscous_loss"), ""),
        "joint_smoothing_loss_max": (values("smoothing_loss"), ""),
    }
    return Findings(
        metrics={
            "joints_at_rest": metric(resting),
            "joint_steps_max": metric(max(values("steps"), default=0)),
            "joint_energy_imbalance_max": metric(imbalance),
            "joint_particles_lost": metric(int(lost)),
        }
        | {name: metric(max(numbers), unit) for name, (numbers, unit) in losses.items() if numbers},
        health={
            "joint_energy_imbalance_max": at_most(imbalance, ENERGY_IMBALANCE),
            "joint_particles_lost": at_most(int(lost), 0),
            "joints_in_motion": at_most(len(joints) - resting, 0),
        },
    )


def _has_reference(metrics: Mapping[str, dict]) -> bool:
    """Return whether a joint leans so little that a coaxial joint is a reference for its width."""
    return metrics.get("width_reference_error", {"value": 0.0})["value"] <= LARGEST_WIDTH_CHANGE


def of_surface(surfaces: Records) -> Findings:
    """Return metrics and checks of closed surfaces: volume error, and volume change of given surfaces.

    Args:
        surfaces: Measures of each surface, by name, from ``surfaces.json``.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    error = worst(surface["volume_error"] for surface in surfaces.values() if "given" not in surface)
    changes = [surface["volume_change"] for surface in surfaces.values() if "given" in surface]
    stretched = {"given_surface_volume_change_max": metric(worst(changes))} if changes else {}
    return Findings(
        metrics={"surface_volume_error_max": metric(error)} | stretched,
        health={"surface_volume_error_max": at_most(error, SURFACE_VOLUME_ERROR)},
    )


def of_solder_mesh(qualities: Mapping[str, Records], effects: Mapping[str, Any]) -> Findings:
    """Return metrics and checks of joint meshes: worst volume error, scaled Jacobian and critical time step.

    Args:
        qualities: Prefix of the metrics for a kind of mesh, empty for fine joints -> joint -> record with
            ``volume_error``, ``minimum_scaled_jacobian`` and ``critical_time_step`` [s].
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``, for effects that
            add joint meshes.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    metrics: dict[str, dict] = {}
    health: dict[str, dict] = {}
    for kind, quality in qualities.items():
        volume_error = worst(joint["volume_error"] for joint in quality.values())
        jacobian = min(joint["minimum_scaled_jacobian"] for joint in quality.values())
        step = min(joint["critical_time_step"] for joint in quality.values())
        metrics |= {
            f"{kind}joint_volume_error_max": metric(volume_error),
            f"{kind}joint_scaled_jacobian_min": metric(jacobian),
            f"{kind}joint_critical_time_step": metric(step, "s"),
        }
        health |= {
            f"{kind}joint_volume_error_max": at_most(volume_error, VOLUME_ERROR),
            f"{kind}joint_scaled_jacobian_min": at_least(jacobian, SCALED_JACOBIAN),
        }
    return Findings(metrics, health, dict(effects))


def of_shock(results: Mapping[str, dict], folder: Path, thickness: float) -> Findings:
    """Return metrics and checks of the shock, and of two-scale against DNS (one fine model) if both were run.

    Args:
        results: Mode -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``),
            the main mode first.
        folder: Folder of the shock, with a folder for each mode.
        thickness: Thickness of the board [m]; small kinematics need a much smaller deflection.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    first = next(iter(results))
    metrics, health = dict(results[first]["metrics"]), dict(results[first]["health"])
    metrics["deflection_over_thickness"] = metric(metrics["peak_board_displacement"]["value"] / thickness)
    metrics |= _coupling_metrics(results[first])
    for mode, result in results.items():
        if mode != first:
            health |= {f"{mode}_{name}": value for name, value in result["health"].items()}
    if len(results) == 2:
        metrics |= _comparison(results, folder)
        if metrics.get("compared_stress", metric(1.0))["value"] >= LEAST_STRESS:
            error = metrics["critical_joint_stress_error"]["value"]
            health["critical_joint_stress_error"] = at_most(error, STRESS_ERROR)
        if "critical_joint_coarse" in metrics:
            health["critical_joint_coarse"] = at_most(metrics["critical_joint_coarse"]["value"], 0)
    return Findings(metrics, health, dict(results[first]["effects"]), in_words_continued(results))


def fine_joints_of(result: Mapping[str, Any]) -> list[str] | None:
    """Return the names of the fine joints of a run with coarse joints; None if all are fine.

    Args:
        result: Content of ``result.json`` of the run.
    """
    fine = result.get("coupling", {}).get("fine_joints", "all")
    return None if isinstance(fine, str) else list(fine)


def _coupling_metrics(result: Mapping[str, Any]) -> dict:
    """Return metrics of the coupling of a two-scale run: element share, overhead, load of the ranks."""
    coupling = result.get("coupling", {})
    balance = coupling.get("placement", {})
    values = {
        "meso_share": coupling.get("meso_share"),
        "coupling_overhead": balance.get("coupling_overhead"),
        "busy_share": balance.get("busy_share"),
    }
    return {name: metric(value) for name, value in values.items() if value is not None}


def ideal_ratio(coupling: Mapping[str, Any], dns: Mapping[str, Any]) -> float | None:
    """Return the ideal time ratio two-scale / DNS (one model with all joints fine): equal cost of updates, no overhead.

    Args:
        coupling: Entry ``coupling`` of the two-scale ``result.json``; without ``levels`` the result is None.
        dns: Entry ``model`` of the DNS, which takes the smallest ``step`` [s] in all ``elements`` (number by role).
    """
    rates = [record["elements"] / record["step"] for record in coupling.get("levels", ())]
    return sum(rates) * dns["step"] / sum(dns["elements"].values()) if rates else None


def _comparison(results: Mapping[str, dict], folder: Path) -> dict:
    """Return metrics of two-scale against DNS: errors of histories and ratios of wall times."""
    from reflowshock.fem.output.compare import compare_histories

    files = [folder / mode / "history.npz" for mode in ("two_scale", "dns")]
    errors = compare_histories(files[0], files[1], fine_joints_of(results["two_scale"]))
    seconds = {mode: _time(result, "window_seconds") for mode, result in results.items()}
    cores = {mode: _time(result, "window_core_seconds") for mode, result in results.items()}
    ratios = {
        "two_scale_dns_core_ratio": cores["two_scale"] / cores["dns"],
        "two_scale_dns_time_ratio": seconds["two_scale"] / seconds["dns"],
    }
    ideal = ideal_ratio(results["two_scale"].get("coupling", {}), results["dns"]["model"])
    ratios |= {} if ideal is None else {"two_scale_ideal_ratio": ideal}
    search = folder / "coarse/result.json"
    if search.exists():
        ratios["coarse_run_dns_time_ratio"] = (
            _time(json.loads(search.read_text(encoding="utf-8")), "window_seconds") / seconds["dns"]
        )
    return {name: metric(value, "s" if name == COMPARED else "") for name, value in (errors | ratios).items()}


def _time(result: Mapping[str, Any], metric_name: str) -> float:
    """Return the time of a run's windows relative to one window, because windows of two runs may differ."""
    seconds: float = result["metrics"][metric_name]["value"]
    return seconds / result["model"]["window"]
