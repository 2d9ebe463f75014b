"""What does not fit together in the case of a structure."""

from reflowshock.workflow.case.problems import Problem
from reflowshock.workflow.case.pulse_files import unreadable_pulses
from reflowshock.workflow.structure.case import StructureCase
from reflowshock.workflow.structure.forecast import step_problems
from reflowshock.workflow.structure.references import reference_problems


def structure_problems(case: StructureCase) -> list[Problem]:
    """Find what does not fit together: materials, places, facet sets, loads, references."""
    from reflowshock.fem.problem import structure_checks
    from reflowshock.meshing.board.box_plan import box_problems
    from reflowshock.workflow.structure.findings import waves_that_do_not_pass

    boxes = [Problem(found.key, found.message, found.value, found.allowed) for found in box_problems(case.box)]
    bodies = [
        Problem(found.key, found.message, found.value, found.allowed, found.hint)
        for found in structure_checks.problems(case.problem)
    ]
    found = [*boxes, *bodies, *unreadable_pulses(case.pulse_tables)]
    found += reference_problems(case.references, case.problem)
    return found or [*step_problems(case), *waves_that_do_not_pass(case)]
