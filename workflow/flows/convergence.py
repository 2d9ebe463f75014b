"""Convergence study of a flow: particle spacing, and smoothing length over the spacing."""

from functools import partial
from math import ceil

from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, Parameter, StudyRun
from reflowshock.workflow.convergence.metrics import read_metric_errors
from reflowshock.workflow.flows.flow_kind import STAGE, FlowCase, FlowKind

FEWEST_ACROSS = 8
SMOOTHING = (1.2, 1.5, 2.0)
ROUNDING = 1e-9


def flow_study(flow: FlowKind, case: FlowCase) -> ConvergenceStudy:
    """Return the study of a flow: the particles across the scene, and at the coarsest of them the smoothing length."""
    numerics, measures = f"{case.kind}.numerics", flow.measures(case.scene)

    def run_at(value: float) -> StudyRun:
        count = max(FEWEST_ACROSS, ceil(1.0 / value - ROUNDING))
        settings = {f"{numerics}.{flow.count_key}": f"{count}"}
        return StudyRun(f"{count} across", "particle spacing", settings, 1.0 / count)

    spacing = Parameter("particle spacing", tuple(1.0 / count for count in flow.counts), run_at)
    coarse = {f"{numerics}.{flow.count_key}": f"{flow.counts[0]}"}
    choices = tuple(
        StudyRun(f"smoothing {length:g}", "smoothing length", coarse | {f"{numerics}.smoothing_length": f"{length:g}"})
        for length in SMOOTHING
    )
    measure = partial(read_metric_errors, measures.exact, measures.errors, STAGE)
    return ConvergenceStudy(STAGE, (STAGE,), measures.errors, measure, (spacing,), choices)
