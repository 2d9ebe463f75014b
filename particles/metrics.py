"""Numbers of a joint at rest, and their comparison with the Young-Laplace reference."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from particles.body import Body
from particles.contact_line import ON_MASK, ON_PAD, ContactLine
from particles.flow import LiquidFlow
from particles.force_gravity import Gravity
from particles.force_wetting import Wetting
from particles.geometry import JointGeometry
from particles.parameters import Solder
from particles.plate_force import plate_wrench
from particles.rest import Run
from particles.surface_measure import ring_area
from particles.time_step import capillary_limit
from particles.young_laplace import Meridian, NoMeridian, joint_meridian

Floats = NDArray[np.float64]
Metrics = dict[str, tuple[float, str]]


def joint_metrics(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    """Collect the numbers of a joint at the end of its run: name to SI value and unit.

    The scatter of the pressure is its standard deviation over the capillary pressure of a sphere of the joint's width.
    """
    below = particle_pressure(flow)[flow.body.cloud.surface_count :]
    capillary = 4.0 * solder.surface_tension / run.profiles[-1].max_width
    pressure: Metrics = {
        "mean_pressure": (float(below.mean()), "Pa"),
        "pressure_scatter": (float(below.std() / capillary), ""),
    }
    return _shape_at_rest(geometry, solder, flow, run) | pressure | _cost_and_rest(solder, flow, run)


def _weight(flow: LiquidFlow) -> float:
    """Weight of the unit volume that acts [N/m^3]; zero without gravity."""
    return sum(force.weight for force in flow.physics.forces if isinstance(force, Gravity))


def particle_pressure(flow: LiquidFlow) -> Floats:
    """Pressure of the particles above ambient `(n,)` [Pa], with the hydrostatic part that acts as a surface force."""
    return flow.body.pressure - _weight(flow) * flow.body.points[:, 2]


def contact_radius(body: Body, wall: int) -> float:
    """Radius of the disc that has the wetted area of a wall [m]."""
    return float(np.sqrt(ring_area(body.points, body.cloud.rings[wall]) / np.pi))


def mean_angle(cosines: Floats) -> float:
    """Contact angle of a mean cosine [deg]."""
    return float(np.degrees(np.arccos(np.clip(cosines.mean(), -1.0, 1.0))))


def verdict(lines: Sequence[ContactLine], ruptured: bool) -> str:
    """Judge a joint: "open", "overflow", "dewetted" or "ok"."""
    if ruptured:
        return "open"
    states = np.concatenate([line.state for line in lines])
    if (states == ON_MASK).any():
        return "overflow"
    return "dewetted" if (states == ON_PAD).any() else "ok"


def _shape_at_rest(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    body, profile = flow.body, run.profiles[-1]
    others = tuple(force for force in flow.physics.forces if not isinstance(force, Wetting))
    weight = _weight(flow)
    angles = Wetting(solder.surface_tension, flow.physics.lines, others).contact_cosines(body)
    volume = body.volume()[0]
    reference = reference_meridian(geometry, solder, weight)
    return {
        "volume": (volume, "m^3"),
        "volume_drift": (volume / solder.volume - 1.0, ""),
        "standoff": (geometry.gap, "m"),
        "max_width": (profile.max_width, "m"),
        "waist": (profile.waist, "m"),
        "contact_radius_board": (contact_radius(body, 0), "m"),
        "contact_radius_package": (contact_radius(body, 1), "m"),
        "contact_angle_board": (mean_angle(angles[0]), "deg"),
        "contact_angle_package": (mean_angle(angles[1]), "deg"),
        "axial_force": (float(plate_wrench(body, others, 1)[2]), "N"),
        "width_error": (profile.max_width / reference.max_width - 1.0 if reference else float("nan"), ""),
    }


def _cost_and_rest(solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    limit = capillary_limit(solder.density, flow.body.cloud.spacing, solder.surface_tension)
    last, count = run.records[-1], len(flow.body.points)
    return {
        "capillary_number_at_rest": (solder.viscosity * last.speed / solder.surface_tension, ""),
        "time_step_over_capillary_limit": (max(record.time_step for record in run.records) / limit, ""),
        "particles": (float(count), ""),
        "steps": (float(len(run.records)), ""),
        "seconds": (run.seconds, "s"),
        "particle_steps_per_second": (count * len(run.records) / run.seconds, "1/s"),
    }


def reference_meridian(geometry: JointGeometry, solder: Solder, weight: float) -> Meridian | None:
    """Young-Laplace meridian of a coaxial joint with Gibbs' condition at the edges; none without equilibrium."""
    if not geometry.is_coaxial:
        return None
    try:
        return joint_meridian(
            solder.volume,
            geometry.radius_board,
            geometry.radius_package,
            geometry.gap,
            solder.surface_tension,
            weight,
            angle_limits=(solder.pad_contact_angle, solder.mask_contact_angle),
        )
    except NoMeridian:
        return None
