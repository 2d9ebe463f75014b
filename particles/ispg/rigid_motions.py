"""Rigid motions of a body, and its momenta along them: what walls admit of them must not change without a force."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import Pad, Plate
from reflowshock.particles.ispg.step_kernels import projected
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import PlateMotion
from reflowshock.particles.steps.one_leg import OneLeg

# Of the largest velocity of a rigid motion: more than this across a wall is none that it admits.
ROUNDING = 1e-9
TURN = 5  # about the z axis, of the rigid motions


def admitted_motions(points: Floats, projections: Floats) -> NDArray[np.bool_]:
    """Which rigid motions of points `(n, 3)` [m] walls admit, `(6,)`, by the projections of velocities `(n, 3, 3)`."""
    motions = rigid_motions(points)
    changes = [np.abs(projected(projections, motion) - motion).max() for motion in motions]
    return np.array(changes) <= ROUNDING * np.abs(motions).max(axis=(1, 2))


def edges_turn(body: Body, physics: Physics) -> bool:
    """Whether edges hold vertices that are circles about the z axis, about which they have no moment.

    A vertex that an edge holds does not slide along it, either. What momentum that gives the body about the axis is
    none that it has when the edges let it go.
    """
    unheld = admitted_motions(body.points, replace(physics, lines=()).projections(body))[TURN]
    return bool(unheld and all(_about_axis(line.pads, body.plates[line.wall]) for line in physics.lines))


def _about_axis(pads: Sequence[Pad], plate: Plate) -> bool:
    """Whether a plate has one pad with an edge, a circle about the z axis."""
    centres = plate.place(np.array([[*pad.centre, 0.0] for pad in pads]))[:, :2]
    reach = max(pad.radius for pad in pads)
    return len(pads) == 1 and bool(np.isfinite(reach)) and np.abs(centres).max() <= ROUNDING * reach


def rigid_motions(points: Floats) -> Floats:
    """Translations along and rotations about the axes through the origin at points `(n, 3)` [m], `(6, n, 3)`."""
    motions = np.zeros((6, *points.shape))
    for axis in range(3):
        motions[axis, :, axis] = 1.0
        motions[3 + axis, :, axis - 2], motions[3 + axis, :, axis - 1] = -points[:, axis - 1], points[:, axis - 2]
    return motions


def wall_velocities(body: Body, twists: Mapping[int, Floats]) -> Floats:
    """Velocities of plates at the particles on them `(n, 3)` [m/s], zero elsewhere; twists `(6,)` by the plate."""
    field = np.zeros_like(body.points)
    for wall, twist in twists.items():
        on_plate = body.cloud.wall == wall
        field[on_plate] = body.plates[wall].rigid_velocity(twist, body.points[on_plate])
    return field


def held(projections: Floats, field: Floats) -> Floats:
    """The part of a field `(n, 3)` that walls do not admit, by their projections `(n, 3, 3)`."""
    return field - projected(projections, field)


@dataclass(frozen=True, slots=True)
class PlateSteps:
    """The last step of plates, and the next one by the method of the particles.

    Attributes:
        plates: `(3, 6)` displacement in it, twist at its end and change of that, of each that moved, by its index.
        time_step: its size [s].
    """

    plates: Mapping[int, Floats]
    time_step: float

    def twist(self, wall: int) -> Floats:
        """Twist `(6,)` of a plate now [m/s, rad/s]."""
        return self.plates[wall][1] if wall in self.plates else np.zeros(6)

    def last(self, wall: int) -> OneLeg:
        """The last step of a plate."""
        way, _, change = self.plates.get(wall, np.zeros((3, 6)))
        return OneLeg(way, change, self.time_step)

    def given(self, motions: Sequence[PlateMotion], body: Body, time_step: float) -> dict[int, Floats]:
        """Mean twists `(6,)` of plates that are moved: after the whole step [s] these are where they should be."""
        moved = [motion for motion in motions if not len(motion.directions)]
        ways = {motion.wall: time_step * motion.given(body.plates[motion.wall], time_step) for motion in moved}
        return {wall: self.last(wall).mean_along(way, time_step) for wall, way in ways.items()}

    def guessed(self, motions: Sequence[PlateMotion], pace: float) -> dict[int, Floats]:
        """Twists `(6,)` of plates that float, in the prediction: the last ones, at a share of their pace."""
        return {motion.wall: pace * self.twist(motion.wall) for motion in motions if len(motion.directions)}

    def middle_ways(self, twists: Mapping[int, Floats], time_step: float) -> dict[int, Floats]:
        """Displacements `(6,)` [m, rad] of plates with mean twists to where the equations of a step [s] hold."""
        bases = {wall: self.last(wall).base(np.zeros(6), twist, time_step) for wall, twist in twists.items()}
        return {wall: base.points + base.time_step * twists[wall] for wall, base in bases.items()}

    def next(self, twists: Mapping[int, Floats], time_step: float) -> dict[int, OneLeg]:
        """The next step [s] of plates with mean twists `(6,)`."""
        return {wall: self.last(wall).followed_by(self.twist(wall), twist, time_step) for wall, twist in twists.items()}

    def kept(self, steps: Mapping[int, OneLeg]) -> dict[int, Floats]:
        """What is remembered of the next steps, `(3, 6)` each."""
        ends = {wall: self.twist(wall) + step.velocity_change for wall, step in steps.items()}
        return {wall: np.stack((step.displacement, ends[wall], step.velocity_change)) for wall, step in steps.items()}


@dataclass(frozen=True, slots=True)
class Riders:
    """How plates that float take liquid along: k motions across what walls admit, orthonormal by the masses.

    Attributes:
        twists: `(k, p, 6)` of the p plates, over the root of a mass.
        fields: `(k, n, 3)` velocities of the particles.
        drifts: `(k, g, 3)` velocities of their images at the walls, as those of `Ghosts.drift`.
        momenta: `(k, n, 3)` fields times the masses.
        loads: `(k,)` power of the loads on the plates.
    """

    twists: Floats
    fields: Floats
    drifts: Floats
    momenta: Floats
    loads: Floats

    @classmethod
    def of(
        cls,
        motions: Sequence[PlateMotion],
        body: Body,
        projections: Floats,
        masses: Floats,
        drift: Callable[[Body, Mapping[int, Floats]], Floats],
    ) -> "Riders | None":
        """Make them of the directions in which plates are free; None where there are none.

        A plate that slides on liquid which no edge of it holds is left where it is: it has no mass.

        Args:
            motions: of plates.
            body: the liquid body.
            projections: `(n, 3, 3)` of velocities onto those that walls admit.
            masses: of the particles, `(n,)` [kg].
            drift: velocities of images `(g, 3)` by the body and twists of its plates.
        """
        found = []
        for motion, way in [(free, way) for free in motions for way in free.directions]:
            whole = wall_velocities(body, {motion.wall: way})
            taken = held(projections, whole)
            if np.abs(taken).max() > ROUNDING * np.abs(whole).max():
                twist = np.zeros((len(body.plates), 6))
                twist[motion.wall] = way
                found.append((twist, taken, drift(body, {motion.wall: way}), way[:3] @ motion.load))
        if not found:
            return None
        twists, fields, drifts, loads = (np.array(parts) for parts in zip(*found, strict=True))
        momenta = masses[:, None] * fields
        basis = np.linalg.inv(np.linalg.cholesky(np.tensordot(fields, momenta, ((1, 2), (1, 2)))))
        return cls(*(np.tensordot(basis, part, 1) for part in (twists, fields, drifts, momenta, loads)))

    def rates(self, field: Floats) -> Floats:
        """How fast a velocity `(n, 3)` has each motion, `(k,)`."""
        return np.tensordot(self.momenta, field, 2)

    def along(self, field: Floats) -> Floats:
        """The part of a velocity `(n, 3)` that is made of these motions."""
        return np.tensordot(self.rates(field), self.fields, 1)


def rigid_momenta(motions: Floats, masses: Floats, velocity: Floats) -> Floats:
    """Momenta `(k,)` of a velocity `(n, 3)` [m/s] along rigid motions `(k, n, 3)`; masses `(n,)` [kg]."""
    return motions.reshape(len(motions), velocity.size) @ (masses[:, None] * velocity).ravel()


def orthonormal(motions: Floats, masses: Floats) -> Floats:
    """A basis of rigid motions `(k, n, 3)`, orthonormal by the masses `(n,)` [kg]."""
    flat = motions.reshape(len(motions), 3 * len(masses))
    basis = np.linalg.inv(np.linalg.cholesky(flat @ (np.repeat(masses, 3) * flat).T)) @ flat
    return basis.reshape(motions.shape)


def rigid_part(basis: Floats, masses: Floats, velocity: Floats) -> Floats:
    """The part of a velocity `(n, 3)` [m/s] that is a sum of rigid motions, a basis as `orthonormal` gives it."""
    return np.tensordot(rigid_momenta(basis, masses, velocity), basis, axes=1)


def with_momenta(motions: Floats, masses: Floats, basis: Floats, velocity: Floats, momenta: Floats) -> Floats:
    """A velocity `(n, 3)` [m/s] with momenta `(k,)` along k rigid motions, corrected by a basis of as many others."""
    moved = np.array([rigid_momenta(motions, masses, motion) for motion in basis]).T  # by columns
    missing = momenta - rigid_momenta(motions, masses, velocity)
    return velocity + np.tensordot(np.linalg.solve(moved, missing), basis, axes=1)
