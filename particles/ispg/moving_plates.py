"""Plates that move in a step of the Galerkin scheme: along a given path, or floating on the liquid."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.rigid_motions import ROUNDING, held, wall_velocities
from reflowshock.particles.physics.plate_motion import PlateMotion
from reflowshock.particles.steps.one_leg import OneLeg


@dataclass(frozen=True, slots=True)
class PlateHistory:
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
class FloatingModes:
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
    ) -> "FloatingModes | None":
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
