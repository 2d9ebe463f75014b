"""What does not fit together in a case of molten solder alone."""

from reflowshock.problem import Problem
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase


def of_drop(case: DropCase) -> list[Problem]:
    """Find parameters that make no possible drop together."""
    from reflowshock.particles.parameters.scene_checks import drop_problems

    return drop_problems(case.drop, case.molten)


def of_joint(case: JointCase) -> list[Problem]:
    """Find parameters that make no possible joint together."""
    from reflowshock.particles.parameters.scene_checks import joint_problems

    return joint_problems(case.joint, case.molten)


def of_drops(case: DropsCase) -> list[Problem]:
    """Find parameters that make no possible pair together."""
    from reflowshock.particles.parameters.scene_checks import pair_problems

    return pair_problems(case.drops, case.molten)


def of_oscillation(case: OscillationCase) -> list[Problem]:
    """Find a drop that does not oscillate."""
    from reflowshock.particles.parameters.scene_checks import oscillation_problems

    return oscillation_problems(case.oscillation, case.molten)
