"""Parameters of one joint that are each allowed but make no joint together. Loads neither numba nor PETSc."""

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

OVERFLOWS = 1e-3  # of its pad's radius: a contact line that is on the mask
KEYS = {
    "solder.volume": "joint.volume",
    "solder.pad_contact_angle": "joint.pad_contact_angle",
    "solder.numerics.spacing": "joint.spacing",
}


def joint_problems(joint: Joint, solder: Solder) -> list[Problem]:
    """Find what cannot work before a joint runs: those of an array without neighbours, under the joint's own keys."""
    if joint.offset >= joint.pad_bottom + joint.pad_top:
        allowed = f"< {mm(joint.pad_bottom + joint.pad_top)}"
        return [Problem("joint.offset", "the pads do not overlap", mm(joint.offset), allowed)]
    found = checks.problems(solder, {"of the case": joint.geometry}, inf)
    if found:
        return [replace(problem, key=KEYS.get(problem.key, problem.key)) for problem in found]
    found = _tilt_problems(joint) or _path_problems(joint) or _package_problems(joint)
    found = found or _motion_problems(joint, solder) or checks.ispg_problems(solder, unverified_joint(joint, solder))
    found = found or _load_problems(joint, solder)
    return found or too_many("joint", joint.spacing, particle_count(solder, joint.geometry))


def unverified_joint(joint: Joint, solder: Solder) -> str | None:
    """What of a joint the scheme ispg is not verified for; None where it is."""
    if joint.package is not None and solder.wall != "free-slip":
        return "packages that float, on walls with friction"
    return _without_inertia(joint.geometry, solder)


def unverified_joints(geometries: Collection[JointGeometry], solder: Solder, lowest: float = 0.0) -> str | None:
    """What of the joints of a package, each by itself, the scheme ispg is not verified for; None where it is.

    Args:
        geometries: as drawn.
        solder: of each.
        lowest: displacement of the package where it is lowest, upwards [m]; one without room for solder is not judged.
    """
    found = next(filter(None, (_without_inertia(geometry, solder) for geometry in geometries)), None)
    drawn = min(geometries, key=lambda geometry: geometry.gap)
    for place in (drawn, replace(drawn, gap=drawn.gap + lowest)):
        if found is None and place.gap > 0.0 and _overflows(place, solder):
            return f"joints that overflow both pads, where no edge holds them (gap of {mm(place.gap)})"
    return found


def _without_inertia(geometry: JointGeometry, solder: Solder) -> str | None:
    inertia = decide_effects(geometry, solder)["inertia"]
    return None if inertia["on"] else f"joints without inertia ({inertia['why']})"


def _overflows(geometry: JointGeometry, solder: Solder) -> bool:
    """Whether the solder is beyond both pads where the plates are level."""
    limits = (solder.pad_contact_angle, solder.mask_contact_angle)
    weight = acting_weight(solder, decide_effects(geometry, solder))
    discs = (geometry.radius_board, geometry.radius_package, geometry.gap)
    try:
        line = joint_meridian(solder.volume, *discs, solder.surface_tension, weight, angle_limits=limits).r
    except NoMeridian:  # of flat joints it is not always found
        return solder.volume > 2.0 * pi * max(geometry.radius_board, geometry.radius_package) ** 2 * geometry.gap
    ends = ((line[0], geometry.radius_board), (line[-1], geometry.radius_package))
    return all(rim > (1.0 + OVERFLOWS) * radius for rim, radius in ends)


def _tilt_problems(joint: Joint) -> list[Problem]:
    """The edge of the tilted pad must stay above the lower plate, by a spacing at least."""
    for key, place in (("joint.tilt", joint.geometry), *(("joint.path", place) for place in joint.places)):
        drop, tilt, room = joint.pad_top * sin(abs(place.tilt[1])), place.tilt[1], place.gap - joint.spacing
        if tilt and drop >= room:
            message = f"the edge of the upper pad is {mm(drop)} lower than its centre, in a gap of {mm(place.gap)}"
            return [Problem(key, message, deg(tilt), f"< {deg(asin(min(1.0, max(0.0, room / joint.pad_top))))}")]
    return []


def _path_problems(joint: Joint) -> list[Problem]:
    if joint.path is None:
        return []
    if joint.package is not None:
        message = "a package floats or is moved, not both"
        return [Problem("joint.path", message, None, "joint.package or joint.path")]
    if joint.places[-1] == joint.geometry:
        message = "the path ends where it starts"
        return [Problem("joint.path", message, None, "another standoff, offset or tilt")]
    end, lowest = joint.places[-1], checks.SPACINGS_IN_GAP * joint.spacing
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
    """The solder must bear the package at a gap that particles can fill."""
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
    place = f"the package down to {mm(lowest)}, too low for particles {mm(joint.spacing)} apart"
    if largest <= 0.0:
        allowed = "more solder, or a smaller joint.spacing"
        return [Problem("joint.volume", f"the solder alone pulls {place}", mm3(joint.volume), allowed)]
    message = f"presses {place}"
    return [Problem("joint.package.load", message, mn(joint.package.load), f"< {mn(largest)}")]


def _motion_problems(joint: Joint, solder: Solder) -> list[Problem]:
    """Find what does not go with a package that moves."""
    if joint.package is None and joint.path is None:
        return []
    scheme = solder.numerics.scheme
    if not SCHEMES[scheme].moves_plates:
        return [Problem("solder.numerics.scheme", f"the scheme {scheme} needs plates at rest", scheme, "energy")]
    return [] if joint.path is None else _speed_problems(joint, joint.path, solder)


def _speed_problems(joint: Joint, path: PackagePath, solder: Solder) -> list[Problem]:
    """Find a package that is moved with inertia at no speed, or at one that means nothing."""
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
        message = "at a speed a package goes all the way in one go"
        return [Problem("joint.path.steps", message, path.steps, "joint.path.steps or joint.path.speed")]
    slowest = joint.way / solder.process_time
    fastest = sqrt(solder.surface_tension / (solder.density * max(joint.pad_bottom, joint.pad_top)))
    if not slowest < speed <= fastest:
        message = "it must end within solder.process_time, at a Weber number of its pad below 1"
        return [Problem(key, message, mm_per_s(speed), f"{mm_per_s(slowest)} to {mm_per_s(fastest)}")]
    return []
