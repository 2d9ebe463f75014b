"""Effect of the real joint shapes: the same shock with identical joints under a flat package."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.effect import Decision, Effect, Toggle, decision
from reflowshock.problem import Problem
from reflowshock.workflow.case.run import Findings, Run, metric
from reflowshock.workflow.process.products import read_json

if TYPE_CHECKING:
    from reflowshock.meshing.surface.truncated_sphere import TruncatedSphere
    from reflowshock.workflow.board_drop.board_deflection import DropScene
    from reflowshock.workflow.package.case import BoardDropCase, PackageCase

KEY, FOLDER = "shock.identical_joints", "identical"
PREFIX = "identical_"  # begins the names of meshes and metrics of identical joints


def identical_sphere(case: "PackageCase") -> "TruncatedSphere":
    """Return the truncated sphere of the solder's volume between the wetted discs of the pads, equal for all joints.

    Args:
        case: Case with the volume of the solder, and the radii that it can wet on both pads.
    """
    from reflowshock.meshing.surface.truncated_sphere import TruncatedSphere

    board, package = case.package.board_pad, case.package.package_pad
    return TruncatedSphere.of_volume(case.solder.volume, board.wetted_radius, package.wetted_radius)


class IdenticalJoints(Effect["DropScene"]):
    """Effect: second shock with identical joints."""

    name = "identical_joints"
    adds = "a second shock with identical joints"
    influence = "none on the result: a comparison"
    implementation = "reflowshock.workflow.board_drop.identical_joints.identical_sphere"
    switch = "shock.identical_joints = true, false"
    source = "truncated spheres"
    toggle = Toggle(KEY, True, False)

    def decide(self, drop: "DropScene") -> Decision:
        """Return the setting of the case, with the height of the joints."""
        on = drop.shock.identical_joints
        why = f"{KEY} = {str(on).lower()}"
        if on:
            why += f": truncated spheres, {1e6 * identical_sphere(drop.case).height:.4g} µm high, under a flat package"
        return decision(on, why)


def problems(case: "BoardDropCase") -> Iterator[Problem]:
    """Yield the problem of identical joints that would touch each other.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    package = case.package
    if not case.shock.identical_joints or package.rows * package.columns == 1:
        return
    width = 2.0 * identical_sphere(case).radius
    if width >= package.pitch:
        message = f"is not possible: the truncated spheres would touch, they are {1e3 * width:.4g} mm wide"
        yield Problem(KEY, message, True, f"false, or a package.pitch > {1e3 * width:.4g} mm")


def shape_effect(real: float, identical: float) -> float | None:
    """Return the relative change of a peak stress by real joint shapes.

    Args:
        real: Peak stress with real joints [Pa].
        identical: Peak stress with identical joints [Pa]; without a positive one the result is None.

    Returns:
        ``real / identical - 1``, or None.
    """
    return real / identical - 1.0 if identical > 0.0 else None


def with_comparison(findings: Findings, run: "Run[BoardDropCase]", folder: Path, mode: str) -> Findings:
    """Add the comparison of real and identical joints, by the peak peel stress of the critical joint, to a shock.

    Args:
        findings: Metrics, health checks and effects of the shock with real joints.
        run: Case, and run folder with the pad table after solidification.
        folder: Folder of the shock, with a folder for the mode and a folder ``identical``.
        mode: Mode of the run with real joints, the name of its folder.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.meshing.board.pads import read_pads

    real, flat = (_peaks(folder / name / "history.npz") for name in (mode, FOLDER))
    critical = next(iter(real))
    effect = shape_effect(real[critical], flat[critical])
    gaps = {site.name: site.gap for site in read_pads(run.folder / "reflow/pads.json")}
    metrics = {
        **({} if effect is None else {"shape_effect_on_peak_stress": metric(effect)}),
        "critical_joint_standoff": metric(gaps[critical], "m"),
        "identical_joint_standoff": metric(identical_sphere(run.case).height, "m"),
        "identical_critical_joint": metric(next(iter(flat))),
        "identical_peel_stress": metric(flat[critical], "Pa"),
    }
    result = read_json(folder / FOLDER / "result.json")
    health = {f"{FOLDER}_{name}": check for name, check in result["health"].items()}
    return replace(findings, metrics=findings.metrics | metrics, health=findings.health | health)


def _peaks(history: Path) -> dict[str, float]:
    import numpy as np

    from reflowshock.workflow.report.histories import peel_peaks

    with np.load(history) as arrays:
        return peel_peaks(dict(arrays))
