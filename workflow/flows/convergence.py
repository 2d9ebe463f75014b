"""Convergence study of a flow: particle spacing, and further numerical parameters of the method."""

from functools import partial
from math import ceil

from reflowshock.workflow.convergence.convergence_study import ConvergenceStudy, Parameter, StudyRun
from reflowshock.workflow.convergence.metrics import read_metric_errors
from reflowshock.workflow.flows.flow_kind import STAGE, FlowCase, FlowKind

FEWEST_ACROSS = 8
ROUNDING = 1e-9


def flow_study(flow: FlowKind, case: FlowCase) -> ConvergenceStudy:
    """Return the convergence study of a flow: number of particles across the scene, and other numerical parameters.

    Args:
        flow: Kind of flow.
        case: Case of this kind; further parameters are varied with the coarsest number of particles.

    Returns:
        Varied parameters, further runs, and the function that measures their errors.
    """
    numerics, measures = f"{case.kind}.numerics", flow.measures(case.scene)

    def run_at(value: float) -> StudyRun:
        count = max(FEWEST_ACROSS, ceil(1.0 / value - ROUNDING))
        settings = {f"{numerics}.{flow.count_key}": f"{count}"}
        return StudyRun(f"{count} across", "particle spacing", settings, 1.0 / count)

    spacing = Parameter("particle spacing", tuple(1.0 / count for count in flow.counts), run_at)
    coarse = {f"{numerics}.{flow.count_key}": f"{flow.counts[0]}"}
    choices = tuple(
        StudyRun(f"{key.split('_')[0]} {value:g}", key.replace("_", " "), coarse | {f"{numerics}.{key}": f"{value:g}"})
        for key, values in case.scene.numerics.study_values.items()
        for value in values
    )
    measure = partial(read_metric_errors, measures.exact, measures.errors, STAGE)
    return ConvergenceStudy(STAGE, (STAGE,), measures.errors, measure, (spacing,), choices)
