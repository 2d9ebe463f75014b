"""Consistency checks of the case of a structure."""

from reflowshock.problem import Problem
from reflowshock.workflow.case.pulse_files import unreadable_pulses
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.forecast import step_problems
from reflowshock.workflow.structure.references import reference_problems


def structure_problems(case: StructureCase) -> list[Problem]:
    """Check materials, positions, facet sets, loads, references and time steps of a structure against each other.

    Args:
        case: Case whose values are valid one by one.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    from reflowshock.fem.problem import structure_checks
    from reflowshock.meshing.board.box_plan import box_problems
    from reflowshock.workflow.structure.findings import truncated_waves

    problems = [
        *box_problems(case.box),
        *structure_checks.problems(case.problem),
        *unreadable_pulses(case.pulse_tables),
    ]
    problems += reference_problems(case.references, case.problem)
    return problems or [*step_problems(case), *truncated_waves(case)]
