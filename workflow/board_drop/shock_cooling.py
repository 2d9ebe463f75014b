"""Initial state of shocks with residual stress: cooling from solidification to the temperature of the shock."""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.fem.estimates.thermal_effects import ResidualStress
from reflowshock.kernel_cache import digest
from reflowshock.problem import Problem
from reflowshock.workflow.board_drop.part_forecast import PartForecast, role_of
from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.case.text import duration
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.fem_launch import run_fem

if TYPE_CHECKING:
    from reflowshock.fem.estimates.solver_cost import SolverCost

SCENE = ("meshes", "coarse_joints", "shock", "materials")  # keys of a request that cooling depends on
RESULT, IDENTITY = "result.json", "identity.txt"
FIRST = {"residual_two_scale": 0, "residual": 1}  # order of the folders of coolings; the first gives the metrics


def problems(case: BoardDropCase) -> Iterator[Problem]:
    """Yield problems of settings of the shock that exclude residual stress.

    Yields:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; nothing for a valid case.
    """
    if case.cooled and case.shock.numerics.kinematics == "corotational":
        message = "cannot be combined with thermal.effects.residual_stress = on, whose stress depends on the path"
        yield Problem("shock.numerics.kinematics", message, "corotational", "finite, auto")
    if case.cooled and case.shock.coupling.direction == "one_way" and "two_scale" in case.shock.numerics.modes:
        message = "cannot be combined with thermal.effects.residual_stress = on: the macro model has its joints twice"
        yield Problem("shock.coupling.direction", message, "one_way", "two_way")


def with_initial_stress(run: Run[BoardDropCase], folder: Path, request: dict, prefix: str = "") -> dict:
    """Compute the cooling of a mode, unless a mode with equal meshes has done so; return the request that refers to it.

    Args:
        run: Case and cores; without residual stress the request is returned as it is.
        folder: Folder of the shock, in which the cooling is computed in a subfolder.
        request: Input of the package ``fem`` for the mode.
        prefix: Prefix of the mesh names of the mode; empty for real joints.

    Returns:
        Copy of the request that names the file of the initial stress, or the request itself without residual stress.

    Raises:
        LaunchError: The run failed; the message contains its last lines.
    """
    if not run.case.cooled:
        return request
    name = cooling_name(request, prefix)
    if not (folder / name).exists():
        computed = run.checkpoints("shock").resolve() / name
        _cool(run, computed, request)
        shutil.copytree(computed, folder / name)
    return request | {"cooling": str((folder / name / "cooling.npz").resolve())}


def cooling_name(request: dict, prefix: str) -> str:
    """Return the name of the folder with the cooling of a mode; modes with all joints fine share one.

    Args:
        request: Input of the package ``fem`` for the mode; ``mode`` and ``shock.coupling.fine_joints`` are read.
        prefix: Prefix of the mesh names of the mode; empty for real joints.
    """
    return f"{prefix}residual" + ("" if request["shock"]["coupling"]["fine_joints"] == "all" else f"_{request['mode']}")


def _cool(run: Run[BoardDropCase], folder: Path, request: dict) -> None:
    """Compute the cooling into a folder, unless it has been computed with the same input.

    A shock continues from its checkpoints only with the same bits, so a restarted stage reuses the cooling.
    """
    from reflowshock.fem.parallel.checkpoint_files import digest_of_files

    thermal = run.case.thermal
    assert thermal is not None
    cooling = {name: request[name] for name in SCENE if name in request}
    shock = request["shock"] | {"modes": 0}  # only the first mode of the run computes natural modes
    cooling |= {"shock": shock, "mode": "cooling", "change": thermal.final - thermal.solidification}
    files = digest_of_files(
        *(Path(name) for name in (*request["meshes"], *filter(None, [request.get("coarse_joints")])))
    )
    identity = hashlib.sha256(f"{json.dumps(cooling, sort_keys=True)} {files} {digest()}".encode()).hexdigest()
    written = folder / IDENTITY
    if written.exists() and written.read_text(encoding="utf-8") == identity:
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    run_fem(run, folder, cooling, "cooling to the shock's temperature")
    written.write_text(identity, encoding="utf-8")


def with_cooling(findings: Findings, case: BoardDropCase, folder: Path) -> Findings:
    """Add the metrics of the first mode's cooling and the health checks of all coolings to a shock.

    Args:
        findings: Metrics, health checks and effects of the shock.
        case: Case of a board drop.
        folder: Folder of the shock; without coolings in it only the effect is added.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    paths = sorted(folder.glob(f"*residual*/{RESULT}"), key=lambda path: FIRST.get(path.parent.name, len(FIRST)))
    metrics, health = dict(findings.metrics), dict(findings.health)
    for number, path in enumerate(paths):
        result, prefix = json.loads(path.read_text(encoding="utf-8")), f"{path.parent.name}_" if number else ""
        metrics = metrics if number else result["metrics"] | metrics
        health |= {f"{prefix}{check}": value for check, value in result["health"].items()}
    return replace(findings, metrics=metrics, health=health, effects={**findings.effects, **effect(case)})


def effect(case: BoardDropCase) -> dict:
    """Return the decision on residual stress (``on``, ``why``) by effect name; empty without ``[thermal]``."""
    thermal = case.thermal
    if thermal is None:
        return {}
    cooling = f": cooling by {thermal.solidification - thermal.final:.4g} K"
    remark = f"{cooling}; an upper bound: solder relaxes at room temperature"
    return {ResidualStress.name: ResidualStress.setting(thermal, remark)}


def forecast(case: BoardDropCase, parts: Mapping[str, PartForecast]) -> tuple[dict, float]:
    """Return the decision on residual stress with its predicted cost, and the wall time of all coolings [s].

    Args:
        case: Case of a board drop.
        parts: Parts of the mesh with all joints fine; modes with coarse joints have coolings of their own.

    Returns:
        Decision by the name of the effect, empty for a case without ``[thermal]``; zero seconds without cooling.
    """
    effects = effect(case)
    if not case.cooled:
        return effects, 0.0
    cost = _cost(case, parts)
    models = len(case.shock.numerics.modes) if case.shock.coupling.fine_joints != "all" else 1
    models += int(case.shock.identical_joints)
    effects["residual_stress"]["why"] += (
        f"; predicted: about {duration(cost.seconds)}, {1e-9 * cost.memory:.2g} GB for the factor"
    )
    return effects, models * cost.seconds


def _cost(case: BoardDropCase, parts: Mapping[str, PartForecast]) -> "SolverCost":
    """Predict the cost of one cooling."""
    from reflowshock.fem.estimates.solver_cost import cooling_cost

    yielding = {role for role, material in case.materials.by_role.items() if material.plasticity is not None}
    path = sum(part.elements for name, part in parts.items() if role_of(name) in yielding)
    return cooling_cost(sum(part.elements for part in parts.values()), path)
