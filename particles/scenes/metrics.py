"""Metrics of a joint or drop at rest, and their comparison with the Young-Laplace reference.

Metrics are a dictionary: name -> SI value and unit.
"""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core import winding_numbers
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.geometry import LARGEST_WIDTH_CHANGE, JointGeometry
from reflowshock.particles.core.surface_measure import ring_area, wall_corners
from reflowshock.particles.core.symmetry import on_plane, whole_points
from reflowshock.particles.ispg.energy_budget import total_losses
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.forces import Gravity, Wetting
from reflowshock.particles.physics.physics import BodyForce, Force, plate_wrench
from reflowshock.particles.reference.shape_error import shape_error
from reflowshock.particles.reference.young_laplace import Meridian
from reflowshock.particles.scenes.reference_shapes import reference_drop, reference_meridian, width_change_bound
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run
from reflowshock.particles.steps.shape import JointShape
from reflowshock.particles.steps.time_step import capillary_limit
from reflowshock.particles.surface.contact_line import ON_MASK, ON_PAD, ContactLine

Metrics = dict[str, tuple[float, str]]
LITTLE = 1e-3  # spacings
JOINT_NAMES = {
    "height": "drop_height",
    "height_error": "drop_height_error",
    "max_width_error": "width_error",
    "contact_radius": "contact_radius_board",
    "contact_angle": "contact_angle_board",
}


def joint_metrics(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    """Return the metrics of a joint at the end of its run: name -> (SI value, unit; angles in deg).

    They are sizes, contact angles, pressure, axial force, time to rest, cost and energy budget. Errors refer to the
    Young-Laplace joint; they are nan if it does not exist.

    Args:
        geometry: Final gap, radii, offset and tilt of the joint.
        solder: Volume, contact angles and fluid.
        flow: Flow at the end of the run: body, physics and time.
        run: Steps of the run: a record and a profile of each, and snapshots.
    """
    reference = reference_meridian(geometry, solder, _reference_weight(flow))
    errors = _joint_errors(solder, flow, run, reference) | _width_error(geometry, solder, flow, run)
    shape = _joint_shape(geometry, solder, flow, run) | errors
    rest = _cost_and_rest(solder, flow, run) | energy_metrics([flow])
    return _volume(solder, flow) | shape | _pressure(solder, flow, run, reference) | rest


def drop_metrics(solder: Solder, pad_radius: float, flow: LiquidFlow, run: Run) -> Metrics:
    """Return the metrics of a drop on a pad at the end of its run, with errors against its reference.

    Args:
        solder: Volume, contact angles and fluid.
        pad_radius: Radius of the pad [m], infinite for a uniform wall.
        flow: Flow at the end of the run: body, physics and time.
        run: Steps of the run: a record and a profile of each, and snapshots.

    Returns:
        Metrics of ``body_metrics``: name -> (SI value, unit; angles in deg).
    """
    return body_metrics(solder, reference_drop(solder, pad_radius, _reference_weight(flow)), flow, run)


def body_metrics(solder: Solder, reference: Meridian | None, flow: LiquidFlow, run: Run) -> Metrics:
    """Return the metrics of a drop: name -> (SI value, unit; angles in deg).

    They are sizes, contact radius and angles, pressure, time to rest, cost and energy budget. Contact radius and angles
    are omitted without contact lines.

    Args:
        solder: Volume, contact angles and fluid.
        reference: Exact meridian; None omits the errors.
        flow: Flow at the end of the run: body, physics and time.
        run: Steps of the run: a record and a profile of each, and snapshots.
    """
    profile = run.profiles[-1]
    height, width = profile.drop_height(len(flow.body.cloud.rings)), profile.max_width
    shape: Metrics = {"height": (height, "m"), "max_width": (width, "m")}
    if reference is not None:
        shape["height_error"] = (height / reference.height - 1.0, "")
        shape["max_width_error"] = (width / reference.max_width - 1.0, "")
    if flow.physics.lines:
        shape |= _contact(solder, flow, reference)
    rest = _cost_and_rest(solder, flow, run) | energy_metrics([flow])
    return _volume(solder, flow) | shape | _pressure(solder, flow, run, reference) | rest


def with_shape_error(
    shape: JointShape, solder: Solder, reference: Meridian | None, surface: Body | None = None
) -> JointShape:
    """Return a copy with the metric ``shape_error``: RMS distance to the reference over the cube root of the volume.

    Args:
        shape: Shape at rest.
        solder: Solder with the volume of the shape.
        reference: Exact meridian; None leaves the shape unchanged, as do open and bridged joints.
        surface: Body on whose surface the error is measured; None for the surface of the shape.
    """
    if reference is None or shape.verdict in ("open", "bridged"):
        return shape
    measured = shape if surface is None else surface
    error = shape_error(measured.points, measured.triangles, reference) / float(np.cbrt(solder.volume))
    return replace(shape, metrics=shape.metrics | {"shape_error": (error, "")})


def _contact(solder: Solder, flow: LiquidFlow, reference: Meridian | None) -> Metrics:
    """Return the radius of the wetted area, and the mean, smallest and largest contact angle."""
    cosines = _contact_cosines(solder, flow)[0]
    angle, angles = mean_angle(cosines), np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    contact: Metrics = {
        "contact_radius": (contact_radius(flow.body, 0), "m"),
        "contact_angle": (angle, "deg"),
        "contact_angle_min": (float(angles.min()), "deg"),
        "contact_angle_max": (float(angles.max()), "deg"),
    }
    if reference is not None:
        contact["contact_angle_error"] = (angle - float(np.degrees(reference.angle_board)), "deg")
    return contact


def drop_errors(solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    """Return the errors in height and shape of a drop on one pad against the exact drop of its volume.

    Args:
        solder: Volume of the drop, contact angles and fluid.
        flow: Flow at the end of the run: body, physics and time.
        run: Steps of the run: a record and a profile of each, and snapshots.

    Returns:
        ``drop_height_error``, relative to the height, and ``drop_shape_error``, relative to the cube root of the
        volume; empty for a pendant drop with weight, which has no reference.
    """
    body, plate, pad = flow.body, flow.body.plates[0], flow.physics.lines[0].pads[0]
    volume, weight = body.volume()[0], _reference_weight(flow)
    if weight and plate.side > 0.0:
        return {}
    exact = reference_drop(solder.model_copy(update={"volume": volume}), pad.radius, weight)
    if exact is None:
        return {}
    upright = plate.local(body.points[: body.cloud.surface_count]) * np.array([1.0, 1.0, -plate.side])
    error = shape_error(upright, body.triangles, exact) / float(np.cbrt(volume))
    height = run.records[-1].height / exact.height - 1.0
    return {"drop_height_error": (height, ""), "drop_shape_error": (error, "")}


def open_metrics(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    """Return the metrics of an open joint with a drop on the board, under the names of a joint; axial force 0.

    Args:
        geometry: Geometry of the joint; its gap is the standoff.
        solder: Volume of the drop, contact angles and fluid.
        flow: Flow of the drop at the end of its run.
        run: Steps of that run.

    Returns:
        Name -> (SI value, unit; angles in deg).
    """
    drop = drop_metrics(solder, geometry.radius_board, flow, run)
    renamed = {JOINT_NAMES.get(name, name): number for name, number in drop.items()}
    return renamed | {"standoff": (geometry.gap, "m"), "axial_force": (0.0, "N")}


def bridge_metrics(gap: float, solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    """Return the metrics of joints that merged into one body between two plates, without errors.

    Args:
        gap: Distance of the plates [m].
        solder: Solder with the total volume of the joints.
        flow: Flow of the common body at the end of its run.
        run: Steps of that run.

    Returns:
        Name -> (SI value, unit) of volume, ``standoff``, ``length`` along x, axial force, pressure, rest and cost.
    """
    length = float(np.ptp(flow.body.points[:, 0]))
    shape: Metrics = {"standoff": (gap, "m"), "length": (length, "m"), "axial_force": (axial_force(flow), "N")}
    return _volume(solder, flow) | shape | _pressure(solder, flow, run, None) | _cost_and_rest(solder, flow, run)


def _weight(flow: LiquidFlow) -> float:
    """Return the active specific weight rho g [N/m^3]; zero without gravity."""
    return sum(force.weight for force in flow.physics.forces if isinstance(force, Gravity))


def _reference_weight(flow: LiquidFlow) -> float | None:
    """Return the specific weight of the Young-Laplace reference [N/m^3]; None if the shape is not axisymmetric."""
    return _weight(flow) if flow.physics.is_axisymmetric else None


def particle_pressure(flow: LiquidFlow) -> Floats:
    """Return the pressure above ambient at the particles of a flow's body, hydrostatic part included, shape (n,) [Pa].

    Gravity acts as a surface force, so the pressure of the solver lacks the hydrostatic part.
    """
    body = flow.body.whole()
    pressure = body.pressure
    for force in flow.physics.forces:
        if isinstance(force, BodyForce):
            pressure = pressure + force.hydrostatic_pressure(body.points)
    return pressure


def contact_radius(body: Body, wall: int) -> float:
    """Return the radius of a disc with the area that a body wets on a wall [m].

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        wall: Index of the wall in ``body.plates``.
    """
    line = whole_points(body.cloud, body.points, wall)[0]
    return float(np.sqrt(ring_area(line, np.arange(len(line), dtype=np.int32)) / np.pi))


def mean_angle(cosines: Floats) -> float:
    """Return the contact angle whose cosine is the mean of ``cosines`` [deg].

    Args:
        cosines: Cosine of the contact angle at each vertex of a contact line, shape (k,).
    """
    return float(np.degrees(np.arccos(np.clip(cosines.mean(), -1.0, 1.0))))


def verdict(lines: Sequence[ContactLine], ruptured: bool) -> str:
    """Return the verdict on a joint or drop as a word.

    Args:
        lines: Contact lines of the body.
        ruptured: Whether the neck has ruptured.

    Returns:
        The first that applies: "open" (neck ruptured), "bridged" (line on several pads), "overflow" (on the mask),
        "dewetted" (off the edge), "ok".
    """
    if ruptured:
        return "open"
    if any(len(line.wetted_pads()) > 1 for line in lines):
        return "bridged"
    with_edge = [line for line in lines if line.has_edge]
    if any((line.state == ON_MASK).any() for line in with_edge):
        return "overflow"
    return "dewetted" if any((line.state == ON_PAD).any() for line in with_edge) else "ok"


def _contact_cosines(solder: Solder, flow: LiquidFlow) -> list[Floats]:
    """Return the cosines of the contact angles along each contact line, by the balance of forces."""
    return Wetting(solder.surface_tension, flow.physics.lines, _others(flow)).contact_cosines(flow.body)


def _others(flow: LiquidFlow) -> tuple[Force, ...]:
    """Return all forces except wetting."""
    return tuple(force for force in flow.physics.forces if not isinstance(force, Wetting))


def _volume(solder: Solder, flow: LiquidFlow) -> Metrics:
    volume = flow.body.cloud.parts * flow.body.volume()[0]
    return {"volume": (volume, "m^3"), "volume_drift": (volume / solder.volume - 1.0, "")}


def _joint_shape(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    body, profile = flow.body, run.profiles[-1]
    angles = _contact_cosines(solder, flow)
    return {
        "standoff": (geometry.gap, "m"),
        "max_width": (profile.max_width, "m"),
        "waist": (profile.waist, "m"),
        "contact_radius_board": (contact_radius(body, 0), "m"),
        "contact_radius_package": (contact_radius(body, 1), "m"),
        "contact_angle_board": (mean_angle(angles[0]), "deg"),
        "contact_angle_package": (mean_angle(angles[1]), "deg"),
        "axial_force": (axial_force(flow), "N"),
    }


def _joint_errors(solder: Solder, flow: LiquidFlow, run: Run, reference: Meridian | None) -> Metrics:
    """Return the errors against the reference, NaN without one; the force is over pi gamma and the contact radius."""
    if reference is None:
        return {name: (float("nan"), "") for name in ("waist_error", "axial_force_error")}
    profile = run.profiles[-1]
    scale = np.pi * solder.surface_tension * min(contact_radius(flow.body, wall) for wall in (0, 1))
    return {
        "waist_error": (profile.waist / reference.waist - 1.0, ""),
        "axial_force_error": ((axial_force(flow) - reference.axial_force) / scale, ""),
    }


def _width_error(geometry: JointGeometry, solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    """Return the width error against the coaxial joint of the same gap, NaN for large offsets, and its uncertainty."""
    bound, error = width_change_bound(geometry), float("nan")
    if bound <= LARGEST_WIDTH_CHANGE:
        upright = replace(geometry, offset=(0.0, 0.0), tilt=(0.0, 0.0))
        reference = reference_meridian(upright, solder, _reference_weight(flow))
        if reference is not None:
            error = run.profiles[-1].max_width / reference.max_width - 1.0
    return {"width_error": (error, ""), "width_reference_error": (bound, "")}


def axial_force(flow: LiquidFlow) -> float:
    """Return the force of the liquid on the package (the second plate of the flow's body) along +z [N]."""
    on_package = [wall for wall, plate in enumerate(flow.body.plates) if plate.side > 0.0]
    return float(sum(plate_wrench(flow.body, _others(flow), wall)[2] for wall in on_package))


def _pressure(solder: Solder, flow: LiquidFlow, run: Run, reference: Meridian | None) -> Metrics:
    """Return the mean pressure of the particles below the surface, its error and its scatter.

    The scatter is the standard deviation from the hydrostatic pressure, over the capillary pressure of a sphere of the
    body's width.
    """
    body = flow.body.whole()
    first = body.cloud.surface_count
    mean = float(particle_pressure(flow)[first:].mean())
    capillary = 4.0 * solder.surface_tension / run.profiles[-1].max_width
    metrics: Metrics = {"mean_pressure": (mean, "Pa")}
    if reference is not None:
        exact = reference.pressure - _weight(flow) * float(body.points[first:, 2].mean())
        metrics["mean_pressure_error"] = (mean / exact - 1.0, "")
    return metrics | {"pressure_scatter": (float(body.pressure[first:].std() / capillary), "")}


def _cost_and_rest(solder: Solder, flow: LiquidFlow, run: Run) -> Metrics:
    limit = capillary_limit(solder.density, flow.body.cloud.spacing, solder.surface_tension)
    last, count = run.records[-1], len(flow.body.points)
    return {
        "at_rest": (float(run.at_rest), ""),
        "time_at_rest": (run.time_at_rest, "s"),
        "particles_lost": (float(particles_lost(flow.body)), ""),
        "capillary_number_at_rest": (solder.viscosity * last.speed / solder.surface_tension, ""),
        "time_step_over_capillary_limit": (max(record.time_step for record in run.records) / limit, ""),
        "particles": (float(count), ""),
        "steps": (float(len(run.records)), ""),
        "seconds": (run.seconds, "s"),
        "particle_steps_per_second": (count * len(run.records) / run.seconds, "1/s"),
    }


def particles_lost(body: Body) -> int:
    """Return the number of interior particles outside the body: beyond the surface or a wall, or detached from a wall.

    Particles on a wall are tested slightly above it. At planes of symmetry the mirror image of the body closes it.
    """
    body = body.enclosing()
    cloud, inside, corners = body.cloud, body.points.copy(), [body.points[body.triangles]]
    for wall, plate in enumerate(body.plates):
        inside[cloud.wall == wall] -= LITTLE * cloud.spacing * plate.side * plate.normal
    for wall, plate in enumerate(body.plates):
        line = whole_points(cloud, body.points, wall)[0]
        fan = wall_corners(line, np.arange(len(line), dtype=np.int32), plate)
        corners.append(fan)
    for axis in cloud.symmetry:
        image = np.array([-1.0 if axis == other else 1.0 for other in range(3)])
        corners[0] = np.concatenate((corners[0], (corners[0] * image)[:, ::-1]))
        inside[on_plane(cloud, axis), axis] = LITTLE * cloud.spacing
    below = inside[cloud.surface_count :]
    return int((winding_numbers.at_points(below, np.concatenate(corners)) < 0.5).sum())


def energy_metrics(flows: Sequence[LiquidFlow]) -> Metrics:
    """Return the metrics of the energy budget, name -> (value, unit): losses by cause, imbalance, sliding speed.

    Losses and imbalance are over the initial energy; a body may slide on smooth walls for ever.

    Args:
        flows: Flows of all bodies, whose losses are added. Only the scheme ispg has a budget; without one the result is
            empty.
    """
    moved = [(flow, flow.solver.state, flow.solver.first_energy) for flow in flows if isinstance(flow.solver, IspgStep)]
    started = [(flow, state, first) for flow, state, first in moved if state is not None]
    if not started:
        return {}
    first = sum(energy for _, _, energy in started)
    now = sum(flow.physics.energy(flow.body) + (state.kinetic or 0.0) for flow, state, _ in started)
    lost = total_losses([state.losses for _, state, _ in started])
    metrics: Metrics = {f"{entry.name}_loss": (getattr(lost, entry.name) / first, "") for entry in fields(lost)}
    slides = max(float(np.linalg.norm(state.volumes @ state.velocity)) / state.volumes.sum() for _, state, _ in started)
    return metrics | {"energy_imbalance": ((now + lost.total) / first - 1.0, ""), "slide_speed": (slides, "m/s")}
