"""Kinds of case: one record per kind with its model, checks, stages, forecast and report."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from rich.console import RenderableType

from reflowshock.effect import Effect
from reflowshock.fem.estimates.structure_effects import STRUCTURE_EFFECTS
from reflowshock.fem.estimates.thermal_effects import HEATED_EFFECTS
from reflowshock.names import find_nearest
from reflowshock.particles.parameters.effects import LIQUID_EFFECTS
from reflowshock.problem import Problem
from reflowshock.workflow.board_drop import problems as package_checks
from reflowshock.workflow.board_drop import stages as package_stages
from reflowshock.workflow.board_drop.forecast import (
    board_drop_size,
    forecast_board_drop,
    forecast_package,
    package_size,
)
from reflowshock.workflow.board_drop.plan import board_drop_tables, package_tables
from reflowshock.workflow.board_drop.shock_effects import SHOCK_EFFECTS
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.forecast import SECONDS_OF_REPORT, SECONDS_OF_STAGE, Size
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.case.run import Findings, Run, StageFunction
from reflowshock.workflow.case.stage import ERRORS, SHOCK
from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy
from reflowshock.workflow.convergence.drop_companions import drop_companions, drop_sizes
from reflowshock.workflow.convergence.structure_companions import structure_companions, structure_sizes
from reflowshock.workflow.flows.flow_kind import STAGE as FLOW_STAGE
from reflowshock.workflow.flows.flow_kind import FlowCase, FlowKind
from reflowshock.workflow.flows.forecast import flow_size, flow_tables, forecast_flow
from reflowshock.workflow.flows.registry import FLOWS
from reflowshock.workflow.flows.stage import run_flow
from reflowshock.workflow.package.case import BoardDropCase, PackageCase
from reflowshock.workflow.process.machine_speed import slowness
from reflowshock.workflow.reflow.stage import reflow
from reflowshock.workflow.report.errors import Discretisation
from reflowshock.workflow.solder import case as solder_case
from reflowshock.workflow.solder import stages as solder_stages
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase, SolderCase
from reflowshock.workflow.solder.forecast import forecast_solder, solder_size, solder_tables
from reflowshock.workflow.structure import forecast as structure_forecast
from reflowshock.workflow.structure import stages as structure_stages
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.forecast import structure_tables
from reflowshock.workflow.structure.problems import structure_problems


class Forecast(Protocol):
    """Interface of the forecasts of all kinds of case."""

    @property
    def effects(self) -> Mapping[str, Any]:
        """Decisions by effect: "on", "why" and, if predicted, "influence"."""

    @property
    def seconds(self) -> Mapping[str, float]:
        """Predicted wall times by stage [s], for stages with a prediction."""


@dataclass(frozen=True, slots=True)
class Kind:
    """Kind of case.

    Attributes:
        case: Model of its case files.
        problems: Check for combinations of parameters that are impossible.
        stages: Functions of the stages except the report, by name, in order.
        forecast: Prediction of effects and cost from the parameters.
        size: Prediction of time and memory of the stages.
        plan: Further tables of the plan, from a case and its forecast.
        acts: Subject of its effects in headings.
        report: Function that adds sections to the context of a report: run folder, case, context, summary.
        study: Convergence study of a case.
        effects: Effects that may act.
        companions: Companions of a case by name, from the product of its shock; None before the shock.
        conclude: Function that adds conclusions to a summary: run folder, case, summary, discretisation errors.
    """

    case: type[Case]
    problems: Callable[[Any], list[Problem]]
    stages: Mapping[str, StageFunction]
    forecast: Callable[[Any], Forecast]
    size: Callable[[Any], Size]
    plan: Callable[[Any, Any], Iterable[RenderableType]]
    acts: str
    report: Callable[[Path, Any, dict, dict], None]
    study: Callable[[Any], ConvergenceStudy]
    effects: Sequence[Effect]
    companions: Callable[[Any, Path | None], Mapping[str, Case]] = lambda case, shock: {}
    conclude: Callable[[Path, Any, dict, Discretisation], None] = lambda folder, case, summary, errors: None

    @property
    def name(self) -> str:
        """Name of the table that identifies this kind of case file."""
        return self.case.kind


def _package_report(run_folder: Path, case: PackageCase, context: dict, summary: dict) -> None:
    from reflowshock.workflow.package_report.joints import add_joints

    add_joints(run_folder, context)


def _board_drop_report(run_folder: Path, case: BoardDropCase, context: dict, summary: dict) -> None:
    from reflowshock.workflow.package_report.shock import add_shock

    _package_report(run_folder, case, context, summary)
    add_shock(run_folder, case, context, summary)


def _conclude_drop(run_folder: Path, case: BoardDropCase, summary: dict, errors: Discretisation) -> None:
    from reflowshock.workflow.package_report.conclusion import conclude

    conclude(run_folder, case, summary, errors)


def _conclude_structure(run_folder: Path, case: StructureCase, summary: dict, errors: Discretisation) -> None:
    from reflowshock.workflow.verdict.verdict import verdict_of_structure

    summary["verdict"] = verdict_of_structure()


def _drop_errors(run: Run, folder: Path) -> Findings:
    from reflowshock.workflow.convergence.error_estimate import Reading, estimate_errors
    from reflowshock.workflow.convergence.figures import drop_family, drop_figures

    return estimate_errors(Reading(drop_figures, drop_sizes, drop_family), run, folder)


def _structure_errors(run: Run, folder: Path) -> Findings:
    from reflowshock.workflow.convergence.error_estimate import Reading, estimate_errors
    from reflowshock.workflow.convergence.figures import structure_figures

    return estimate_errors(Reading(structure_figures, structure_sizes), run, folder)


def _structure_report(run_folder: Path, case: StructureCase, context: dict, summary: dict) -> None:
    from reflowshock.workflow.structure.report import add_structure

    context["preview_caption"] = "Mesh, coloured by layer."
    add_structure(run_folder, case, context, summary["metrics"])


def _solder_report(run_folder: Path, case: SolderCase, context: dict, summary: dict) -> None:
    if (run_folder / "reflow/shape.h5").exists():
        from reflowshock.workflow.solder.report import add_solder

        add_solder(run_folder, case, context, summary)


def _oscillation_report(run_folder: Path, case: OscillationCase, context: dict, summary: dict) -> None:
    if (run_folder / "reflow/shape.h5").exists():
        from reflowshock.workflow.solder.report import add_oscillation

        add_oscillation(run_folder, case, context, summary)


def _package_study(case: PackageCase) -> ConvergenceStudy:
    from reflowshock.workflow.convergence.packages import package_study

    return package_study(case)


def _board_drop_study(case: BoardDropCase) -> ConvergenceStudy:
    from reflowshock.workflow.convergence.packages import board_drop_study

    return board_drop_study(case)


def _structure_study(case: StructureCase) -> ConvergenceStudy:
    from reflowshock.workflow.convergence.structures import structure_study

    return structure_study(case)


def _solder_study(case: Case) -> ConvergenceStudy:
    from reflowshock.workflow.convergence.solder import STUDIES

    return STUDIES[case.kind](case)


def _flow_report(flow: FlowKind, run_folder: Path, case: FlowCase, context: dict, summary: dict) -> None:
    if (run_folder / FLOW_STAGE / "flow.h5").exists():
        from reflowshock.workflow.flows.report import add_flow

        add_flow(flow, run_folder, case, context, summary)


def _flow_study(flow: FlowKind, case: FlowCase) -> ConvergenceStudy:
    from reflowshock.workflow.flows.convergence import flow_study

    return flow_study(flow, case)


def _flow_kind(flow: FlowKind) -> Kind:
    """Return the kind of case of a kind of flow."""
    return Kind(
        case=flow.case,
        problems=flow.problems,
        stages={FLOW_STAGE: partial(run_flow, flow)},
        forecast=partial(forecast_flow, flow),
        size=partial(flow_size, flow),
        plan=partial(flow_tables, flow),
        acts="flow",
        report=partial(_flow_report, flow),
        study=partial(_flow_study, flow),
        effects=flow.effects,
    )


def _solder_kind(case: type[Case], problems: Callable[[Any], list[Problem]], reflow_solder: StageFunction) -> Kind:
    """Return a kind of case of solder alone."""
    return Kind(
        case,
        problems,
        {"reflow": reflow_solder},
        forecast_solder,
        solder_size,
        solder_tables,
        "reflow",
        _solder_report,
        _solder_study,
        LIQUID_EFFECTS,
    )


PACKAGE = Kind(
    case=PackageCase,
    problems=package_checks.package_problems,
    stages={
        "geometry": package_stages.geometry,
        "reflow": reflow,
        "surface": package_stages.surface,
        "solder_mesh": package_stages.solder_mesh,
    },
    forecast=forecast_package,
    size=package_size,
    plan=package_tables,
    acts="reflow",
    report=_package_report,
    study=_package_study,
    effects=(*LIQUID_EFFECTS, *HEATED_EFFECTS),
)
BOARD_DROP = replace(
    PACKAGE,
    case=BoardDropCase,
    problems=package_checks.board_drop_problems,
    stages={
        **PACKAGE.stages,
        "solder_mesh": package_stages.solder_mesh_for_drop,
        "shock": package_stages.shock,
        ERRORS.name: _drop_errors,
    },
    forecast=forecast_board_drop,
    size=board_drop_size,
    plan=board_drop_tables,
    acts="reflow and shock",
    report=_board_drop_report,
    study=_board_drop_study,
    effects=(*PACKAGE.effects, *SHOCK_EFFECTS),
    companions=drop_companions,
    conclude=_conclude_drop,
)
STRUCTURE = Kind(
    case=StructureCase,
    problems=structure_problems,
    stages={
        "geometry": structure_stages.geometry,
        "shock": structure_stages.shock,
        "comparison": structure_stages.comparison,
        ERRORS.name: _structure_errors,
    },
    forecast=structure_forecast.forecast_structure,
    size=structure_forecast.structure_size,
    plan=structure_tables,
    acts="motion",
    report=_structure_report,
    study=_structure_study,
    effects=STRUCTURE_EFFECTS,
    companions=structure_companions,
    conclude=_conclude_structure,
)
KINDS = (
    BOARD_DROP,
    _solder_kind(DropCase, solder_case.check_drop, solder_stages.reflow_drop),
    _solder_kind(JointCase, solder_case.check_joint, solder_stages.reflow_joint),
    _solder_kind(DropsCase, solder_case.check_drops, solder_stages.reflow_drops),
    replace(
        _solder_kind(OscillationCase, solder_case.check_oscillation, solder_stages.reflow_oscillation),
        report=_oscillation_report,
    ),
    STRUCTURE,
    *map(_flow_kind, FLOWS),
    PACKAGE,
)
NAMES = tuple(dict.fromkeys(kind.name for kind in KINDS))


def kind_of(case: Case) -> Kind:
    """Return the kind of a case.

    Returns:
        Record with models, stages, forecast and report functions of this kind of case.
    """
    return next(kind for kind in KINDS if kind.case is type(case))


def kind_named_in(table: Mapping) -> Kind:
    """Return the kind of a case file, by its table that names a kind.

    Args:
        table: Content of the case file.

    Returns:
        Record with models, stages, forecast and report functions of this kind of case.

    Raises:
        CaseError: The file has the table of no kind, or of several.
    """
    names = [name for name in NAMES if name in table]
    if names == [PACKAGE.name] and not any(find_nearest(name, ("shock",)) for name in table):
        return PACKAGE
    if len(names) == 1:
        return next(kind for kind in KINDS if kind.name == names[0])
    choice = "exactly one of " + ", ".join(f"[{name}]" for name in NAMES)
    if names:
        message = "has the tables of several kinds: " + " and ".join(f"[{name}]" for name in names)
        raise CaseError("case", [Problem("", message, None, choice)])
    if isinstance(table.get("study"), dict):
        raise CaseError("case", [Problem("", "is a study, not a case; use reflowshock study")])
    hint = next((f"[{near}]" for name in table if (near := find_nearest(name, NAMES))), "")
    raise CaseError("case", [Problem("", "has no table that identifies the kind of case", None, choice, hint)])


def stage_seconds(case: Case) -> dict[str, float]:
    """Return the predicted wall time [s] of each stage of a case, by name, the report included."""
    return every_stage(case, kind_of(case).forecast(case).seconds)


def every_stage(case: Case, predicted: Mapping[str, float]) -> dict[str, float]:
    """Complete predicted wall times with default values of the short stages, and correct shocks for this machine.

    Args:
        case: Case, whose pipeline gives the stages.
        predicted: Name of a stage -> predicted wall time [s]; that of a shock on the reference machine.

    Returns:
        Name of each stage, in order -> wall time [s].
    """
    usual = dict.fromkeys(case.pipeline.names, SECONDS_OF_STAGE) | {case.pipeline.names[-1]: SECONDS_OF_REPORT}
    times = usual | dict(predicted)
    return times | {name: slowness() * times[name] for name in (SHOCK,) if name in times}
