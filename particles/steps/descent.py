"""Mesh smoothing that does not raise the energy of a body that relaxes.

A step along the forces lowers the energy. Smoothing and flips keep the shape, but not the energy of the triangles that
represent it: they move vertices in the tangent plane and swap diagonals of quadrangles that are not flat. They are
therefore done as far as the energy permits: that before the step, at the same volume. The energy is the one whose
gradient are the forces.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats, Indices
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.symmetry import surface_planes
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.steps.step_solver import StepSolver
from reflowshock.particles.surface.contact_line import ContactLine
from reflowshock.particles.surface.surface_quality import flip_to_delaunay, smoothing_offsets

VOLUME_PASSES = 2
SAME_VOLUME = 1e-14
# Tolerance of the energy, relative to the sum of magnitudes, for volume corrections and summation.
ROUNDING = 1e-10
# Displacement of a plate, in spacings, below which it counts as at rest.
ARRIVED = 1e-12
SHARE_PASSES = 12
# Share of the energy available for smoothing that may be left. Where smoothing undoes a step, it sets how fast a body
# creeps that would otherwise be at rest: at 0.01 by more energy per step than ``solder.numerics.tolerance``.
LEFT_OVER = 1e-4


@dataclass(frozen=True, slots=True)
class PinningState:
    """Pinning of a contact line.

    Attributes:
        state: State of each vertex, shape (k,).
        pad: Pad of each vertex, shape (k,).
        stopped: Whether each vertex was stopped at an edge, shape (k,).
        constant: Constant of the energy of the line [J].
    """

    state: NDArray[np.int8]
    pad: Indices
    stopped: NDArray[np.bool_]
    constant: float

    @classmethod
    def of(cls, line: ContactLine) -> "PinningState":
        """Copy the current pinning of a contact line."""
        return cls(line.state.copy(), line.pad, line.stopped, line.constant)

    def restore(self, line: ContactLine) -> None:
        """Give a contact line this pinning."""
        line.state, line.pad, line.stopped, line.constant = self.state.copy(), self.pad, self.stopped, self.constant


def pinning_of(lines: Sequence[ContactLine]) -> list[PinningState]:
    """Copy the current pinning of contact lines, for ``restore_pinning``.

    Args:
        lines: Contact lines; not changed.

    Returns:
        State and pad of each vertex, whether it was stopped at an edge, and the energy constant, for each line.
    """
    return [PinningState.of(line) for line in lines]


def restore_pinning(saved: Sequence[PinningState], lines: Sequence[ContactLine]) -> None:
    """Give contact lines the pinning that ``pinning_of`` returned.

    Args:
        saved: Pinning of each line.
        lines: The same contact lines in the same order; changed in place.
    """
    for pinning, line in zip(saved, lines, strict=True):
        pinning.restore(line)


@dataclass(frozen=True, slots=True)
class StepStart:
    """Start of a step, to repeat the step from; a step replaces arrays and does not change them in place.

    Attributes:
        body: Body at the start.
        pinning: Pinning of the contact lines.
    """

    body: Body
    pinning: Sequence[PinningState]

    @classmethod
    def of(cls, body: Body, lines: Sequence[ContactLine]) -> "StepStart":
        """Copy the current body and the pinning of its contact lines."""
        return cls(replace(body), pinning_of(lines))

    def restore(self, body: Body, lines: Sequence[ContactLine]) -> None:
        """Return the body and its contact lines to the start of the step."""
        for entry in fields(body):
            setattr(body, entry.name, getattr(self.body, entry.name))
        restore_pinning(self.pinning, lines)


@dataclass(frozen=True, slots=True)
class MeshSmoothing:
    """Mesh smoothing after a step.

    Attributes:
        passes: Number of smoothing passes; the last one is done in part if the number is not whole.
        flips: Whether edges are flipped, too.
        flip_worth: Angle beyond Delaunay for which a flip may balance the numbers of triangles [rad].
        highest: Energy that the body may have afterwards [J].
    """

    passes: float
    flips: bool
    flip_worth: float
    highest: float


def highest_energy(body: Body, physics: Physics, solver: StepSolver, time_step: float) -> float:
    """Return the energy that a body must not exceed after a step [J]: its present energy, if only energy drives it.

    It is infinite with inertia, with moving plates, whose work is unknown, and with contact-line friction, which has no
    energy.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates.
        physics: Effects that act on the body: forces, friction, contact lines and motions of plates.
        solver: Step solver, which says whether the body has inertia.
        time_step: Time step [s].
    """
    relaxes = solver.traits.descends and not physics.momenta and all(line.has_energy for line in physics.lines)
    if not relaxes or is_driven(body, physics, time_step):
        return np.inf
    return physics.energy(body) + ROUNDING * sum(abs(force.energy(body)) for force in physics.forces)


def is_driven(body: Body, physics: Physics, time_step: float) -> bool:
    """Return whether a plate moves noticeably along a prescribed path in a step.

    Args:
        body: Liquid body, with its present plates.
        physics: Effects that act on the body, with the motions of plates.
        time_step: Time step [s].
    """
    for motion in physics.motions:
        plate, line = body.plates[motion.wall], body.points[body.cloud.rings[motion.wall]]
        displacement = time_step * plate.rigid_velocity(motion.prescribed_twist(plate, time_step), line)
        if np.abs(displacement).max() > ARRIVED * body.cloud.spacing:
            return True
    return False


def smooth_surface(body: Body, physics: Physics, volume: float, smoothing: MeshSmoothing) -> int | None:
    """Flip edges and smooth the surface as far as the energy permits, correct the volume, and stop lines at edges.

    Args:
        body: Liquid body: particles, triangles of its free surface, and plates; changed in place.
        physics: Effects that act on the body, with contact lines, whose pinning changes.
        volume: Enclosed volume [m^3].
        smoothing: Number of passes, whether and when edges are flipped, and the highest energy allowed afterwards [J].

    Returns:
        Number of flips; None if the energy is too high even without flips and smoothing.
    """
    cloud, triangles, points = body.cloud, body.triangles, body.points
    pinning = pinning_of(physics.lines)
    if smoothing.flips:
        lines = (*cloud.rings, *(on for _, on in surface_planes(cloud)))
        body.triangles, flips = flip_to_delaunay(points, triangles, lines, smoothing.flip_worth)
        if _smooth(body, physics, volume, smoothing):
            return flips
        restore_pinning(pinning, physics.lines)
        body.points, body.triangles = points, triangles
        if not flips:
            return None
    return 0 if _smooth(body, physics, volume, smoothing) else None


def _smooth(body: Body, physics: Physics, volume: float, smoothing: MeshSmoothing) -> bool:
    """Smooth as far as the energy permits, at a volume [m^3]; return whether the energy is low enough."""
    start, offset = body.points, _offset(body, physics, smoothing.passes)
    pinning = pinning_of(physics.lines)

    def smooth(share: float) -> None:
        restore_pinning(pinning, physics.lines)
        body.points = start + share * offset
        correct_volume(body, physics, volume)
        for line in physics.lines:
            line.stop_at_edges(body)
        correct_volume(body, physics, volume)  # moved by the vertices that were stopped

    def excess(share: float) -> float:
        smooth(share)
        return physics.energy(body) - smoothing.highest

    if np.isinf(smoothing.highest):
        smooth(1.0)
        return True
    above = excess(1.0)
    if above <= 0.0:
        return True
    below = excess(0.0)
    if below > 0.0:
        return False
    excess(_largest_share(excess, below, above))
    return True


def _largest_share(excess: Callable[[float], float], below: float, above: float) -> float:
    """Return the largest share in [0, 1] at which an excess, negative at 0 and positive at 1, is not positive.

    Regula falsi with the Illinois modification, to a small share of the excess at 0.
    """
    low, high, reached, enough = 0.0, 1.0, below, LEFT_OVER * below
    was_below = None
    for _ in range(SHARE_PASSES):
        if reached >= enough:
            break
        share = low + (high - low) * below / (below - above)
        value = excess(share)
        if value <= 0.0:
            low, below, reached = share, value, value
            above *= 0.5 if was_below is True else 1.0
        else:
            high, above = share, value
            below *= 0.5 if was_below is False else 1.0
        was_below = value <= 0.0
    return low


def _offset(body: Body, physics: Physics, passes: float) -> Floats:
    """Return the displacement of some smoothing passes as walls, planes and edges admit it, shape (n, 3) [m]."""
    cloud, surface = body.cloud, body.surface()
    count, planes = cloud.surface_count, surface_planes(cloud)
    for done in range(ceil(passes)):
        offset = smoothing_offsets(surface.points, surface.triangles, count, cloud.rings, planes)
        surface.points = surface.points + min(1.0, passes - done) * physics.admit(surface, offset)
    result = np.zeros_like(body.points)
    result[:count] = surface.points - body.points[:count]
    return result


def correct_volume(body: Body, physics: Physics, volume: float) -> None:
    """Move a body along the gradient of its volume to a given volume, by Newton steps.

    Args:
        body: Liquid body; its points are changed in place.
        physics: Effects, whose walls and edges limit the motion.
        volume: Enclosed volume to reach [m^3].
    """
    for _ in range(VOLUME_PASSES):
        enclosed, gradient = body.volume()
        if abs(volume - enclosed) <= SAME_VOLUME * volume:
            return
        gradient = physics.admit(body, gradient)
        body.points = body.points + (volume - enclosed) / (gradient**2).sum() * gradient
