"""Parameters of the solder that are each allowed but make no joint together. Loads neither numba nor PETSc."""

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
    """Find what cannot work before anything runs.

    Joints thin with their gap: of joints with equal discs only the smallest and the largest gap are examined.

    Args:
        solder: the solder.
        geometries: joint name to geometry.
        pitch: distance of neighbouring joints [m].
    """
    effects = decide_effects(next(iter(geometries.values())), solder)
    found = scheme_problems(solder) + effect_problems(solder, effects) + _angle_problems(solder)
    if found:
        return found
    by_discs: dict[tuple[float, float], list[str]] = {}
    for name, geometry in geometries.items():
        by_discs.setdefault((geometry.radius_board, geometry.radius_package), []).append(name)
    for names in by_discs.values():
        names.sort(key=lambda name: geometries[name].gap)
        low, high = names[0], names[-1]
        found += _spacing_problems(solder, low, geometries[low])
        found += _too_much(solder, low, geometries[low], pitch)
        found += _too_thin(solder, high, geometries[high])
    return list({problem.key: problem for problem in found}.values())


def scheme_problems(solder: Solder) -> list[Problem]:
    """Find a time step, a basis or a wall that the scheme cannot take, and a wall that is not fully given."""
    return _wall_problems(solder) + _time_step_problems(solder) + _basis_problems(solder)


def ispg_problems(solder: Solder, place: str | None) -> list[Problem]:
    """Find the scheme ispg at a place where it does not hold, or is not verified; empty for others, or no place."""
    if solder.numerics.scheme != "ispg" or place is None:
        return []
    message = f'the scheme "ispg" is for drops and joints, with inertia; it is not verified for {place}'
    return [Problem("solder.numerics.scheme", message, "ispg", "energy")]


def effect_problems(solder: Solder, effects: Mapping[str, Decision]) -> list[Problem]:
    """Find solder that never comes to rest, since without surface tension nothing gives it a shape."""
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
    """More solder than there is room between the plates; less may still touch the neighbour, which the flow decides."""
    limit = pitch**2 * geometry.gap
    if solder.volume < limit:
        return []
    message = f"does not fit: joint {name} has a gap of {mm(geometry.gap)} at a pitch of {mm(pitch)}"
    return [Problem("solder.volume", message, mm3(solder.volume), f"< {mm3(limit)}")]


def _too_thin(solder: Solder, name: str, geometry: JointGeometry) -> list[Problem]:
    """A neck too thin for the particles. Where no neck spans the gap at all, the flow says that the joint is open."""
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
    """Smallest diameter of the Young-Laplace joint [m]; none without equilibrium."""
    discs = (geometry.radius_board, geometry.radius_package, geometry.gap)
    limits = (solder.pad_contact_angle, solder.mask_contact_angle)
    weight = acting_weight(solder, decide_effects(geometry, solder))
    try:
        return joint_meridian(solder.volume, *discs, solder.surface_tension, weight, angle_limits=limits).waist
    except NoMeridian:
        return None


def mm(length: float) -> str:
    """Write a length [m]."""
    return f"{1e3 * length:.4g} mm"


def mm3(volume: float) -> str:
    """Write a volume [m^3]."""
    return f"{1e9 * volume:.3g} mm^3"


def mn(force: float) -> str:
    """Write a force [N]."""
    return f"{1e3 * force:.4g} mN"


def deg(angle: float) -> str:
    """Write an angle [rad]."""
    return f"{degrees(angle):.4g} deg"


def mm_per_s(speed: float) -> str:
    """Write a speed [m/s]."""
    return f"{1e3 * speed:.4g} mm/s"


def too_many(scene: str, spacing: float, count: int) -> list[Problem]:
    """Find a scene of so many particles at a spacing [m] that no memory holds them."""
    if count <= MOST_PARTICLES:
        return []
    limit = spacing * (count / MOST_PARTICLES) ** (1.0 / 3.0)
    message = f"needs {count} particles, more than {MOST_PARTICLES}: the volume does not fit, or spacing too fine"
    return [Problem(f"{scene}.spacing", message, mm(spacing), f">= {mm(limit)}")]
