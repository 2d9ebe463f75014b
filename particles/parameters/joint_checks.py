"""Checks of the parameters of one joint in combination; loads neither numba nor PETSc."""

from collections.abc import Collection
from dataclasses import replace
from math import asin, inf, pi, sin, sqrt

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters import checks
from reflowshock.particles.parameters.checks import ROUNDING, deg, mm, mm3, mm_per_s, mn, too_many
from reflowshock.particles.parameters.effects import acting_weight, decide_effects
from reflowshock.particles.parameters.estimate import particle_count
from reflowshock.particles.parameters.scenes import Joint, PackagePath
from reflowshock.particles.parameters.schemes import SCHEMES
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.young_laplace import NoMeridian, joint_meridian
from reflowshock.problem import Problem

OVERFLOWS = 1e-3  # relative excess over the pad radius beyond which a contact line counts as on the mask
KEYS = {
    "solder.volume": "joint.volume",
    "solder.pad_contact_angle": "joint.pad_contact_angle",
    "solder.numerics.spacing": "joint.spacing",
}


def joint_problems(joint: Joint, solder: Solder) -> list[Problem]:
    """Find problems of a joint before it runs: the checks of an array without neighbours, under the keys of a joint.

    Args:
        joint: Scene of the joint: volume, pads, package and resolution.
        solder: Fluid, process and numerics.

    Returns:
        One ``Problem`` (key in the case file, message, value, allowed values) for each contradiction; empty for a valid
        case.
    """
    if joint.offset >= joint.pad_bottom + joint.pad_top:
        allowed = f"< {mm(joint.pad_bottom + joint.pad_top)}"
        return [Problem("joint.offset", "the pads do not overlap", mm(joint.offset), allowed)]
    array_problems = checks.problems(solder, {"of the case": joint.geometry}, inf)
    if array_problems:
        return [replace(problem, key=KEYS.get(problem.key, problem.key)) for problem in array_problems]
    problems = _tilt_problems(joint) or _path_problems(joint) or _package_problems(joint)
    problems = problems or _motion_problems(joint, solder)
    problems = problems or checks.ispg_problems(solder, unverified_joint(joint, solder))
    problems = problems or _load_problems(joint, solder)
    return problems or too_many("joint", joint.spacing, particle_count(solder, joint.geometry))


def unverified_joint(joint: Joint, solder: Solder) -> str | None:
    """Return the feature of a joint for which the scheme ispg is not verified, in words.

    Args:
        joint: Pads and package; a package that floats on walls with friction is not verified.
        solder: Fluid, effects and walls; a joint without inertia is examined by its geometry.

    Returns:
        Text for a message; None if the scheme is verified.
    """
    if joint.package is not None and solder.wall != "free-slip":
        return "packages that float, on walls with friction"
    return _without_inertia(joint.geometry, solder)


def unverified_joints(geometries: Collection[JointGeometry], solder: Solder, lowest: float = 0.0) -> str | None:
    """Return the feature of the joints of a package for which the scheme ispg is not verified; None if it is verified.

    Args:
        geometries: Joints as drawn.
        solder: Solder of each joint.
        lowest: Upward displacement of the package at its lowest position [m]; ignored where no gap remains.
    """
    feature = next(filter(None, (_without_inertia(geometry, solder) for geometry in geometries)), None)
    drawn = min(geometries, key=lambda geometry: geometry.gap)
    for geometry in (drawn, replace(drawn, gap=drawn.gap + lowest)):
        if feature is None and geometry.gap > 0.0 and _overflows(geometry, solder):
            return f"joints that overflow both pads, where no edge holds them (gap of {mm(geometry.gap)})"
    return feature


def _without_inertia(geometry: JointGeometry, solder: Solder) -> str | None:
    inertia = decide_effects(geometry, solder)["inertia"]
    return None if inertia["on"] else f"joints without inertia ({inertia['why']})"


def _overflows(geometry: JointGeometry, solder: Solder) -> bool:
    """Return whether the solder overflows both pads of level plates."""
    limits = (solder.pad_contact_angle, solder.mask_contact_angle)
    weight = acting_weight(solder, decide_effects(geometry, solder))
    discs = (geometry.radius_board, geometry.radius_package, geometry.gap)
    try:
        line = joint_meridian(solder.volume, *discs, solder.surface_tension, weight, angle_limits=limits).r
    except NoMeridian:  # the solver may fail for flat joints
        return solder.volume > 2.0 * pi * max(geometry.radius_board, geometry.radius_package) ** 2 * geometry.gap
    ends = ((line[0], geometry.radius_board), (line[-1], geometry.radius_package))
    return all(rim > (1.0 + OVERFLOWS) * radius for rim, radius in ends)


def _tilt_problems(joint: Joint) -> list[Problem]:
    """Find a tilted pad whose edge is less than a spacing above the lower plate."""
    targets = [("joint.path", target) for target in joint.path_geometries]
    for key, geometry in (("joint.tilt", joint.geometry), *targets):
        drop, tilt, room = joint.pad_top * sin(abs(geometry.tilt[1])), geometry.tilt[1], geometry.gap - joint.spacing
        if tilt and drop >= room:
            message = f"the edge of the upper pad is {mm(drop)} lower than its centre, in a gap of {mm(geometry.gap)}"
            return [Problem(key, message, deg(tilt), f"< {deg(asin(min(1.0, max(0.0, room / joint.pad_top))))}")]
    return []


def _path_problems(joint: Joint) -> list[Problem]:
    if joint.path is None:
        return []
    if joint.package is not None:
        message = "a package floats or is moved, not both"
        return [Problem("joint.path", message, None, "joint.package or joint.path")]
    if joint.path_geometries[-1] == joint.geometry:
        message = "the path ends where it starts"
        return [Problem("joint.path", message, None, "another standoff, offset or tilt")]
    end, lowest = joint.path_geometries[-1], checks.SPACINGS_IN_GAP * joint.spacing
    if end.gap < (1.0 - ROUNDING) * lowest:
        message = f"too low for particles {mm(joint.spacing)} apart"
        return [Problem("joint.path.standoff", message, mm(end.gap), f">= {mm(lowest)}")]
    if end.offset[0] >= joint.pad_bottom + joint.pad_top:
        allowed = f"< {mm(joint.pad_bottom + joint.pad_top)}"
        return [Problem("joint.path.offset", "the pads do not overlap", mm(end.offset[0]), allowed)]
    return []


def _package_problems(joint: Joint) -> list[Problem]:
    if joint.package is None or not {"shift", "turn"} <= set(joint.package.free):
        return []
    message = "a package that is free to shift and to turn rolls off a single joint"
    return [Problem("joint.package.free", message, ", ".join(joint.package.free), "lift with shift, or lift with turn")]


def _load_problems(joint: Joint, solder: Solder) -> list[Problem]:
    """Find a load that presses the package down to a gap that particles cannot fill."""
    if joint.package is None or "lift" not in joint.package.free:
        return []
    lowest, limits = checks.SPACINGS_IN_GAP * joint.spacing, (joint.pad_contact_angle, joint.mask_contact_angle)
    weight = acting_weight(solder, decide_effects(joint.geometry, solder))
    discs = (joint.pad_bottom, joint.pad_top, lowest)
    try:
        largest = joint_meridian(joint.volume, *discs, solder.surface_tension, weight, angle_limits=limits).axial_force
    except NoMeridian:
        return []
    if joint.package.load < largest:
        return []
    too_low = f"the package down to {mm(lowest)}, too low for particles {mm(joint.spacing)} apart"
    if largest <= 0.0:
        allowed = "more solder, or a smaller joint.spacing"
        return [Problem("joint.volume", f"the solder alone pulls {too_low}", mm3(joint.volume), allowed)]
    message = f"presses {too_low}"
    return [Problem("joint.package.load", message, mn(joint.package.load), f"< {mn(largest)}")]


def _motion_problems(joint: Joint, solder: Solder) -> list[Problem]:
    """Find a scheme or a speed that does not support a moving package."""
    if joint.package is None and joint.path is None:
        return []
    scheme = solder.numerics.scheme
    if not SCHEMES[scheme].moves_plates:
        return [Problem("solder.numerics.scheme", f"the scheme {scheme} needs plates at rest", scheme, "energy")]
    return [] if joint.path is None else _speed_problems(joint, joint.path, solder)


def _speed_problems(joint: Joint, path: PackagePath, solder: Solder) -> list[Problem]:
    """Find a path with inertia but no speed, or with an unsupported speed."""
    inertia = decide_effects(joint.geometry, solder)["inertia"]
    key, speed = "joint.path.speed", path.speed
    if speed is None and inertia["on"]:
        message = f"a package follows its path from rest to rest, at no particular speed; {inertia['why']}"
        allowed = 'off, or joint.path.speed with solder.numerics.scheme = "ispg"'
        return [Problem("solder.effects.inertia", message, solder.effects.inertia, allowed)]
    if speed is None:
        return []
    if not inertia["on"]:
        message = f"without inertia a package is moved from rest to rest, at no particular speed; {inertia['why']}"
        return [Problem(key, message, mm_per_s(speed), 'no speed, or solder.effects.inertia = "on"')]
    if not SCHEMES[solder.numerics.scheme].moves_at_speed:
        message = f"a package is moved at a speed ({mm_per_s(speed)}) by the scheme ispg alone"
        return [Problem("solder.numerics.scheme", message, solder.numerics.scheme, "ispg")]
    if path.steps is not None:
        message = "with a speed the package moves without stops"
        return [Problem("joint.path.steps", message, path.steps, "joint.path.steps or joint.path.speed")]
    slowest = joint.path_length / solder.process_time
    fastest = sqrt(solder.surface_tension / (solder.density * max(joint.pad_bottom, joint.pad_top)))
    if not slowest < speed <= fastest:
        message = "it must end within solder.process_time, at a Weber number of its pad below 1"
        return [Problem(key, message, mm_per_s(speed), f"{mm_per_s(slowest)} to {mm_per_s(fastest)}")]
    return []
