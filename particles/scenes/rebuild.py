"""Remeshing of bodies: merge two that touch, remesh one with collapsed triangles, or split a joint.

A joint whose neck has collapsed becomes two drops, one on each pad.

Volume and momentum are kept. A body on walls is closed by its mirror image behind each of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.grid import Grid
from reflowshock.particles.core.plate import Plate
from reflowshock.particles.ispg.adaptation import restore_moments
from reflowshock.particles.ispg.ispg_step import IspgStep
from reflowshock.particles.ispg.motion_transfer import MovingBody, transfer_motion
from reflowshock.particles.ispg.nodal_volumes import body_moments
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.metrics import Metrics, drop_errors, energy_metrics, particle_pressure, particles_lost
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import Run, StopRule, run_to_rest
from reflowshock.particles.steps.shape import JointShape, concatenate_shapes, shifted_indices
from reflowshock.particles.surface.cloud_level_set import CannotRebuild, boundary_loops, cloud_from_level_set, with_lids
from reflowshock.particles.surface.level_set import LevelSet, measure_depths, signed_distance, smooth_union
from reflowshock.particles.surface.morphological_closing import smooth_slits
from reflowshock.particles.surface.profile import Profile, fit_profile

CONTACT_SPACINGS = 1.0
NECK_SPACINGS = 2.5  # a gap narrower than half of this closes: wider than the contact distance, so a neck always forms
CLOSING_SPACINGS = 0.5
VELOCITY_NEIGHBOURS = 4
SHORTEST_EDGE = 0.25
LOWEST_QUALITY = 0.25
# A neck closer to a plate leaves a drop too thin for particles.
FEWEST_SPACINGS = 2.0
JOINT_METRICS = ("volume", "volume_drift", "standoff", "steps", "seconds", "time_step_over_capillary_limit")
FlowAndRun = tuple[LiquidFlow, Run]


def touch(first: Body, second: Body) -> bool:
    """Return whether the free surfaces of two bodies (particles with a triangulated surface) touch.

    They do if two of their vertices are within about the smaller particle spacing of each other.

    Args:
        first: One body, not changed.
        second: Another body, not changed.
    """
    reach = CONTACT_SPACINGS * min(first.cloud.spacing, second.cloud.spacing)
    surfaces = [body.points[: body.cloud.surface_count] for body in (first, second)]
    distance, _ = cKDTree(surfaces[0]).query(surfaces[1], distance_upper_bound=reach)
    return bool(np.isfinite(distance).any())


def overlap(first: Body, second: Body) -> float:
    """Return the largest depth of particles of the second body below the surface of the first [m].

    It is negative if all of them are outside.

    Args:
        first: Body with a triangulated surface, not changed.
        second: Body whose particles are tested, not changed.
    """
    return float(measure_depths(second.points, *closed_surface(first)).max())


def collapsing(body: Body) -> bool:
    """Return whether triangles of a body have collapsed to slivers, or its contact lines meet.

    Slivers have an edge that is short in relation to the particle spacing, or a poor ratio of area to edges.

    Args:
        body: Liquid body: particles, triangles of its free surface, and contact lines.
    """
    corner = body.points[body.triangles]
    square = ((corner - np.roll(corner, 1, axis=1)) ** 2).sum(axis=2)
    twice_area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    quality = 2.0 * np.sqrt(3.0) * twice_area / square.sum(axis=1)
    slivers = square.min() < (SHORTEST_EDGE * body.cloud.spacing) ** 2 or quality.min() < LOWEST_QUALITY
    return bool(slivers) or _contact_lines_meet(body)


def _contact_lines_meet(body: Body) -> bool:
    """Return whether two contact lines of one body are within the closing distance."""
    points = [body.points[ring] for ring in body.cloud.rings]
    reach = CLOSING_SPACINGS * body.cloud.spacing
    pairs = combinations(points, 2)
    return any(np.isfinite(cKDTree(a).query(b, distance_upper_bound=reach)[0]).any() for a, b in pairs)


def rebuild(*bodies: Body) -> Body:
    """Merge bodies into one with new particles, or remesh a single body; volume and momentum are conserved.

    The particle pressures start from zero, as for a body at rest.

    Args:
        bodies: One body, or bodies that touch: all free, on the same wall, or between the same two walls.

    Returns:
        Body with new particles at the smallest of the spacings, on the walls of the given bodies.

    Raises:
        CannotRebuild: A wall is not horizontal, or the bodies are not on the same walls.
    """
    walls = _common_walls(bodies)
    spacing = min(body.cloud.spacing for body in bodies)
    inside = np.concatenate([body.points for body in bodies])
    grid = Grid.around(inside, spacing, [plate.origin[2] for plate in walls] or (0.0,))
    surfaces = [closed_surface(body) for body in bodies]
    union = smooth_union([signed_distance(*surface, grid) for surface in surfaces], NECK_SPACINGS * spacing)
    if any(_contact_lines_meet(body) for body in bodies):
        union = LevelSet(grid, union.values - CLOSING_SPACINGS * spacing)
    volume = sum(body.volume()[0] for body in bodies)
    result = Body.at_rest(cloud_from_level_set(smooth_slits(union), volume, walls))
    moments = [body_moments(body) for body in bodies]
    centre = np.sum([moment[1] for moment in moments], axis=0) / sum(moment[0] for moment in moments)
    _put_centre(result, walls, centre)
    result.velocity = _common_velocity(result, bodies)
    return result


def _put_centre(body: Body, walls: Sequence[Plate], centre: Floats) -> None:
    """Shift a body so that its centre of volume is at ``centre``, shape (3,) [m], as far as it slides on its walls.

    Without this, filling the neck on one side would shift the centre without a force.
    """
    if any(plate.pads for plate in walls):
        return
    volume, first, _ = body_moments(body)
    body.points += (centre - first / volume) * (1.0 if not walls else np.array([1.0, 1.0, 0.0]))


def hand_over(old: Sequence[LiquidFlow], new: Sequence[LiquidFlow]) -> None:
    """Set time and number of steps of the flows of remeshed bodies to the largest of the old flows.

    With the scheme ispg, velocities, centre of mass and energy budget are transferred, too.

    Args:
        old: Flows of the bodies before remeshing; not changed.
        new: Flows of the bodies that replace them, changed in place before their first step.
    """
    for flow in new:
        flow.time, flow.steps = max(former.time for former in old), max(former.steps for former in old)
    before, after = _moving(old), _moving(new)
    if len(before) == len(old) and len(after) == len(new):
        _keep_centre(before, after)
        transfer_motion(after, before)


def _moving(flows: Sequence[LiquidFlow]) -> list[MovingBody]:
    """Return the bodies, physics and solvers of the flows computed by the scheme ispg."""
    return [MovingBody(flow.body, flow.physics, flow.solver) for flow in flows if isinstance(flow.solver, IspgStep)]


def _keep_centre(old: Sequence[MovingBody], new: Sequence[MovingBody]) -> None:
    """Shift all new bodies by one vector so that they have the common centre of volume of the old bodies."""
    before, after = ([body_moments(part.body) for part in parts] for parts in (old, new))
    missing = np.sum([first for _, first, _ in before], axis=0) - np.sum([first for _, first, _ in after], axis=0)
    total = sum(volume for volume, _, _ in after)
    for part, (volume, first, _) in zip(new, after, strict=True):
        restore_moments(part.body, part.physics, volume, first + volume / total * missing)


def closed_surface(body: Body) -> tuple[Floats, Indices]:
    """Return the closed surface of a body and its mirror image behind each wall.

    The image closes a body on one wall; between two walls, lids far behind the walls close it.

    Args:
        body: Liquid body: particles, triangles of its free surface, and contact lines.

    Returns:
        Points, shape (n, 3) [m], and triangles, shape (t, 3).

    Raises:
        CannotRebuild: Contact lines meet in a point.
    """
    count, triangles = body.cloud.surface_count, body.triangles
    points, faces = [body.points[:count]], [triangles]
    for plate in _walls(body):
        image = count * len(points) + np.arange(count, dtype=np.int32)
        for ring, under in zip(body.cloud.rings, body.plates, strict=True):
            if under.side == plate.side:
                image[ring] = ring
        mirrored = points[0] * np.array([1.0, 1.0, -1.0]) + 2.0 * plate.origin * np.array([0.0, 0.0, 1.0])
        points.append(mirrored)
        faces.append(image[triangles][:, ::-1])
    all_faces = np.concatenate(faces)
    return with_lids(np.concatenate(points), all_faces, boundary_loops(all_faces))


def _walls(body: Body) -> tuple[Plate, ...]:
    """Return the walls of a body, the lower one first; contact lines on one wall have separate plates."""
    if any(plate.normal[2] != 1.0 for plate in body.plates):
        raise CannotRebuild("only bodies on horizontal walls can be rebuilt")
    by_side = {plate.side: plate for plate in reversed(body.plates)}
    return tuple(by_side[side] for side in sorted(by_side))


def _common_walls(bodies: Sequence[Body]) -> tuple[Plate, ...]:
    """Return the common walls of bodies that merge."""
    first, *others = [_walls(body) for body in bodies]
    positions = [[(plate.side, plate.origin[2]) for plate in walls] for walls in (first, *others)]
    if any(position != positions[0] for position in positions[1:]):
        raise CannotRebuild("only free bodies, or bodies on the same walls, can merge")
    return first


def _common_velocity(body: Body, parts: Sequence[Body]) -> Floats:
    """Return velocities interpolated from the nearest old particles by inverse distance, shape (n, 3) [m/s].

    The total momentum of the old bodies is restored.
    """
    points = np.concatenate([part.points for part in parts])
    velocity = np.concatenate([part.velocity for part in parts])
    distance, nearest = cKDTree(points).query(body.points, VELOCITY_NEIGHBOURS)
    weight = 1.0 / np.maximum(distance, 1e-6 * body.cloud.spacing)
    new = (weight[..., None] * velocity[nearest]).sum(axis=1) / weight.sum(axis=1)[:, None]
    momentum = sum((part.volumes[:, None] * part.velocity).sum(axis=0) for part in parts)
    new += (momentum - (body.volumes[:, None] * new).sum(axis=0)) / body.volumes.sum()
    new[body.cloud.wall >= 0, 2] = 0.0
    return new


def split_to_rest(flow: LiquidFlow, rule: StopRule, start: Callable[[Body], LiquidFlow]) -> list[FlowAndRun]:
    """Cut a body between two horizontal plates at its neck and compute both drops at rest.

    Args:
        flow: Flow of the body, with one contact line on each plate.
        rule: Criteria by which the flow of a drop ends: tolerance and duration of rest, number of steps, end of the
            process.
        start: Function of a body that returns the flow of a drop.

    Returns:
        Flow and run of the drop on the lower plate and of the drop below the upper plate; an empty list if the neck is
        at a plate, or a plate is tilted.
    """
    body, lines = flow.body, flow.physics.lines
    walls = tuple(replace(plate, pads=line.pads) for plate, line in zip(body.plates, lines, strict=True))
    profile, room = fit_profile(body.points, body.triangles, body.span()), FEWEST_SPACINGS * body.cloud.spacing
    neck, below = _neck(profile)
    if any(plate.normal[2] != 1.0 or abs(neck - plate.origin[2]) < room for plate in walls):
        return []
    drops = [start(part) for part in _cut(body, walls, neck, below)]
    hand_over([flow], drops)
    rule = replace(rule, max_steps=flow.steps + rule.max_steps)
    return [(drop, run_to_rest(drop, rule)) for drop in drops]


def _neck(profile: Profile) -> tuple[float, float]:
    """Return the height of the thinnest section [m], and the share of the volume below it."""
    thinnest = int(profile.radius.argmin())
    slices = 0.5 * (profile.radius[1:] ** 2 + profile.radius[:-1] ** 2)
    return float(profile.z[thinnest]), float(slices[:thinnest].sum() / slices.sum())


def _cut(body: Body, walls: tuple[Plate, ...], neck: float, below: float) -> tuple[Body, Body]:
    """Cut a body at its neck into two with new particles, at constant total volume."""
    volume = body.volume()[0]
    grid = Grid.around(body.points, body.cloud.spacing, [plate.origin[2] for plate in walls])
    values, heights = signed_distance(*closed_surface(body), grid).values, grid.axes()[2]
    lower = LevelSet(grid, np.maximum(values, heights - neck))
    upper = LevelSet(grid, np.maximum(values, neck - heights))
    return (
        Body.at_rest(cloud_from_level_set(lower, below * volume, walls[:1])),
        Body.at_rest(cloud_from_level_set(upper, (1.0 - below) * volume, walls[1:])),
    )


def split_shape(joint: JointShape, solder: Solder, drops: Sequence[FlowAndRun]) -> JointShape:
    """Return the shape of an open joint: both drops at rest, with the history until the neck collapsed.

    Args:
        joint: Shape of the joint when its neck collapsed; its verdict and history are kept.
        solder: Contact angles and fluid.
        drops: Flow and run of each drop, as returned by ``split_to_rest``.
    """
    bodies = [flow.body for flow, _ in drops]
    counts = [body.cloud.surface_count for body in bodies]
    points = concatenate_shapes([body.points for body in bodies], counts)
    metrics = {name: number for name, number in joint.metrics.items() if name in JOINT_METRICS}
    return replace(
        joint,
        points=points,
        velocity=concatenate_shapes([body.velocity for body in bodies], counts),
        pressure=concatenate_shapes([particle_pressure(flow) for flow, _ in drops], counts),
        surface_points=points[: sum(counts)],
        triangles=np.concatenate(shifted_indices([body.triangles for body in bodies], counts)),
        rings=tuple(shifted_indices([body.cloud.rings[0] for body in bodies], counts)),
        metrics=metrics | _drop_metrics(solder, drops),
    )


def _drop_metrics(solder: Solder, drops: Sequence[FlowAndRun]) -> Metrics:
    """Return volume and height of each drop with their errors, and the metrics that decide the verdict of an array."""
    metrics: Metrics = energy_metrics([flow for flow, _ in drops]) | {
        "max_width": (max(run.profiles[-1].max_width for _, run in drops), "m"),
        "axial_force": (0.0, "N"),
        "particles": (float(sum(len(flow.body.points) for flow, _ in drops)), ""),
        "particles_lost": (float(sum(particles_lost(flow.body) for flow, _ in drops)), ""),
        "at_rest": (float(all(run.at_rest for _, run in drops)), ""),
        "time_at_rest": (float(np.max([run.time_at_rest for _, run in drops])), "s"),
    }
    for name, (flow, run) in zip(("board", "package"), drops, strict=True):
        metrics[f"volume_{name}"] = (flow.body.volume()[0], "m^3")
        errors = {"drop_height": (run.records[-1].height, "m")} | drop_errors(solder, flow, run)
        metrics |= {f"{error}_{name}": number for error, number in errors.items()}
    return metrics
