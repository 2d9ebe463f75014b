"""What keeps the surface's triangles well shaped may not raise the energy of a body that relaxes.

A step along the forces lowers the energy. Smoothing and flips leave the shape, but not the energy of the triangles that
stand for it: they move vertices in the tangent plane and exchange diagonals of quadrangles that are not flat. So they
are done as far as the energy of the step allows: that before it, at the same volume. All of it is compared with what
the forces are the gradient of, the energy of the triangles.
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
# Of the energies' sizes: what volume corrections and sums leave.
ROUNDING = 1e-10
# Of the spacing: a plate that a step moves by less has arrived.
ARRIVED = 1e-12
SHARE_PASSES = 12
# Of the energy that a step may give to smoothing: so much may be left. Where smoothing undoes a step, this decides how
# fast a body creeps on that would else be at rest: at 0.01 by more energy in a step than `solder.numerics.tolerance`.
LEFT_OVER = 1e-4


@dataclass(frozen=True, slots=True)
class Held:
    """What edges hold: of each contact line the states and pads of the vertices, which were stopped, its constant."""

    lines: tuple[tuple[NDArray[np.int8], Indices, NDArray[np.bool_], float], ...]

    @classmethod
    def of(cls, lines: Sequence[ContactLine]) -> "Held":
        """Remember how lines are."""
        return cls(tuple((line.state.copy(), line.pad, line.stopped, line.constant) for line in lines))

    def restore(self, lines: Sequence[ContactLine]) -> None:
        """Make lines as they were."""
        for line, (state, pad, stopped, constant) in zip(lines, self.lines, strict=True):
            line.state, line.pad, line.stopped, line.constant = state.copy(), pad, stopped, constant


@dataclass(frozen=True, slots=True)
class Start:
    """Where a step began, to begin it again: a step makes new arrays.

    Attributes:
        body: as it was.
        held: what edges held.
    """

    body: Body
    held: Held

    @classmethod
    def of(cls, body: Body, lines: Sequence[ContactLine]) -> "Start":
        """Remember where a body is."""
        return cls(replace(body), Held.of(lines))

    def restore(self, body: Body, lines: Sequence[ContactLine]) -> None:
        """Put the body back."""
        for entry in fields(body):
            setattr(body, entry.name, getattr(self.body, entry.name))
        self.held.restore(lines)


@dataclass(frozen=True, slots=True)
class MeshSmoothing:
    """How the triangles are evened out.

    Attributes:
        passes: of smoothing; of the last, the part that is left of a whole number is done.
        flips: whether edges are flipped, too.
        flip_worth: angle [rad] for which a flip may even out the numbers of triangles (`flip_to_delaunay`).
        highest: energy that the body may have afterwards [J].
    """

    passes: float
    flips: bool
    flip_worth: float
    highest: float


def highest_energy(body: Body, physics: Physics, solver: StepSolver, time_step: float) -> float:
    """Energy [J] that a step [s] must not exceed: that before it, where nothing but the energy drives the body.

    Infinite where momentum is kept, a plate is moved (its work is not known), or friction holds a contact line, which
    no energy describes.
    """
    relaxes = solver.traits.descends and not physics.momenta and all(line.has_energy for line in physics.lines)
    if not relaxes or is_driven(body, physics, time_step):
        return np.inf
    return physics.energy(body) + ROUNDING * sum(abs(force.energy(body)) for force in physics.forces)


def is_driven(body: Body, physics: Physics, time_step: float) -> bool:
    """Whether a plate is moved in a step [s]."""
    for motion in physics.motions:
        plate, line = body.plates[motion.wall], body.points[body.cloud.rings[motion.wall]]
        way = time_step * plate.rigid_velocity(motion.given(plate, time_step), line)
        if np.abs(way).max() > ARRIVED * body.cloud.spacing:
            return True
    return False


def smooth_surface(body: Body, physics: Physics, volume: float, evening: MeshSmoothing) -> int | None:
    """Flip edges and smooth the surface as far as the energy permits; correct the volume [m^3], stop lines at edges.

    Returns:
        The number of flips; None where the energy is too high even without flips and smoothing.
    """
    cloud, triangles, points, held = body.cloud, body.triangles, body.points, Held.of(physics.lines)
    if evening.flips:
        lines = (*cloud.rings, *(on for _, on in surface_planes(cloud)))
        body.triangles, flips = flip_to_delaunay(points, triangles, lines, evening.flip_worth)
        if _smooth(body, physics, volume, evening):
            return flips
        held.restore(physics.lines)
        body.points, body.triangles = points, triangles
        if not flips:
            return None
    return 0 if _smooth(body, physics, volume, evening) else None


def _smooth(body: Body, physics: Physics, volume: float, evening: MeshSmoothing) -> bool:
    """Smooth as far as the energy permits, at a volume [m^3]; return whether it permits any."""
    start, offset, held = body.points, _offset(body, physics, evening.passes), Held.of(physics.lines)

    def smooth(share: float) -> None:
        held.restore(physics.lines)
        body.points = start + share * offset
        correct_volume(body, physics, volume)
        for line in physics.lines:
            line.stop_at_edges(body)
        correct_volume(body, physics, volume)  # of the vertices that were caught

    def excess(share: float) -> float:
        smooth(share)
        return physics.energy(body) - evening.highest

    if np.isinf(evening.highest):
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
    """Return the largest share in [0, 1] at which an excess, below zero at 0 and above at 1, is not positive.

    To a small part of the excess at 0, by false position; an end that stays twice counts half (the Illinois method).
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
    """Displacement `(n, 3)` [m] of some passes of smoothing, as walls, planes and edges allow it."""
    cloud, surface = body.cloud, body.surface()
    count, planes = cloud.surface_count, surface_planes(cloud)
    for done in range(ceil(passes)):
        offset = smoothing_offsets(surface.points, surface.triangles, count, cloud.rings, planes)
        surface.points = surface.points + min(1.0, passes - done) * physics.admit(surface, offset)
    result = np.zeros_like(body.points)
    result[:count] = surface.points - body.points[:count]
    return result


def correct_volume(body: Body, physics: Physics, volume: float) -> None:
    """Move a body to a volume [m^3] along its gradient, by Newton steps."""
    for _ in range(VOLUME_PASSES):
        found, gradient = body.volume()
        if abs(volume - found) <= SAME_VOLUME * volume:
            return
        gradient = physics.admit(body, gradient)
        body.points = body.points + (volume - found) / (gradient**2).sum() * gradient
