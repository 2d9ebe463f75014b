"""Checks of the parameters of drop scenes in combination; loads neither numba nor PETSc."""

from collections.abc import Callable
from math import degrees, pi, radians
from typing import Any, Protocol

from reflowshock.parameters import with_value
from reflowshock.particles.parameters import checks
from reflowshock.particles.parameters.checks import ROUNDING, deg, mm, mm3, too_many
from reflowshock.particles.parameters.effects import LIQUID_EFFECTS, acting_weight, asymmetric_effect, decide_drop
from reflowshock.particles.parameters.joint_checks import unverified_joint
from reflowshock.particles.parameters.scenes import Drop, Drops, Joint, Oscillation
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.reference.drop_oscillation import lamb_decay_rate, rayleigh_frequency
from reflowshock.particles.reference.young_laplace import cap_angle, sessile_meridian
from reflowshock.problem import Problem

FEWEST_PER_EDGE = 5
SPACINGS_IN_PAD = 2.0
ISPG_ANGLES = (radians(30.0), radians(148.0))
# For whole drops on uniform free-slip walls only: in a quarter, the particles on the axis lock.
FILM_ANGLE, FILM_EDGES = radians(15.0), (5, 7)
# In a plane, a drop spreads 2.7 times too far at 30 degrees, where its middle is half a spacing thick.
PLANE_ANGLE = radians(60.0)
ISPG_EDGES, HELD_EDGES, SECTION_EDGES = (5, 15), (6, 9), (8, 21)  # HELD: with contact angle hysteresis
# With 5 particles per edge at 30 degrees and no slip, no rest after 1600 steps; above 12, not all cases were run.
FRICTION_EDGES, FRICTION_PAD_EDGES = (6, 12), (7, 9)
ISPG_PAD_EDGE = 11
FREE_EDGES = (7, 11)
IMPACT_EDGES, IMPACT_WEBER, IMPACT_REYNOLDS = (7, 9), 50.0, 300.0
ISPG_PAIR = 2000


class HasWall(Protocol):
    """Scene that may include a wall."""

    @property
    def is_free(self) -> bool:
        """Whether the scene is free of walls."""


def with_scheme(scene: Drop | Joint | Drops, solder: Solder, asked: str) -> tuple[Solder, str]:
    """Return the solder with the scheme of a scene, and the reason for an automatic choice (otherwise "").

    Auto selects ispg where it is verified or where no other scheme supports the scene, and energy otherwise.

    Args:
        scene: Drop, joint or pair of drops.
        solder: Solder of the scene.
        asked: Scheme of the case file, with which the solder is returned unchanged, or "auto".
    """
    if asked != "auto":
        return solder, ""
    ispg = with_value(solder, "numerics.scheme", "ispg")
    if scene.needs_ispg:
        return ispg, "no other scheme computes it"
    feature = UNVERIFIED_FEATURES[type(scene)](scene, solder)
    return (ispg, "with inertia it costs less than tetrahedra") if feature is None else (solder, f"not ISPG: {feature}")


def drop_problems(drop: Drop, solder: Solder) -> list[Problem]:
    """Find problems of a drop before it runs; the first kind of check that fails ends the search.

    Args:
        drop: Volume, pad or wall, section, symmetry and resolution.
        solder: Fluid, effects and numerics.

    Returns:
        One ``Problem`` (key in the case file, message, value, allowed values) for each contradiction; empty for a valid
        case.
    """
    problems = _flow_problems(drop, solder) or _pad_problems(drop) or _section_problems(drop, solder)
    problems = problems or checks.ispg_problems(solder, _unverified_drop(drop, solder))
    problems = problems or _impact_problems(drop, solder)
    problems = problems or _resolution_problems(drop) or _symmetry_problems(drop, solder)
    problems = problems or _asymmetry_problems(drop, solder)
    return problems or _wall_problems(drop) or free_problems(drop, solder)


def pair_problems(pair: Drops, solder: Solder) -> list[Problem]:
    """Find problems of two drops before they run: too coarse, overlapping, or at an unsuitable distance.

    Args:
        pair: Volumes, distance, wall and resolution.
        solder: Fluid, effects and numerics.

    Returns:
        One ``Problem`` (key in the case file, message, value, allowed values) for each contradiction; empty for a valid
        case.
    """
    problems = _flow_problems(pair, solder) or checks.ispg_problems(solder, _unverified_pair(pair, solder))
    problems = problems or free_problems(pair, solder) or _pair_resolution(pair)
    return problems or _distance_problems(pair, solder)


def _flow_problems(scene: HasWall, solder: Solder) -> list[Problem]:
    """Find numerics that the scheme does not support, and liquid that never comes to rest."""
    return checks.scheme_problems(solder) + checks.effect_problems(solder, decide_drop(solder, scene.is_free))


def _section_problems(drop: Drop, solder: Solder) -> list[Problem]:
    """Find drops that cannot be computed in section: only uniform walls with free slip are supported."""
    if drop.section == "none":
        return []
    if solder.numerics.scheme != "ispg":
        message = f'a drop in section (drop.section = "{drop.section}") needs the scheme "ispg"'
        return [Problem("solder.numerics.scheme", message, solder.numerics.scheme, "ispg")]
    features = {
        "a free drop": drop.is_free,
        "a pad": drop.pad_radius is not None,
        "half of one": drop.symmetry != "none",
        "one that rubs on it": solder.wall != "free-slip",
    }
    for feature, is_met in features.items():
        if is_met:
            message = f"a section is computed of a drop on a uniform wall, not of {feature}"
            return [Problem("drop.section", message, drop.section, "none")]
    return []


def _unverified_drop(drop: Drop, solder: Solder) -> str | None:
    """Return the feature of a drop for which the scheme ispg is not verified; None if it is verified."""
    inertia, angle = decide_drop(solder, drop.is_free)["inertia"], _angle_at_rest(drop)
    fewest, most = SECTION_EDGES if drop.section != "none" else ISPG_EDGES if drop.hysteresis is None else HELD_EDGES
    rubs, (low, high) = solder.wall != "free-slip", FRICTION_EDGES
    on_pad, thin = FRICTION_PAD_EDGES, FILM_EDGES
    in_section, rests = drop.section != "none", drop.hysteresis or (angle,)
    smooth = not (rubs or in_section or drop.pad_radius or drop.hysteresis or drop.symmetry_axes)
    least = PLANE_ANGLE if drop.section == "plane" else FILM_ANGLE if smooth else ISPG_ANGLES[0]
    is_film = not all(_is_between(rest_angle) for rest_angle in rests)
    features = {
        "parts of free drops": drop.is_free and drop.symmetry != "none",
        f"{drop.count} particles along an edge of a free drop (for {FREE_EDGES[0]} to {FREE_EDGES[1]} it is)": (
            drop.is_free and not FREE_EDGES[0] <= drop.count <= FREE_EDGES[1]
        ),
        f"contact angles outside {deg(least)} to {deg(ISPG_ANGLES[1])} at rest": (
            not all(_is_between(rest_angle, least) for rest_angle in rests)
        ),
        f"{drop.count} particles along an edge below {deg(ISPG_ANGLES[0])} (for {thin[0]} to {thin[1]} it is)": (
            is_film and not thin[0] <= drop.count <= thin[1]
        ),
        "hysteresis in section": in_section and drop.hysteresis is not None,
        f"drops without inertia ({inertia['why']})": not inertia["on"],
        f"{drop.count} particles along an edge (for {fewest} to {most} it is)": not fewest <= drop.count <= most,
        f"{drop.count} particles along an edge on a wall with friction (for {low} to {high} it is)": (
            rubs and not low <= drop.count <= high
        ),
        f"{drop.count} particles along an edge on a pad with friction (for {on_pad[0]} to {on_pad[1]} it is)": (
            rubs and drop.pad_radius is not None and not on_pad[0] <= drop.count <= on_pad[1]
        ),
        f"{drop.count} particles along an edge on a pad (up to {ISPG_PAD_EDGE} it is)": (
            drop.pad_radius is not None and drop.count > ISPG_PAD_EDGE
        ),
    }
    return next((feature for feature, is_met in features.items() if is_met), None)


def _impact_problems(drop: Drop, solder: Solder) -> list[Problem]:
    """Find impacts for which no scheme is verified: wrong scheme, unsupported wall, resolution or speed."""
    if drop.speed is None:
        return []
    speed, (low, high) = f"{drop.speed:.4g} m/s", IMPACT_EDGES
    if solder.numerics.scheme != "ispg":
        message = f"a drop that strikes a wall (drop.speed = {speed}) needs the scheme ispg; or a case with [droplet]"
        return [Problem("solder.numerics.scheme", message, solder.numerics.scheme, "ispg")]
    features = {
        "a section": drop.section != "none",
        "a wall that is slid on freely (solder.wall)": solder.wall == "free-slip",
        "a pad": drop.pad_radius is not None,
        "planes of symmetry": drop.symmetry != "none",
        "hysteresis": drop.hysteresis is not None,
    }
    for feature, is_met in features.items():
        if is_met:
            return [Problem("drop.speed", f"an impact is not verified with {feature}", speed, "none")]
    if not low <= drop.count <= high:
        message = f"an impact is not verified for {drop.count} particles along an edge"
        return [Problem("drop.speed", message, speed, f"{low} to {high} along an edge")]
    scale = solder.density * drop.diameter
    weber, reynolds = scale * drop.speed**2 / solder.surface_tension, scale * drop.speed / solder.viscosity
    most = min(drop.speed * (IMPACT_WEBER / weber) ** 0.5, drop.speed * IMPACT_REYNOLDS / reynolds)
    if drop.speed > (1.0 + ROUNDING) * most:
        message = f"an impact at Weber number {weber:.3g}, Reynolds number {reynolds:.3g} is not verified"
        return [Problem("drop.speed", message, speed, f"<= {most:.4g} m/s")]
    return []


def _unverified_pair(pair: Drops, solder: Solder) -> str | None:
    """Return the feature of two drops for which the scheme ispg is not verified; None if it is verified."""
    inertia = decide_drop(solder, pair.is_free)["inertia"]
    features = {
        f"contact angles outside {deg(ISPG_ANGLES[0])} to {deg(ISPG_ANGLES[1])}": not _is_between(pair.contact_angle),
        "walls that hold the liquid": solder.wall != "free-slip",
        f"drops without inertia ({inertia['why']})": not inertia["on"],
        f"two drops of {pair.particles} particles (up to {ISPG_PAIR} it is)": pair.particles > ISPG_PAIR,
    }
    return next((feature for feature, is_met in features.items() if is_met), None)


def _angle_at_rest(drop: Drop) -> float | None:
    """Return the contact angle [rad] of a weightless drop at rest, pinned at the edge of its pad if possible."""
    if drop.pad_radius is None or drop.contact_angle is None:
        return drop.contact_angle
    return min(max(cap_angle(drop.volume, drop.pad_radius), drop.contact_angle), drop.mask_contact_angle)


def _is_between(angle: float | None, least: float = ISPG_ANGLES[0]) -> bool:
    """Return whether the scheme ispg is verified for a contact angle [rad], from a smallest angle [rad] on."""
    return angle is None or least - ROUNDING <= angle <= ISPG_ANGLES[1] + ROUNDING


def _pair_resolution(pair: Drops) -> list[Problem]:
    limit = min(pair.volumes) ** (1.0 / 3.0) / (FEWEST_PER_EDGE - 1)
    if pair.spacing > limit:
        message = f"too coarse for the smaller drop, of {mm3(min(pair.volumes))}"
        return [Problem("drops.spacing", message, mm(pair.spacing), f"<= {mm(limit)}")]
    return too_many("drops", pair.spacing, pair.particles)


def _distance_problems(pair: Drops, solder: Solder) -> list[Problem]:
    """Find drops that overlap, do not touch though they should merge, or touch though they should not."""
    apart, reach = _distances(pair, solder)
    value, clear = mm(pair.distance), reach + 2.0 * pair.spacing
    if pair.distance < apart:
        return [Problem("drops.distance", "the drops overlap at the start", value, f">= {mm(apart)}")]
    if pair.merge and pair.distance > reach:
        message = "drops.merge = true, but the drops do not reach each other"
        return [Problem("drops.distance", message, value, f"{mm(apart)} to {mm(reach)}")]
    if not pair.merge and pair.distance < clear:
        message = "drops.merge = false, but the drops would touch"
        return [Problem("drops.distance", message, value, f">= {mm(clear)}")]
    return []


def _distances(pair: Drops, solder: Solder) -> tuple[float, float]:
    """Return the distance of centres of initial contact, and the largest one with contact at rest [m]."""
    edges = [volume ** (1.0 / 3.0) for volume in pair.volumes]
    if pair.contact_angle is None:
        apart = sum(edge * (0.75 / pi) ** (1.0 / 3.0) for edge in edges)
        return apart, apart + 0.5 * pair.spacing
    weight = acting_weight(solder, decide_drop(solder, is_free=False))
    rest = [sessile_meridian(v, pair.contact_angle, solder.surface_tension, weight) for v in pair.volumes]
    return 0.5 * sum(edges), max(0.5 * sum(edges), 0.5 * sum(drop.max_width for drop in rest))


# Function that returns the unverified feature of each kind of scene.
UNVERIFIED_FEATURES: dict[type, Callable[[Any, Solder], str | None]] = {
    Drop: _unverified_drop,
    Joint: unverified_joint,
    Drops: _unverified_pair,
}


def oscillation_problems(scene: Oscillation, solder: Solder) -> list[Problem]:
    """Find a liquid so viscous that a drop of it returns to the sphere without oscillation.

    Args:
        scene: Free drop, of which the radius is used.
        solder: Density, viscosity and surface tension.

    Returns:
        One ``Problem`` (key, message, value, allowed values) if Lamb's decay rate of the second mode reaches Rayleigh's
        frequency; else empty.
    """
    decay = lamb_decay_rate(2, scene.radius, solder.density, solder.viscosity)
    frequency = rayleigh_frequency(2, scene.radius, solder.density, solder.surface_tension)
    if decay < frequency:
        return []
    value, limit = f"{solder.viscosity:.4g} Pa*s", f"< {solder.viscosity * frequency / decay:.4g} Pa*s"
    message = "a drop that is so small and viscous does not oscillate"
    return [Problem("solder.viscosity", message, value, limit)]


def free_problems(scene: HasWall, solder: Solder) -> list[Problem]:
    """Find effects that are switched on but need a wall, in a scene without one.

    Args:
        scene: Scene that may have a wall.
        solder: Solder, whose switches of effects are examined.

    Returns:
        One ``Problem`` (key, message, value, allowed values) for each; empty for a scene with a wall.
    """
    if not scene.is_free:
        return []
    switches = {effect.key: getattr(solder.effects, effect.name) for effect in LIQUID_EFFECTS if effect.needs_wall}
    message = "without a contact angle the scene has no wall: a free drop falls as a whole"
    return [Problem(key, message, switch, "auto, off") for key, switch in switches.items() if switch == "on"]


def _resolution_problems(drop: Drop) -> list[Problem]:
    if drop.spacing is None:
        return []
    if drop.particles_per_edge is not None:
        message = f"drop.particles_per_edge = {drop.particles_per_edge} is given as well"
        return [Problem("drop.spacing", message, mm(drop.spacing), "one of drop.spacing, drop.particles_per_edge")]
    limit = drop.edge / (FEWEST_PER_EDGE - 1)
    if drop.count < FEWEST_PER_EDGE:
        message = f"too coarse for a drop that starts as a cube of {mm(drop.edge)}"
        return [Problem("drop.spacing", message, mm(drop.spacing), f"<= {mm(limit)}")]
    return too_many("drop", drop.spacing, drop.particles)


def _symmetry_problems(drop: Drop, solder: Solder) -> list[Problem]:
    """Find a resolution or scheme that does not support planes of symmetry."""
    if drop.symmetry == "none":
        return []
    key, effects = "drop.symmetry", decide_drop(solder, drop.is_free)
    if drop.count % 2 == 0:
        message = f"with {drop.count} particles along an edge none lie in the plane of symmetry"
        return [Problem(key, message, drop.symmetry, "an odd number of particles along an edge")]
    flows = effects["inertia"]["on"] or effects["viscosity"]["on"]
    if solder.numerics.scheme == "gripc" or (flows and solder.numerics.scheme != "ispg"):
        message = (
            "symmetry needs a drop that relaxes to rest, without inertia or viscosity, or the scheme ispg; not gripc"
        )
        return [Problem(key, message, drop.symmetry, "none")]
    return []


def _asymmetry_problems(drop: Drop, solder: Solder) -> list[Problem]:
    """Find an effect that breaks the symmetry by which a drop is computed in part or in section."""
    effects = decide_drop(solder, drop.is_free)
    if (effect := asymmetric_effect(effects)) is None:
        return []
    for key, value in (("drop.symmetry", drop.symmetry), ("drop.section", drop.section)):
        if value != "none":
            message = f"{effect.name.replace('_', ' ')} breaks this symmetry: {effects[effect.name]['why']}"
            return [Problem(key, message, value, f'none, or {effect.key} = "off"')]
    return []


def _wall_problems(drop: Drop) -> list[Problem]:
    """Find inconsistent contact angles, and a pad without a contact angle."""
    hysteresis = {"receding_angle": drop.receding_angle, "advancing_angle": drop.advancing_angle}
    angles = {f"drop.{name}": value for name, value in hysteresis.items() if value is not None}
    key, value = next(iter(angles.items()), ("", 0.0))
    if drop.contact_angle is not None and angles:
        both = "drop.receding_angle and drop.advancing_angle, or drop.contact_angle"
        return [Problem(key, "a wall has hysteresis, or one contact angle", deg(value), both)]
    if len(angles) == 1:
        return [Problem(key, "one is given alone", deg(value), "drop.receding_angle with drop.advancing_angle")]
    if drop.hysteresis is not None and drop.hysteresis[0] >= drop.hysteresis[1]:
        allowed = f"< {deg(drop.hysteresis[1])}, the advancing angle"
        return [Problem(key, "a line recedes at a smaller angle than it advances at", deg(value), allowed)]
    if drop.pad_radius is not None and drop.contact_angle is None:
        message = "a pad needs a contact angle, and has no hysteresis here"
        return [Problem("drop.pad_radius", message, mm(drop.pad_radius), "only with drop.contact_angle")]
    return []


def _pad_problems(drop: Drop) -> list[Problem]:
    if drop.pad_radius is None or drop.contact_angle is None:
        return []
    pad, mask = degrees(drop.contact_angle), degrees(drop.mask_contact_angle)
    if pad >= mask:
        message = "the pad must be wetted better than the solder mask"
        return [Problem("drop.contact_angle", message, f"{pad:.4g} deg", f"< {mask:.4g} deg")]
    limit = SPACINGS_IN_PAD * drop.resolution
    if drop.pad_radius < limit:
        message = f"too small for a particle spacing of {mm(drop.resolution)} with a volume of {mm3(drop.volume)}"
        return [Problem("drop.pad_radius", message, mm(drop.pad_radius), f">= {mm(limit)}")]
    return []
