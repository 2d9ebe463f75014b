"""What does not fit together in the case of a structure."""

from reflowshock.problem import Problem
from reflowshock.workflow.case.pulse_files import unreadable_pulses
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.forecast import step_problems
from reflowshock.workflow.structure.references import reference_problems


def structure_problems(case: StructureCase) -> list[Problem]:
    """Find what does not fit together: materials, places, facet sets, loads, references."""
    from reflowshock.fem.problem import structure_checks
    from reflowshock.meshing.board.box_plan import box_problems
    from reflowshock.workflow.structure.findings import waves_that_do_not_pass

    found = [*box_problems(case.box), *structure_checks.problems(case.problem), *unreadable_pulses(case.pulse_tables)]
    found += reference_problems(case.references, case.problem)
    return found or [*step_problems(case), *waves_that_do_not_pass(case)]
