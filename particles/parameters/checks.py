"""Checks of solder parameters in combination; loads neither numba nor PETSc."""

from collections.abc import Mapping
from math import degrees, pi

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.effects import Decision, acting_weight, decide_effects
from reflowshock.particles.parameters.schemes import SCHEMES
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.young_laplace import NoMeridian, joint_meridian
from reflowshock.problem import Problem

SPACINGS_IN_NECK = 2.0
SPACINGS_IN_GAP = 3.0
SPACINGS_IN_RADIUS = 2.0
MOST_PARTICLES = 200_000
ROUNDING = 1e-9


def problems(solder: Solder, geometries: Mapping[str, JointGeometry], pitch: float) -> list[Problem]:
    """Find problems of the solder of an array before anything runs.

    Joints become thinner with a larger gap, so only the smallest and the largest gap of joints with equal discs are
    checked.

    Args:
        solder: Solder of each joint.
        geometries: Joint name -> geometry.
        pitch: Distance between neighbouring joints [m].

    Returns:
        One ``Problem`` (key in the case file, message, value, allowed values) for each contradiction; empty for a valid
        case.
    """
    effects = decide_effects(next(iter(geometries.values())), solder)
    solder_problems = scheme_problems(solder) + effect_problems(solder, effects) + _angle_problems(solder)
    if solder_problems:
        return solder_problems
    joint_problems: list[Problem] = []
    by_discs: dict[tuple[float, float], list[str]] = {}
    for name, geometry in geometries.items():
        by_discs.setdefault((geometry.radius_board, geometry.radius_package), []).append(name)
    for names in by_discs.values():
        names.sort(key=lambda name: geometries[name].gap)
        low, high = names[0], names[-1]
        joint_problems += _spacing_problems(solder, low, geometries[low])
        joint_problems += _too_much(solder, low, geometries[low], pitch)
        joint_problems += _too_thin(solder, high, geometries[high])
    return list({problem.key: problem for problem in joint_problems}.values())


def scheme_problems(solder: Solder) -> list[Problem]:
    """Find an unsupported time step, basis or wall of the scheme, and an incomplete wall condition.

    Args:
        solder: Solder with the selected scheme.

    Returns:
        Input errors with their keys in the case file; empty if there are none.
    """
    return _wall_problems(solder) + _time_step_problems(solder) + _basis_problems(solder)


def ispg_problems(solder: Solder, place: str | None) -> list[Problem]:
    """Find the use of the scheme ispg for a scene where it is not verified; return no or one input error.

    Args:
        solder: Solder with the selected scheme; other schemes have no problem.
        place: Unverified feature of the scene, in words for the message; None if the scheme is verified for it.
    """
    if solder.numerics.scheme != "ispg" or place is None:
        return []
    message = f'the scheme "ispg" is for drops and joints, with inertia; it is not verified for {place}'
    return [Problem("solder.numerics.scheme", message, "ispg", "energy")]


def effect_problems(solder: Solder, effects: Mapping[str, Decision]) -> list[Problem]:
    """Find solder that never comes to rest because neither surface tension nor inertia acts.

    Args:
        solder: Solder of the case: volume, fluid, contact angles and numerics.
        effects: Name -> decision; ``surface_tension`` and ``inertia`` are used.

    Returns:
        No or one input error.
    """
    tension = effects["surface_tension"]
    if tension["on"] or effects["inertia"]["on"]:
        return []
    message = f"nothing brings the solder to rest without surface tension; {tension['why']}"
    return [Problem("solder.effects.surface_tension", message, solder.effects.surface_tension, "on")]


def _wall_problems(solder: Solder) -> list[Problem]:
    scheme = solder.numerics.scheme
    walls = SCHEMES[scheme].walls
    if solder.wall not in walls:
        message = f'the scheme "{scheme}" does not support this wall'
        return [Problem("solder.wall", message, solder.wall, ", ".join(walls))]
    if (solder.wall == "slip") == (solder.slip_length is not None):
        return []
    value = "none" if solder.slip_length is None else mm(solder.slip_length)
    message = 'wall = "slip" needs a slip length, other walls have none'
    return [Problem("solder.slip_length", message, value, 'a length with wall = "slip", else none')]


def _time_step_problems(solder: Solder) -> list[Problem]:
    numerics = solder.numerics
    largest = SCHEMES[numerics.scheme].largest_time_step
    if numerics.time_step_limit <= largest:
        return []
    message = f'scheme "{numerics.scheme}" is explicit in surface tension: steps above the capillary limit are unstable'
    key = "solder.numerics.time_step_limit"
    return [Problem(key, message, f"{numerics.time_step_limit:g}", f"<= {largest:g}")]


def _basis_problems(solder: Solder) -> list[Problem]:
    basis = solder.numerics.basis
    if SCHEMES[solder.numerics.scheme].has_basis or basis == "quadratic":
        return []
    message = f'the scheme "{solder.numerics.scheme}" has no basis to choose'
    return [Problem("solder.numerics.basis", message, basis, 'quadratic, or any with scheme = "gripc"')]


def _angle_problems(solder: Solder) -> list[Problem]:
    pad, mask = degrees(solder.pad_contact_angle), degrees(solder.mask_contact_angle)
    if pad < mask:
        return []
    message = "the pad must be wetted better than the solder mask"
    return [Problem("solder.pad_contact_angle", message, f"{pad:.4g} deg", f"< {mask:.4g} deg")]


def _spacing_problems(solder: Solder, name: str, geometry: JointGeometry) -> list[Problem]:
    spacing = solder.numerics.spacing
    smallest_radius = min(geometry.radius_board, geometry.radius_package)
    limit = min(geometry.gap / SPACINGS_IN_GAP, smallest_radius / SPACINGS_IN_RADIUS)
    if spacing <= limit:
        return []
    message = f"too coarse for joint {name}: gap {mm(geometry.gap)}, smallest radius {mm(smallest_radius)}"
    return [Problem("solder.numerics.spacing", message, mm(spacing), f"<= {mm(limit)}")]


def _too_much(solder: Solder, name: str, geometry: JointGeometry, pitch: float) -> list[Problem]:
    """Find solder that does not fit between the plates; bridging of smaller volumes is found by the flow."""
    limit = pitch**2 * geometry.gap
    if solder.volume < limit:
        return []
    message = f"does not fit: joint {name} has a gap of {mm(geometry.gap)} at a pitch of {mm(pitch)}"
    return [Problem("solder.volume", message, mm3(solder.volume), f"< {mm3(limit)}")]


def _too_thin(solder: Solder, name: str, geometry: JointGeometry) -> list[Problem]:
    """Find a neck too thin for the particles; the flow reports joints without any neck as open."""
    spacing, full = (
        solder.numerics.spacing,
        pi * geometry.gap * max(geometry.radius_board, geometry.radius_package) ** 2,
    )
    waist = None if solder.volume >= full else _waist(solder, geometry)
    if waist is None or waist > SPACINGS_IN_NECK * spacing:
        return []
    limit = waist / SPACINGS_IN_NECK
    message = f"too coarse for the neck of joint {name}, which is {mm(waist)} wide in its gap of {mm(geometry.gap)}"
    return [Problem("solder.numerics.spacing", message, mm(spacing), f"< {mm(limit)}")]


def _waist(solder: Solder, geometry: JointGeometry) -> float | None:
    """Return the smallest diameter of the Young-Laplace joint [m]; None without equilibrium."""
    discs = (geometry.radius_board, geometry.radius_package, geometry.gap)
    limits = (solder.pad_contact_angle, solder.mask_contact_angle)
    weight = acting_weight(solder, decide_effects(geometry, solder))
    try:
        return joint_meridian(solder.volume, *discs, solder.surface_tension, weight, angle_limits=limits).waist
    except NoMeridian:
        return None


def mm(length: float) -> str:
    """Format a length [m] in mm."""
    return f"{1e3 * length:.4g} mm"


def mm3(volume: float) -> str:
    """Format a volume [m^3] in mm^3."""
    return f"{1e9 * volume:.3g} mm^3"


def mn(force: float) -> str:
    """Format a force [N] in mN."""
    return f"{1e3 * force:.4g} mN"


def deg(angle: float) -> str:
    """Format an angle [rad] in deg."""
    return f"{degrees(angle):.4g} deg"


def mm_per_s(speed: float) -> str:
    """Format a speed [m/s] in mm/s."""
    return f"{1e3 * speed:.4g} mm/s"


def too_many(scene: str, spacing: float, count: int) -> list[Problem]:
    """Find a scene with too many particles for the memory; no or one input error.

    Args:
        scene: Table of the scene in the case file, the first part of the error's key.
        spacing: Spacing of the particles [m].
        count: Number of particles.
    """
    if count <= MOST_PARTICLES:
        return []
    limit = spacing * (count / MOST_PARTICLES) ** (1.0 / 3.0)
    message = f"needs {count} particles, more than {MOST_PARTICLES}: the volume does not fit, or spacing too fine"
    return [Problem(f"{scene}.spacing", message, mm(spacing), f">= {mm(limit)}")]
