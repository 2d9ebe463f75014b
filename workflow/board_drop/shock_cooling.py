"""The state in which shocks begin: cooling from solidification, where the case asks for residual stress."""

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

SCENE = ("meshes", "coarse_joints", "shock", "materials")  # of a request: what cooling depends on, too
RESULT, IDENTITY = "result.json", "identity.txt"
FIRST = {"residual_two_scale": 0, "residual": 1}  # folders of coolings; the first gives the reported figures


def problems(case: BoardDropCase) -> Iterator[Problem]:
    """Find shocks that cannot begin with the stress of cooling."""
    if case.cooled and case.shock.numerics.kinematics == "corotational":
        message = "cannot be combined with thermal.effects.residual_stress = on, which needs a path"
        yield Problem("shock.numerics.kinematics", message, "corotational", "finite, auto")
    if case.cooled and case.shock.coupling.direction == "one_way" and "two_scale" in case.shock.numerics.modes:
        message = "cannot be combined with thermal.effects.residual_stress = on: the macro model has its joints twice"
        yield Problem("shock.coupling.direction", message, "one_way", "two_way")


def begun(run: Run[BoardDropCase], folder: Path, request: dict, prefix: str = "") -> dict:
    """Return the request of a mode that begins with the stress of cooling; computed first, once for equal meshes.

    Args:
        run: case, cores.
        folder: of the shock.
        request: what the package fem reads as input of the mode.
        prefix: of its meshes.

    Raises:
        LaunchError: the run failed; the message has its last words.
    """
    if not run.case.cooled:
        return request
    name = cooling_name(request, prefix)
    if not (folder / name).exists():
        kept = run.checkpoints("shock").resolve() / name
        _cool(run, kept, request)
        shutil.copytree(kept, folder / name)
    return request | {"cooling": str((folder / name / "cooling.npz").resolve())}


def cooling_name(request: dict, prefix: str) -> str:
    """Return the folder of a mode's cooling: modes with all joints fine have the same."""
    return f"{prefix}residual" + ("" if request["shock"]["coupling"]["fine_joints"] == "all" else f"_{request['mode']}")


def _cool(run: Run[BoardDropCase], folder: Path, request: dict) -> None:
    """Compute what cooling does, unless a stage that was killed has: a shock continues only from the same bits."""
    from reflowshock.fem.parallel.checkpoint_files import digest_of_files

    thermal = run.case.thermal
    assert thermal is not None
    cooling = {name: request[name] for name in SCENE if name in request}
    shock = request["shock"] | {"modes": 0}  # natural modes are those of the first mode of the run alone
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


def with_cooling(found: Findings, case: BoardDropCase, folder: Path) -> Findings:
    """Add to what the shocks found what the cooling of the first mode found, and the checks of all others."""
    paths = sorted(folder.glob(f"*residual*/{RESULT}"), key=lambda path: FIRST.get(path.parent.name, len(FIRST)))
    metrics, health = dict(found.metrics), dict(found.health)
    for number, path in enumerate(paths):
        result, prefix = json.loads(path.read_text(encoding="utf-8")), f"{path.parent.name}_" if number else ""
        metrics = metrics if number else result["metrics"] | metrics
        health |= {f"{prefix}{check}": value for check, value in result["health"].items()}
    return replace(found, metrics=metrics, health=health, effects={**found.effects, **effect(case)})


def effect(case: BoardDropCase) -> dict:
    """Return whether shocks begin with the stress of cooling, and why; nothing where nothing is heated."""
    thermal = case.thermal
    if thermal is None:
        return {}
    cooling = f": cooling by {thermal.solidification - thermal.final:.4g} K"
    wanted = ResidualStress.by_setting(thermal, f"{cooling}; an upper bound: solder relaxes at room temperature")
    return {ResidualStress.name: wanted}


def forecast(case: BoardDropCase, parts: Mapping[str, PartForecast]) -> tuple[dict, float]:
    """Return the effect with its predicted cost, and the wall time [s] of all coolings.

    Args:
        case: the case.
        parts: of the mesh with all joints fine; modes with other fine joints cool apart.
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
