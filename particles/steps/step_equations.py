"""Linear equations of a step on tetrahedra or on the surface alone, in admissible velocities.

Admissible velocities are v = B q + v0 with degrees of freedom q. A particle off the walls has three, one on a wall two
along its plate (free slip), a pinned one none; a floating plate has its own and carries the particles on it. v0 is the
velocity of prescribed motion.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from reflowshock.arrays import Floats
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.plate import slide
from reflowshock.particles.core.symmetry import on_plane
from reflowshock.particles.discretisation.discretisation import Discretisation
from reflowshock.particles.discretisation.incompressibility import SaddlePoint
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.physics.plate_motion import PlateMotion


class Admissible:
    """Admissible velocities of a body at its current positions, stored by component."""

    def __init__(self, body: Body, pinned: NDArray[np.bool_], motions: Sequence[PlateMotion]) -> None:
        """Build the basis.

        Args:
            body: Liquid body.
            pinned: Whether each particle is pinned at an edge, shape (n,).
            motions: Motions of the plates.
        """
        self._body, self._pinned, self._motions = body, pinned, motions
        twists = [(motion.wall, twist) for motion in motions for twist in motion.directions]
        slip = self._slip()
        self.basis = _append(slip, [self._carried(*twist) for twist in twists])
        self.slip_basis = _append(slip, [self._relative(*twist) for twist in twists])
        self._plate_count = len(twists)

    def _slip(self) -> sparse.csr_matrix:
        """Return the columns of particle motion relative to the plates."""
        body, count = self._body, len(self._body.points)
        free = np.ones((3, count), bool)
        free[2, body.cloud.wall >= 0] = False
        for across in body.cloud.symmetry:  # with symmetry the plates are horizontal
            free[across, on_plane(body.cloud, across)] = False
        free[:, self._pinned] = False
        frames = np.broadcast_to(np.eye(3), (count, 3, 3)).copy()
        for wall, plate in enumerate(body.plates):
            frames[body.cloud.wall == wall] = plate.frame
        particle = np.arange(count)
        local, axis, index = np.broadcast_arrays(np.arange(3)[:, None], np.arange(3), particle[:, None, None])
        values, rows, columns = frames.ravel(), (axis * count + index).ravel(), (local * count + index).ravel()
        keep = values != 0.0
        shape = (3 * count, 3 * count)
        turn = sparse.csc_matrix((values[keep], (rows[keep], columns[keep])), shape=shape)
        return turn[:, free.ravel()].tocsr()

    def _carried(self, wall: int, twist: Floats) -> Floats:
        """Return the velocity that a plate gives its particles, the normal one if not pinned, shape (3 n,)."""
        field = self._rigid(wall, twist)
        return (field - self._sliding(field)).T.ravel()

    def _relative(self, wall: int, twist: Floats) -> Floats:
        """Return the velocity relative to a moving plate of sliding particles at rest, shape (3 n,)."""
        return -self._sliding(self._rigid(wall, twist)).T.ravel()

    def _rigid(self, wall: int, twist: Floats) -> Floats:
        """Return the velocity of a plate at the particles on it, zero elsewhere, shape (n, 3)."""
        body = self._body
        on_plate = body.cloud.wall == wall
        field = np.zeros_like(body.points)
        field[on_plate] = body.plates[wall].rigid_velocity(twist, body.points[on_plate])
        return field

    def _sliding(self, field: Floats) -> Floats:
        """Return the tangential part of a field on the plates, zero for pinned particles, shape (n, 3)."""
        body = self._body
        return np.where(self._pinned[:, None], 0.0, slide(body.plates, body.cloud.wall, field))

    def prescribed(self, time_step: float) -> Floats:
        """Return the velocity v0 of prescribed motion over a time step [s], shape (3 n,) [m/s]."""
        return self._sum_of_prescribed(self._carried, time_step)

    def prescribed_slip(self, time_step: float) -> Floats:
        """Return the slip velocity on plates by their prescribed motion over a time step [s], shape (3 n,) [m/s]."""
        return self._sum_of_prescribed(self._relative, time_step)

    def _sum_of_prescribed(self, field: Callable[[int, Floats], Floats], time_step: float) -> Floats:
        """Return the sum of a velocity field over all plates with prescribed motion."""
        plates = self._body.plates
        twists = ((motion.wall, motion.prescribed_twist(plates[motion.wall], time_step)) for motion in self._motions)
        return sum((field(wall, twist) for wall, twist in twists), np.zeros(3 * len(self._body.points)))

    def reduce(self, load: Floats) -> Floats:
        """Return the generalised forces of particle forces and of the loads on floating plates.

        Args:
            load: Forces on the particles by component, shape (3 n,) [N].

        Returns:
            Generalised forces, shape (d,) [N].
        """
        plates = [motion.directions[:, :3] @ motion.load for motion in self._motions]
        particles = np.zeros(self.basis.shape[1] - self._plate_count)
        return self.basis.T @ load + np.concatenate([particles, *plates])

    def twists(self, unknowns: Floats, time_step: float) -> dict[int, Floats]:
        """Return the twist of each moving plate by its index, shape (6,) [m/s, rad/s].

        Args:
            unknowns: Degrees of freedom, shape (d,).
            time_step: Time step [s].
        """
        rates = unknowns[len(unknowns) - self._plate_count :]
        result, start = {}, 0
        for motion in self._motions:
            stop = start + len(motion.directions)
            prescribed = motion.prescribed_twist(self._body.plates[motion.wall], time_step)
            result[motion.wall] = prescribed + rates[start:stop] @ motion.directions
            start = stop
        return result


def _append(matrix: sparse.csr_matrix, columns: Sequence[Floats]) -> sparse.csr_matrix:
    """Append columns to a sparse matrix."""
    return sparse.hstack([matrix, *(sparse.csr_matrix(column).T for column in columns)], format="csr")


class StepEquations:
    """Equations of a body at its current positions, for any time step.

    Degrees of freedom are stored by component: all x, all y, all z.
    """

    def __init__(self, body: Body, physics: Physics, space: Discretisation) -> None:
        """Assemble the parts that do not depend on the time step.

        Args:
            body: Liquid body.
            physics: Effects that act on the body.
            space: Operators at the current positions.
        """
        self._body, self._physics, self._space = body, physics, space
        self._admissible = Admissible(body, physics.pinned(body), physics.motions)
        self._volume = body.volume()[0]
        self._reduced_constraint = (space.constraint @ self._admissible.basis).tocsr()
        self._force = physics.force(body)

    def problem(self, time_step: float, volume: float) -> SaddlePoint:
        """Assemble the saddle-point problem for a time step [s] that ends at a volume [m^3]."""
        body, physics, space = self._body, self._physics, self._space
        operator = sum(part.matrix(body, space, time_step) for part in physics.operators)
        load = self._force + sum(momentum.load(body, space, time_step) for momentum in physics.momenta)
        prescribed, basis = self._admissible.prescribed(time_step), self._admissible.basis
        rate = (volume - self._volume) / time_step * space.volume_share - space.constraint @ prescribed
        reduced, drag = self._friction(time_step)
        return SaddlePoint(
            operator=(basis.T @ operator @ basis + reduced).tocsr(),
            constraint=self._reduced_constraint,
            load=self._admissible.reduce(load.T.ravel() - operator @ prescribed) + drag,
            rate=rate,
            stabilisation=self._stabilisation(time_step),
        )

    def _stabilisation(self, time_step: float) -> sparse.csr_matrix | None:
        """Return S = tau times the stabilisation of the space, with 1/tau = 1/dt + diffusion rate (Codina 2000)."""
        space = self._space
        if space.stabilisation is None:
            return None
        return time_step / (1.0 + time_step * space.diffusion_rate) * space.stabilisation

    def _friction(self, time_step: float) -> tuple[sparse.csr_matrix | float, Floats | float]:
        """Return the friction matrix, shape (d, d) [kg/s], and the drag of moving plates, shape (d,) [N]."""
        parts = [part.matrix(self._body, self._space, time_step) for part in self._physics.frictions]
        if not parts:
            return 0.0, 0.0
        slip = self._admissible.slip_basis
        return slip.T @ sum(parts) @ slip, -(slip.T @ (sum(parts) @ self._admissible.prescribed_slip(time_step)))

    def expand(self, unknowns: Floats, time_step: float) -> tuple[Floats, dict[int, Floats]]:
        """Return particle velocities and plate twists for given degrees of freedom.

        Args:
            unknowns: Degrees of freedom, shape (d,).
            time_step: Time step [s].

        Returns:
            Velocity, shape (n, 3) [m/s], and twist of each moving plate by its index, shape (6,) [m/s, rad/s].
        """
        full = self._admissible.basis @ unknowns + self._admissible.prescribed(time_step)
        return np.ascontiguousarray(full.reshape(3, -1).T), self._admissible.twists(unknowns, time_step)
