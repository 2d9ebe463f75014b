"""Moving plates in a step of the Galerkin scheme: on a prescribed path, or floating on the liquid.

Plates are integrated in time by the method of the particles (``steps/one_leg.py``). A floating plate has no mass; its
twist is an unknown of the step, carried by rigid-body modes of the particles and ghost particles at the plate.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.ispg.rigid_motions import ROUNDING, constrained_part, wall_velocities
from reflowshock.particles.physics.plate_motion import PlateMotion
from reflowshock.particles.steps.one_leg import OneLeg


@dataclass(frozen=True, slots=True)
class PlateHistory:
    """Motion of the plates in the last step, and the time integration of the next one.

    Attributes:
        plates: Displacement in the last step [m, rad], twist at its end [m/s, rad/s] and change of that twist, shape
            (3, 6), of each moving plate by its index.
        time_step: Size of the last step [s].
    """

    plates: Mapping[int, Floats]
    time_step: float

    def twist(self, wall: int) -> Floats:
        """Return the current twist of a plate, shape (6,) [m/s, rad/s]."""
        return self.plates[wall][1] if wall in self.plates else np.zeros(6)

    def last(self, wall: int) -> OneLeg:
        """Return the last step of a plate."""
        displacement, _, change = self.plates.get(wall, np.zeros((3, 6)))
        return OneLeg(displacement, change, self.time_step)

    def prescribed_twists(self, motions: Sequence[PlateMotion], body: Body, time_step: float) -> dict[int, Floats]:
        """Return the mean twist of each plate on a prescribed path, which it follows exactly at the end of the step.

        Args:
            motions: Motions of the plates.
            body: Liquid body with its plates.
            time_step: Time step [s].

        Returns:
            Mean twists by the index of the plate, shape (6,) [m/s, rad/s].
        """
        prescribed = [motion for motion in motions if not len(motion.directions)]
        displacements = {
            motion.wall: time_step * motion.prescribed_twist(body.plates[motion.wall], time_step)
            for motion in prescribed
        }
        return {wall: self.last(wall).mean_along(change, time_step) for wall, change in displacements.items()}

    def predicted_twists(self, motions: Sequence[PlateMotion], share: float) -> dict[int, Floats]:
        """Return the predicted mean twist of each floating plate: a share of its last twist, shape (6,) [m/s, rad/s].

        Args:
            motions: Motions of the plates.
            share: Share of the last velocity that is used for the prediction.
        """
        return {motion.wall: share * self.twist(motion.wall) for motion in motions if len(motion.directions)}

    def predicted_displacements(self, twists: Mapping[int, Floats], time_step: float) -> dict[int, Floats]:
        """Return the plate displacements to the predicted positions of a step, shape (6,) [m, rad].

        Args:
            twists: Mean twist of each moving plate, shape (6,) [m/s, rad/s].
            time_step: Time step [s].
        """
        bases = {wall: self.last(wall).base(np.zeros(6), twist, time_step) for wall, twist in twists.items()}
        return {wall: base.points + base.time_step * twists[wall] for wall, base in bases.items()}

    def next(self, twists: Mapping[int, Floats], time_step: float) -> dict[int, OneLeg]:
        """Return the next step of each moving plate.

        Args:
            twists: Mean twist of each moving plate, shape (6,) [m/s, rad/s].
            time_step: Time step [s].
        """
        return {wall: self.last(wall).followed_by(self.twist(wall), twist, time_step) for wall, twist in twists.items()}

    def after(self, steps: Mapping[int, OneLeg]) -> dict[int, Floats]:
        """Return the motion of the plates after their next steps, in the form of ``plates``."""
        ends = {wall: self.twist(wall) + step.velocity_change for wall, step in steps.items()}
        return {wall: np.stack((step.displacement, ends[wall], step.velocity_change)) for wall, step in steps.items()}


@dataclass(frozen=True, slots=True)
class FloatingModes:
    """Rigid-body modes of p floating plates with the liquid that they carry, orthonormal by the particle masses.

    Attributes:
        twists: Plate twists of the k modes, shape (k, p, 6), times 1/sqrt(kg).
        fields: Particle velocities, across those that walls admit, shape (k, n, 3).
        drifts: Velocities of the ghost particles, shape (k, g, 3).
        momenta: Particle velocities times masses, shape (k, n, 3).
        loads: Power of the loads on the plates, shape (k,).
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
        """Return the modes of all directions in which plates float, or None without such directions.

        A plate that slides on liquid which none of its edges pins stays in place, because it has no mass.

        Args:
            motions: Motions of the plates.
            body: Liquid body with its plates.
            projections: Projections onto the velocities that walls admit, shape (n, 3, 3).
            masses: Particle masses, shape (n,) [kg].
            drift: Function of the body and the plate twists that returns ghost velocities, shape (g, 3) [m/s].
        """
        modes = []
        for motion, direction in [(plate, direction) for plate in motions for direction in plate.directions]:
            whole = wall_velocities(body, {motion.wall: direction})
            carried = constrained_part(projections, whole)
            if np.abs(carried).max() > ROUNDING * np.abs(whole).max():
                twist = np.zeros((len(body.plates), 6))
                twist[motion.wall] = direction
                ghosts = drift(body, {motion.wall: direction})
                modes.append((twist, carried, ghosts, direction[:3] @ motion.load))
        if not modes:
            return None
        twists, fields, drifts, loads = (np.array(parts) for parts in zip(*modes, strict=True))
        momenta = masses[:, None] * fields
        basis = np.linalg.inv(np.linalg.cholesky(np.tensordot(fields, momenta, ((1, 2), (1, 2)))))
        return cls(*(np.tensordot(basis, part, 1) for part in (twists, fields, drifts, momenta, loads)))

    def amplitudes(self, field: Floats) -> Floats:
        """Return the amplitude of each mode in a velocity field of shape (n, 3) [m/s], shape (k,)."""
        return np.tensordot(self.momenta, field, 2)

    def along(self, field: Floats) -> Floats:
        """Return the projection of a velocity field onto the modes, shape (n, 3) [m/s]."""
        return np.tensordot(self.amplitudes(field), self.fields, 1)
