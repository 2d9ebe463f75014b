"""Record of a kind of flow: its cases, solver, limits, cost, curves and texts, in one place."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reflowshock.effect import Effect
from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Pipeline, Stage, report_of
from reflowshock.workflow.case.text import percent, quantity
from reflowshock.workflow.flows.cost import Cost

if TYPE_CHECKING:
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.flows.result import FlowResult
    from reflowshock.workflow.report.charts import Chart

STAGE = "particles"
VOLUME_DRIFT = 0.02  # largest change of the volume: densities of a weakly compressible liquid stay within about 1 %

Row = tuple[str, str, str]  # quantity, value and remark


class FlowCase(Case):
    """Case of a liquid that flows; the table that names its kind is the scene."""

    @property
    def scene(self) -> Any:
        """Parameters of the flow."""
        return getattr(self, self.kind)


@dataclass(frozen=True, slots=True)
class Measures:
    """Quantities whose convergence is studied.

    Attributes:
        errors: Name of a metric -> its name for readers.
        exact: Exact solution, for readers; empty if the metrics are compared with the finest run.
    """

    errors: Mapping[str, str]
    exact: str = ""


def metric_text(name: str, metric: dict) -> str:
    """Write a metric: relative errors, drifts and rises in per cent, others with their unit.

    Args:
        name: Name of the metric, which decides on the format.
        metric: Record with ``value`` (SI) and ``unit``.
    """
    if metric["unit"] == "" and ("error" in name or name.endswith(("_drift", "_rise"))):
        return percent(metric["value"])
    return quantity(metric)


@dataclass(frozen=True, slots=True)
class FlowKind:
    """Everything that distinguishes one kind of flow from another.

    A ``scene`` below is the model of the flow's parameters, ``case.scene``.

    Attributes:
        case: Model of the case files.
        effects: Effects that a case may call for.
        problems: Function of a case that returns contradictions between its parameters.
        solve: Function of scene, folder of the products, progress callback and checkpoint that computes the flow.
        limits: Function of a scene that returns metric -> largest allowed magnitude.
        curves: Function of scene and result that returns the charts of the report.
        caption: Caption of these charts.
        headline: Metrics at the top of the report, where a run has them.
        counts: Particles across the scene in the convergence study, the coarsest first.
        measures: Function of a scene that returns the quantities of the convergence study.
        costs: Function of scene, number of steps and cost factor of the viscosity that returns device -> cost.
        plan_rows: Function of a scene that returns additional rows of the plan.
        lower_limits: Metric -> smallest allowed value, for metrics that not every run has.
        text: Function of name and record that writes a metric.
        count_key: Key of the particles across the scene in the table ``numerics``.
        length_unit: Unit of lengths in the plan.
        add_products: Function that adds further products of a run to the context of the report.
    """

    case: type[FlowCase]
    effects: Sequence[Effect]
    problems: Callable[[Any], list[Problem]]
    solve: "Callable[[Any, Path, Callable[[float], None], Checkpoint], FlowResult]"
    limits: Callable[[Any], Mapping[str, float]]
    curves: "Callable[[Any, FlowResult], list[Chart]]"
    caption: str
    headline: tuple[str, ...]
    counts: tuple[int, ...]
    measures: Callable[[Any], Measures]
    costs: Callable[[Any, int, float], Mapping[str, Cost]]
    plan_rows: Callable[[Any], Iterable[Row]] = lambda scene: ()
    lower_limits: Mapping[str, float] = field(default_factory=dict)
    text: Callable[[str, dict], str] = metric_text
    count_key: str = "particles_across"
    length_unit: str = "mm"
    add_products: Callable[[Path, dict], None] = lambda folder, context: None


def flow_pipeline(scene: str, *products: str) -> Pipeline:
    """Return the pipeline of a flow: the stage ``particles``, which computes it, and the report.

    Args:
        scene: Table of the case file on which the stage depends.
        products: Files of the stage in addition to ``flow.h5`` and ``particles.vtu``; none by default.
    """
    files = ("flow.h5", "particles.vtu", *products)
    particles = Stage(STAGE, (scene,), (), tuple(f"{STAGE}/{name}" for name in files))
    return Pipeline((particles, report_of(STAGE)))
