"""Checks of the parameters of a package against each other: geometry, solder, shock."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from reflowshock.problem import Problem
from reflowshock.workflow.board_drop import fine_joints, fittings, identical_joints, shock_cooling
from reflowshock.workflow.board_drop.board_deflection import decided
from reflowshock.workflow.board_drop.forecast import step_problems
from reflowshock.workflow.case import fields
from reflowshock.workflow.case.pulse_files import unreadable_pulses
from reflowshock.workflow.package import given_surfaces, reference
from reflowshock.workflow.package.case import BoardDropCase, PackageCase, joint_geometries
from reflowshock.workflow.reflow import forecast as reflow_forecast


def package_problems(case: PackageCase) -> list[Problem]:
    """Return the contradictions between the parameters of package, joints and board.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    return _of_geometry(case) or _of_joints(case)


def board_drop_problems(case: BoardDropCase) -> list[Problem]:
    """Return the contradictions between the parameters of package, joints, board and shock.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    from reflowshock.fem.problem import shock_checks

    if problems := _of_geometry(case):
        return problems
    problems = _of_joints(case) + _in_user_units(case, shock_checks.problems(case.shock))
    problems += fine_joints.problems(case)
    problems += unreadable_pulses(case.pulse_tables)
    problems += reference.problems(case.shock.failure.reference, type(case))
    problems += _in_user_units(case, fittings.problems(case))
    if case.shock.numerics.kinematics == "auto" and not problems:
        problems += _in_user_units(case, map(_as_decided, shock_checks.problems(decided(case).shock)))
    if problems:
        return problems
    problems = [*identical_joints.problems(case), *shock_cooling.problems(case), *_of_flow(case), *_of_coupling(case)]
    return problems or list(step_problems(case))


def _as_decided(problem: Problem) -> Problem:
    """Mark the value of kinematics that were decided from ``auto``."""
    is_decided = problem.key == "shock.numerics.kinematics"
    return replace(problem, value=f"auto, here {problem.value}") if is_decided else problem


def _of_geometry(case: PackageCase) -> list[Problem]:
    from reflowshock.meshing.board.checks import problems

    return _in_user_units(case, problems(case.package, case.board, case.warpage))


def _of_joints(case: PackageCase) -> list[Problem]:
    """Return problems of temperatures, solder and given surfaces with the joints of a valid geometry."""
    from reflowshock.fem.problem import thermal as thermal_checks
    from reflowshock.meshing.board.pads import pad_table
    from reflowshock.particles.parameters import checks as particles_checks

    package, thermal = case.package, case.thermal
    pads = pad_table(package, case.board, case.warpage)
    geometries = joint_geometries(pads)
    heated = thermal_checks.problems(thermal, case.materials.by_role, case.warpage.corner) if thermal else []
    unverified = case.unverified if case.solder.numerics.scheme == "ispg" else None
    of_solder = particles_checks.ispg_problems(case.solder, unverified)
    of_solder = of_solder or particles_checks.problems(case.solder, geometries, package.pitch)
    if thermal:
        of_solder += reflow_forecast.problems(case.solder, geometries, thermal, package.pitch)
    return _in_user_units(case, heated) + of_solder + list(given_surfaces.problems(package, pads, thermal is not None))


def _in_user_units(case: PackageCase, problems: Iterable[Problem]) -> list[Problem]:
    """Return problems with their values as a user writes them in the case file."""
    by_key = {key: field for key, _, field in fields.leaves(case)}
    return [replace(problem, value=fields.as_written(problem.value, by_key.get(problem.key))) for problem in problems]


def _yielding(case: BoardDropCase) -> list[str]:
    """Return the roles of the materials that yield in the shock."""
    return [role for role, material in decided(case).materials.by_role.items() if material.plasticity is not None]


def _of_flow(case: BoardDropCase) -> Iterator[Problem]:
    """Yield problems of limits on plastic work without yielding solder, and of linear steps with yielding materials."""
    failure, yielding = case.shock.failure, _yielding(case)
    if "solder" not in yielding:
        allowed = 'materials.solder of the library, such as "SAC405", or with a table plasticity'
        message = "by plastic work, but the solder does not yield"
        if (work := failure.layer_plastic_work) is not None:
            limit = fields.as_written(work.limit, type(work).model_fields["limit"])
            yield Problem("shock.failure.layer_plastic_work.limit", f"judges {message}", limit, allowed)
        if failure.life is not None and failure.life.measure == "layer_plastic_work":
            yield Problem("shock.failure.life.measure", f"counts drops {message}", failure.life.measure, allowed)
    if case.shock.numerics.dns_solver == "implicit" and yielding:
        message = f"needs elastic materials, but {' and '.join(yielding)} yields"
        yield Problem("shock.numerics.dns_solver", message, "implicit", "explicit, or elastic materials")


def _of_coupling(case: BoardDropCase) -> Iterator[Problem]:
    """Yield the problem of local time steps with plastic materials or finite rotations."""
    if case.shock.coupling.scheme != "local_steps" or "two_scale" not in case.shock.numerics.modes:
        return
    yielding = _yielding(case)
    if not yielding and decided(case).shock.numerics.kinematics == "small":
        return
    why = f"{' and '.join(yielding)} yields" if yielding else "shock.numerics.kinematics is finite"
    message = f"needs elastic materials and small strains, but {why}"
    allowed = "held_velocity, impulse, gravouil_combescure, auto"
    yield Problem("shock.coupling.scheme", message, "local_steps", allowed)
