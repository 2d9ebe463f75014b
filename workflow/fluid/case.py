"""Cases of a liquid that flows: a dam break, a channel, vortices, droplets; what does not fit together in them."""

from math import ceil
from typing import Any

from reflowshock.particles.parameters.droplets import LEAST_SOUND_SPEED, Droplet, cap
from reflowshock.particles.parameters.flows import DamBreak, Poiseuille, SphFlow, TaylorGreen
from reflowshock.particles.parameters.printing import Printing
from reflowshock.particles.parameters.rheology import Rheology
from reflowshock.problem import Problem
from reflowshock.units import from_si
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Pipeline, Stage, report_of

LEAST_PITCH = 0.25  # over the diameter of a drop: less is no pattern, but a pile
FEWEST_ACROSS = 8.0  # particles across a droplet: fewer resolve no surface
FEWEST_HIGH = 3.4  # particles in the height of a cap at rest: widths are up to 14 % off with 2.9 to 3.3
LARGEST_REYNOLDS = 1000.0  # of vortices and channels: beyond they are turbulent, and no exact solution holds


def _flow_of(scene: str, *products: str) -> Pipeline:
    """The flow of one scene with its products, and its report."""
    files = ("flow.h5", "particles.vtu", *products)
    particles = Stage("particles", (scene,), (), tuple(f"particles/{name}" for name in files))
    return Pipeline((particles, report_of("particles")))


class FlowCase(Case):
    """A liquid that flows; the table that names the kind holds its scene."""

    @property
    def scene(self) -> Any:
        """The flow."""
        return getattr(self, self.kind)


class DamBreakCase(FlowCase):
    """A column of liquid in a tank is let go."""

    kind = "dam_break"
    stages = _flow_of("dam_break")

    dam_break: DamBreak


class PoiseuilleCase(FlowCase):
    """Liquid between two plates is set in motion."""

    kind = "poiseuille"
    stages = _flow_of("poiseuille")

    poiseuille: Poiseuille


class TaylorGreenCase(FlowCase):
    """Vortices in a periodic box."""

    kind = "taylor_green"
    stages = _flow_of("taylor_green")

    taylor_green: TaylorGreen


class DropletCase(FlowCase):
    """A droplet: free, at rest on a wall, or striking it."""

    kind = "droplet"
    stages = _flow_of("droplet")

    droplet: Droplet


class PrintingCase(FlowCase):
    """Drops of ink are printed on a plate and on each other."""

    kind = "printing"
    stages = _flow_of("printing", "part.stl", "height_map.npy", "height_map.csv", "height_map.png", "layers.csv")

    printing: Printing


def of_printing(case: PrintingCase) -> list[Problem]:
    """Find drops on top of each other, particles that are too large, sound that is too slow, too short delays."""
    scene = case.printing
    found, numerics = _of_particles("printing", scene.drop) + of_rheology("printing", scene), scene.numerics
    least = LEAST_PITCH * scene.length
    if scene.pitch < least:
        allowed = f">= {micrometres(least)}, {LEAST_PITCH:g} diameters of a drop"
        found.append(Problem("printing.pitch", "drops would land on each other", micrometres(scene.pitch), allowed))
    if scene.delay < scene.length / scene.speed:
        allowed = f">= {from_si(scene.length / scene.speed, 'us', digits=3)}, in which a drop goes its diameter"
        delay = from_si(scene.delay, "us", digits=3)
        found.append(Problem("printing.delay", "a drop would land in the one before", delay, allowed))
    found += _of_freezing(scene)
    if numerics.device != "cpu":
        found.append(Problem("printing.numerics.device", "prints on the processor only", numerics.device, "cpu"))
    return found


def _of_freezing(scene: Printing) -> list[Problem]:
    """Find a plate that freezes nothing, drops that land frozen, light where drops freeze, and too short delays."""
    freezing = scene.freezing
    if freezing is None:
        message, allowed = "no [printing.freezing] is given", "auto, off"
        on = scene.effects.freezing == "on"
        return [Problem("printing.effects.freezing", message, "on", allowed)] if on else []
    melting = from_si(freezing.melting_point, "degC", digits=4)
    if freezing.substrate_temperature >= freezing.melting_point:
        value = from_si(freezing.substrate_temperature, "degC", digits=4)
        allowed = f"< {melting}, the melting point"
        return [Problem("printing.freezing.substrate_temperature", "freezes nothing", value, allowed)]
    if freezing.temperature < freezing.melting_point:
        value, allowed = from_si(freezing.temperature, "degC", digits=4), f">= {melting}, the melting point"
        return [Problem("printing.freezing.temperature", "drops would land frozen", value, allowed)]
    if not scene.freezes:
        return []
    if scene.cure is not None:
        allowed = "printing.cure or printing.freezing; effects.freezing = off leaves the cure"
        return [Problem("printing.cure", "drops freeze before light cures them", "given", allowed)]
    if scene.drops > 1 and scene.delay < scene.cooling_time:
        delay, least = (from_si(one, "us", digits=4) for one in (scene.delay, scene.cooling_time))
        allowed = f">= {least}, in which a drop freezes and cools down to the plate"
        return [Problem("printing.delay", "a drop would land on one that is still warm", delay, allowed)]
    return []


def of_droplet(case: DropletCase) -> list[Problem]:
    """Find what is said twice or half, sound that is too slow for the impact, and particles that are too large."""
    drop, found = case.droplet, []
    given = drop.model_fields_set
    if drop.weber is not None and drop.speed is not None:
        weber = drop.density * drop.speed**2 * drop.diameter / drop.surface_tension
        allowed = f"speed or weber; this speed makes the Weber number {weber:.4g}"
        found.append(Problem("droplet.weber", "the speed is given, too", drop.weber, allowed))
    if drop.reynolds is not None and "viscosity" in given:
        allowed = "viscosity or reynolds"
        found.append(Problem("droplet.reynolds", "the viscosity is given, too", drop.reynolds, allowed))
    if drop.reynolds is not None and not drop.impact_speed:
        allowed = "together with droplet.speed or droplet.weber"
        found.append(Problem("droplet.reynolds", "says nothing without an impact", drop.reynolds, allowed))
    found += _of_particles("droplet", drop) + of_rheology("droplet", drop) + _of_hysteresis(drop)
    height = cap(drop.angle)[1] * drop.diameter
    if drop.has_wall and not drop.impact_speed and drop.spacing > height / FEWEST_HIGH:
        message = f"is too large for the cap of {_degrees(drop.angle)}, {micrometres(height)} high"
        allowed = f"<= {micrometres(height / FEWEST_HIGH)}, {ceil(FEWEST_HIGH * drop.diameter / height)} a diameter"
        found.append(Problem("droplet.numerics.spacing", message, micrometres(drop.spacing), allowed))
    if drop.has_wall and drop.start != "sphere":
        found.append(Problem("droplet.start", "only a free drop starts as a cube", drop.start, "sphere"))
    return found


def _of_hysteresis(drop: Droplet) -> list[Problem]:
    """Find advancing and receding angles without a wall, or on the wrong side of the contact angle."""
    found = []
    for name, given, side in (("advancing", drop.advancing_angle, 1.0), ("receding", drop.receding_angle, -1.0)):
        key = f"droplet.{name}_angle"
        if given is not None and not drop.has_wall:
            found.append(Problem(key, "says nothing without a wall", _degrees(given), "together with a contact angle"))
        elif given is not None and side * (given - drop.angle) < 0.0:
            allowed = f"{'>=' if side > 0.0 else '<='} {_degrees(drop.angle)}, the contact angle"
            found.append(Problem(key, "is on the wrong side of the contact angle", _degrees(given), allowed))
    return found


def _of_particles(kind: str, drop: Droplet) -> list[Problem]:
    """Find a spacing said twice, particles that are too large for a drop, and sound that is too slow."""
    found, numerics = [], drop.numerics
    if numerics.spacing is not None and numerics.particles_per_diameter is not None:
        allowed = "numerics.spacing or numerics.particles_per_diameter"
        message = "the particles per diameter are given, too"
        found.append(Problem(f"{kind}.numerics.spacing", message, micrometres(numerics.spacing), allowed))
    if drop.spacing > drop.diameter / FEWEST_ACROSS:
        allowed = f"<= {micrometres(drop.diameter / FEWEST_ACROSS)}, {FEWEST_ACROSS:g} particles across the drop"
        message = "is too large for this drop"
        found.append(Problem(f"{kind}.numerics.spacing", message, micrometres(drop.spacing), allowed))
    if numerics.sound_speed < LEAST_SOUND_SPEED:
        change, least = 100.0 / numerics.sound_speed**2, ceil(LEAST_SOUND_SPEED)
        message = f"sound is too slow for {drop.fastest:.3g} m/s: densities would change by {change:.2g} %"
        allowed = f">= {least}, {from_si(least * drop.fastest, 'm/s', digits=3)}"
        found.append(Problem(f"{kind}.numerics.sound_speed", message, numerics.sound_speed, allowed))
    return found


def of_dam_break(case: DamBreakCase) -> list[Problem]:
    """Find a column that does not fit in its tank, and a sensor that is not at its wall."""
    dam, found = case.dam_break, of_rheology("dam_break", case.dam_break)
    if dam.width > dam.tank_length - dam.spacing:
        allowed = f"> dam_break.width = {metres(dam.width)}"
        found.append(
            Problem("dam_break.tank_length", "leaves the column no way to flow", metres(dam.tank_length), allowed)
        )
    if dam.width < dam.spacing:
        allowed = f">= {metres(dam.spacing)}, the spacing of the particles"
        found.append(Problem("dam_break.width", "is less than one particle", metres(dam.width), allowed))
    if dam.sensor_height > 4.0 * dam.height:
        allowed = f"<= {metres(4.0 * dam.height)}, 4 times dam_break.height"
        found.append(Problem("dam_break.sensor_height", "is above the tank's wall", metres(dam.sensor_height), allowed))
    return found


def of_viscous(case: FlowCase) -> list[Problem]:
    """Find a Reynolds number at which the exact solution is none that is seen, and viscosity that is left out."""
    scene: SphFlow = case.scene
    found = of_rheology(case.kind, scene)
    if isinstance(scene, TaylorGreen) and scene.rheology is not None:
        message = "no exact solution is known"
        found.append(Problem(f"{case.kind}.rheology", message, scene.rheology.law, "constant viscosity"))
    if scene.reynolds_number > LARGEST_REYNOLDS:
        least = scene.viscosity * scene.reynolds_number / LARGEST_REYNOLDS
        message = f"makes the Reynolds number {scene.reynolds_number:.3g}, at which the exact flow is not stable"
        found.append(
            Problem(
                f"{case.kind}.viscosity",
                message,
                from_si(scene.viscosity, "Pa*s", digits=3),
                ">= " + from_si(least, "Pa*s", digits=3),
            )
        )
    if scene.effects.viscosity == "off":
        message = "without viscosity nothing is left of this flow"
        found.append(Problem(f"{case.kind}.effects.viscosity", message, "off", "auto, on"))
    return found


def of_rheology(kind: str, scene: SphFlow) -> list[Problem]:
    """Find keys of the other law, and a viscosity at infinity that is none."""
    rheology: Rheology | None = scene.rheology
    if rheology is None:
        return []
    other = "viscosity_at_infinity" if rheology.law == "power_law" else "bound"
    if other in rheology.model_fields_set:
        value = getattr(rheology, other)
        return [Problem(f"{kind}.rheology.{other}", f"says nothing in the law {rheology.law}", value, "leave it out")]
    if rheology.viscosity_at_infinity >= scene.liquid_viscosity:
        value = from_si(rheology.viscosity_at_infinity, "mPa*s", digits=3)
        allowed = f"< {from_si(scene.liquid_viscosity, 'mPa*s', digits=3)}, the viscosity at rest"
        return [Problem(f"{kind}.rheology.viscosity_at_infinity", "is not below that at rest", value, allowed)]
    return []


def _degrees(angle: float) -> str:
    return from_si(angle, "deg", digits=3)


def metres(length: float) -> str:
    """Write a length [m]."""
    return from_si(length, "m", digits=3)


def micrometres(length: float) -> str:
    """Write a small length [m]."""
    return from_si(length, "um", digits=3)
