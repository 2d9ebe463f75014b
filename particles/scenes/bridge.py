"""Solder bridges: two joints of an array that touch merge into one body on four pads.

Each joint of an array is computed alone. Two joints touch if their mean width reaches the distance of their axes; both
are then ``bridged``, and the pair with the largest overlap is computed on as one body for the report. A joint that
never spans its gap ends as a drop on the board, one whose neck collapses as a drop on each pad: both are ``open``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from reflowshock.particles.core.body import Body
from reflowshock.particles.core.cloud import Cloud
from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.core.plate import Pad, Plate
from reflowshock.particles.parameters.effects import decide_effects, switched
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.drops import run_drops
from reflowshock.particles.scenes.flow_setup import pad_lines, start_flow, stop_rule
from reflowshock.particles.scenes.metrics import bridge_metrics
from reflowshock.particles.scenes.rebuild import rebuild
from reflowshock.particles.scenes.reflow import collect_shape
from reflowshock.particles.steps.flow import LiquidFlow
from reflowshock.particles.steps.rest import run_to_rest
from reflowshock.particles.steps.shape import JointShape, Snapshot

SPACINGS_IN_GAP = 4


def solve_bridge(
    geometries: Sequence[JointGeometry], shapes: Sequence[JointShape], distance: float, solder: Solder
) -> JointShape:
    """Merge two joints that touch and compute the common body at rest.

    The particle spacing is at least a quarter of the gap. Both joints get the mean of their gaps.

    Args:
        geometries: Geometries of both joints, coaxial.
        shapes: Shapes (particles, surface, history and metrics) of both joints at rest alone.
        distance: Distance of their axes along x [m].
        solder: Solder of one joint: volume, fluid, contact angles and numerics.

    Returns:
        Common body at rest, with the verdict "bridged"; its origin is midway between the axes.

    Raises:
        NotAtRest: The body is not at rest after ``solder.numerics.max_steps``.
        CannotRebuild: The surfaces cannot be merged.
    """
    both = solder.model_copy(update={"volume": 2.0 * solder.volume})
    effects = switched(decide_effects(geometries[0], solder))

    def start(body: Body) -> LiquidFlow:
        return start_flow(body.cloud, both, effects, pad_lines(body.cloud, both))

    body = rebuild(*placed_joints(geometries, shapes, distance, solder))
    rule = stop_rule(body.cloud, both, effects)
    (drop,) = run_drops([start(body)], rule, start)
    first = Snapshot(0.0, body.points, body.triangles)
    run = run_to_rest(drop.flow, replace(rule, max_steps=drop.flow.steps + rule.max_steps))
    run.snapshots.insert(0, first)
    metrics = bridge_metrics(body.plates[-1].origin[2], both, drop.flow, run)
    return replace(collect_shape(both, drop.flow, run, metrics), verdict="bridged")


def placed_joints(
    geometries: Sequence[JointGeometry], shapes: Sequence[JointShape], distance: float, solder: Solder
) -> list[Body]:
    """Return two joints at rest as bodies between two plates with the pads of both.

    The bodies lie half the distance on either side of x = 0 and are not merged.

    Args:
        geometries: Geometries of both joints, coaxial; the plates have the mean of their gaps.
        shapes: Shapes of both joints at rest alone.
        distance: Distance of their axes along x [m].
        solder: Solder of one joint; its particle spacing is raised to a quarter of the gap.

    Returns:
        Two bodies (particles, free surface and plates), in the order of the joints.
    """
    gap = float(np.mean([geometry.gap for geometry in geometries]))
    spacing = max(solder.numerics.spacing, gap / SPACINGS_IN_GAP)
    walls, centres = _walls(geometries, distance, gap, solder.pad_contact_angle), (-0.5 * distance, 0.5 * distance)
    return [_placed(shape, x, walls, spacing) for shape, x in zip(shapes, centres, strict=True)]


def _walls(geometries: Sequence[JointGeometry], distance: float, gap: float, pad_angle: float) -> tuple[Plate, Plate]:
    """Return board and package, each with the pads of both joints."""
    centres = ((-0.5 * distance, 0.0), (0.5 * distance, 0.0))
    radii = zip(*((geometry.radius_board, geometry.radius_package) for geometry in geometries), strict=True)
    board, package = [
        tuple(Pad(centre, radius, pad_angle) for centre, radius in zip(centres, pair, strict=True)) for pair in radii
    ]
    lower, upper = Plate.horizontal(0.0), Plate.horizontal(gap, side=1.0)
    return replace(lower, pads=board), replace(upper, pads=package)


def _placed(shape: JointShape, x: float, walls: tuple[Plate, Plate], spacing: float) -> Body:
    """Return a joint at rest at its position between the walls, stretched to their distance."""
    points, gap = shape.points.copy(), walls[1].origin[2]
    points[:, 2] *= gap / shape.metrics["standoff"][0]
    for ring, plate in zip(shape.rings, walls, strict=True):
        points[ring, 2] = plate.origin[2]
    wall = np.select([points[:, 2] == plate.origin[2] for plate in walls], (0, 1), -1).astype(np.int8)
    points[:, 0] += x
    return Body.at_rest(Cloud(points, len(shape.surface_points), shape.triangles, shape.rings, walls, wall, spacing))


@dataclass(frozen=True, slots=True)
class Contact:
    """Two joints that touch.

    Attributes:
        first: Name of the first joint in the order of the array.
        second: Name of the second joint; equal to the first if a joint touches its own mirror image.
        distance: Distance of their axes [m].
        overlap: Mean of their widths minus the distance [m].
    """

    first: str
    second: str
    distance: float
    overlap: float


def contacts(places: Mapping[str, tuple[float, float]], widths: Mapping[str, float], mirrored: bool) -> list[Contact]:
    """Find the joints that touch each other; the largest overlap comes first.

    Args:
        places: Name of a joint -> x and y of its axis [m].
        widths: Name of a joint -> largest width of the joint at rest alone [m].
        mirrored: Whether x = 0 and y = 0 are planes of symmetry, whose mirror images of the joints count, too.

    Returns:
        Names of both joints, distance of their axes [m] and overlap [m] of each pair.
    """
    names = list(places)
    points = np.array([places[name] for name in names])
    images = [points * sign for sign in ((1, 1), (-1, 1), (1, -1), (-1, -1))] if mirrored else [points]
    width = np.array([widths[name] for name in names])
    largest: dict[tuple[int, int], Contact] = {}
    for image in images:
        for i, near in enumerate(cKDTree(image).query_ball_point(points, width.max())):
            for j in near:
                distance = float(np.linalg.norm(points[i] - image[j]))
                overlap = float(0.5 * (width[i] + width[j])) - distance
                other = largest.get((i, j))
                if i <= j and distance > 0.0 and overlap >= 0.0 and (other is None or other.overlap < overlap):
                    largest[i, j] = Contact(names[i], names[j], distance, overlap)
    return sorted(largest.values(), key=lambda contact: -contact.overlap)


def neighbours(pairs: Sequence[Contact]) -> dict[str, list[str]]:
    """Return the name of each joint that touches another -> sorted names of the joints that it touches.

    Args:
        pairs: Touching pairs of ``contacts``; a joint that touches its own mirror image is its own neighbour.
    """
    result: dict[str, set[str]] = {}
    for contact in pairs:
        result.setdefault(contact.first, set()).add(contact.second)
        result.setdefault(contact.second, set()).add(contact.first)
    return {name: sorted(others) for name, others in sorted(result.items())}
