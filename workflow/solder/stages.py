"""Stage ``reflow`` of solder alone, one function for each kind of case; its metrics and health checks."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from reflowshock.workflow.case.run import Findings, Run, at_most, metric
from reflowshock.workflow.process.products import write_json
from reflowshock.workflow.process.terminal import progress_bar
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase

# Limits of relative errors; shapes, pressures and forces are compared with the Young-Laplace solution.
VOLUME_DRIFT = 1.0e-3
DROP_ERROR = 0.01  # height and width of a drop
PRESSURE_ERROR = 0.005  # mean pressure of a drop
PRESSURE_SCATTER = 0.01  # pressures in a drop, over the capillary pressure
ANGLE_EXCESS = 3.0  # contact angles beyond the receding and the advancing one [deg]
PERIOD_ERROR = 0.01  # oscillating drop, against Reid: exact at small amplitude
DECAY_RATE_ERROR = 0.10  # the same
JOINT_ERROR = 0.005  # width and waist of a joint
AXIAL_FORCE_ERROR = 0.02  # joint, over pi times radius times surface tension
CAPILLARY_NUMBER = 1.0e-4  # largest speed of a surface at rest
ONE_JOINT_NAMES = {
    "standoff": "height",
    "width_error": "max_width_error",
    "contact_radius_board": "contact_radius",
    "contact_angle_board": "contact_angle",
    "contact_radius_package": "contact_radius_top",
    "contact_angle_package": "contact_angle_top",
}

Numbers = Mapping[str, tuple[float, str]]


def reflow_drop(run: Run[DropCase], folder: Path) -> Findings:
    """Melt a cube of solder on a wall or pad, or without a wall, until it is at rest.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.drop_at_rest import drop_to_rest
    from reflowshock.particles.scenes.products import write_body

    drop, solder = run.case.drop, run.case.molten
    checkpoint = Checkpoint(run.checkpoints("reflow") / "drop", (drop, solder))
    with progress_bar(f"reflow of {drop.particles} particles") as progress:
        result = drop_to_rest(drop, solder, progress, checkpoint)
    write_body(folder, result.shape, result.reference)
    findings = judge_drop(result.shape.metrics, result.shape.verdict, result.effects)
    return replace(findings, continued="the drop" if checkpoint.continued else "")


def reflow_joint(run: Run[JointCase], folder: Path) -> Findings:
    """Melt the solder of one joint between its pads until it is at rest, at each position of the package.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.joint_at_rest import joint_to_rest
    from reflowshock.particles.scenes.products import write_body

    joint, solder = run.case.joint, run.case.molten
    checkpoints: list[Checkpoint] = []

    def checkpoint(position: int) -> Checkpoint:
        checkpoints.append(Checkpoint(run.checkpoints("reflow") / f"joint-{position}", (joint, solder)))
        return checkpoints[-1]

    with progress_bar("reflow of a joint") as progress:
        result = joint_to_rest(joint, solder, progress, checkpoint)
    write_body(folder, result.shape, result.reference)
    if result.path_rows:
        write_json(folder / "path.json", result.path_rows)
    findings = judge_joint(result.shape.metrics, result.shape.verdict, result.effects)
    return replace(findings, continued="the joint" if any(used.continued for used in checkpoints) else "")


def reflow_drops(run: Run[DropsCase], folder: Path) -> Findings:
    """Compute two drops until they, or the merged drop, are at rest.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.drop_pair import pair_to_rest
    from reflowshock.particles.scenes.products import write_body

    drops, solder = run.case.drops, run.case.molten
    checkpoint = Checkpoint(run.checkpoints("reflow") / "drops", (drops, solder))
    with progress_bar("reflow of two drops") as progress:
        result = pair_to_rest(drops, solder, progress, checkpoint)
    write_body(folder, result.shape, result.reference)
    findings = judge_drops(result.shape.metrics, 1 if drops.merge else 2, result.effects)
    return replace(findings, continued="the drops" if checkpoint.continued else "")


def reflow_oscillation(run: Run[OscillationCase], folder: Path) -> Findings:
    """Compute the oscillation of a free drop.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.parameters.effects import decide_oscillation
    from reflowshock.particles.scenes.free_drop import solve_oscillation
    from reflowshock.particles.scenes.products import write_body

    oscillation, solder = run.case.oscillation, run.case.molten
    checkpoint = Checkpoint(run.checkpoints("reflow") / "drop", (oscillation, solder))
    with progress_bar(f"oscillation of {oscillation.particles} particles") as progress:
        shape = solve_oscillation(oscillation, solder, progress, checkpoint)
    write_body(folder, shape, None)
    findings = judge_oscillation(shape.metrics, decide_oscillation(solder))
    return replace(findings, continued="the drop" if checkpoint.continued else "")


def judge_drop(metrics: Numbers, verdict: str, effects: Mapping[str, Any]) -> Findings:
    """Check a drop by volume, rest and the Young-Laplace shape; overflow is reported, but does not fail.

    Args:
        metrics: Name -> value and SI unit.
        verdict: Verdict on the shape, such as "ok".
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    limits = {
        "height_error": DROP_ERROR,
        "max_width_error": DROP_ERROR,
        "mean_pressure_error": PRESSURE_ERROR,
        "pressure_scatter": PRESSURE_SCATTER,
        "contact_angle_excess": ANGLE_EXCESS,
    }
    return Findings(_finite(metrics) | {"verdict": metric(verdict)}, _at_rest(metrics, limits), dict(effects))


def judge_joint(metrics: Numbers, verdict: str, effects: Mapping[str, Any]) -> Findings:
    """Check one joint by volume, rest, verdict and, if it is axisymmetric, the Young-Laplace shape.

    A package that is pulled off leaves an open joint. This is a valid result, checked by the remaining drops.

    Args:
        metrics: Name -> (value, SI unit), such as ``volume_drift`` and ``width_error``; missing ones are not checked.
        verdict: Verdict on the shape, such as "ok" or "open".
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    named = {ONE_JOINT_NAMES.get(name, name): number for name, number in metrics.items()}
    limits = {"max_width_error": JOINT_ERROR, "waist_error": JOINT_ERROR}
    if "force_balance_error" in metrics:  # floating package: the force is prescribed, the height computed
        limits |= {"collapse_height_error": JOINT_ERROR, "force_balance_error": AXIAL_FORCE_ERROR}
    else:
        limits["axial_force_error"] = AXIAL_FORCE_ERROR
    health = _at_rest(named, limits | {f"drop_height_error_{pad}": DROP_ERROR for pad in ("board", "package")})
    if "time_at_break" not in named or "volume_package" not in named:
        verdict_check = "joints_not_ok" if verdict == "ok" else f"joint_{verdict}"
        health |= {verdict_check: at_most(int(verdict != "ok"), 0)}
    return Findings(_finite(named) | {"verdict": metric(verdict)}, health, dict(effects))


def judge_drops(metrics: Numbers, expected: int, effects: Mapping[str, Any]) -> Findings:
    """Check drops by their number, volume, rest and exact shapes.

    Args:
        metrics: Name -> value and SI unit.
        expected: Number of drops at the end.
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    limits = {"height_error": DROP_ERROR, "max_width_error": DROP_ERROR, "radius_error": DROP_ERROR}
    unexpected = abs(int(metrics["drops_left"][0]) - expected)
    health = _at_rest(metrics, limits) | {"drops_not_as_meant": at_most(unexpected, 0)}
    return Findings(_finite(metrics), health, dict(effects))


def judge_oscillation(metrics: Numbers, effects: Mapping[str, Any]) -> Findings:
    """Check an oscillating drop by volume, and by the period and decay rate of Reid.

    Args:
        metrics: Name -> value and SI unit.
        effects: Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    limits = {"period_error": PERIOD_ERROR, "decay_rate_error": DECAY_RATE_ERROR}
    return Findings(_finite(metrics), _at_rest(metrics, limits), dict(effects))


def _finite(metrics: Numbers) -> dict:
    """Return the metrics without NaN: errors are NaN without a reference."""
    return {name: metric(value, unit) for name, (value, unit) in metrics.items() if value == value}


def _at_rest(metrics: Numbers, limits: Mapping[str, float]) -> dict:
    """Return checks of volume and, for a body at rest, of its capillary number and errors."""
    finite, at_rest = _finite(metrics), metrics.get("at_rest", (1.0, ""))[0]
    rest_limits = {"capillary_number_at_rest": CAPILLARY_NUMBER, **limits} if at_rest else {}
    limits = {"volume_drift": VOLUME_DRIFT, **rest_limits}
    return {name: at_most(abs(metrics[name][0]), limit) for name, limit in limits.items() if name in finite}
