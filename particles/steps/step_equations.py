"""The linear equations of one step: forces, implicit operators, constraints, in the velocities that walls admit.

Admissible velocities are v = B q + v0, q the degrees of freedom. A particle off the walls has three, one on a wall two
along its plate (free slip), one that an edge holds none; a floating plate has its own and takes along what it carries.
v0 is the part that prescribed motion gives.
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
    """The admissible velocities of a body at its current positions, components one after the other."""

    def __init__(self, body: Body, pinned: NDArray[np.bool_], motions: Sequence[PlateMotion]) -> None:
        """Build the basis.

        Args:
            body: the liquid body.
            pinned: `(n,)` particles that the edges hold.
            motions: motions of the plates.
        """
        self._body, self._pinned, self._motions = body, pinned, motions
        twists = [(motion.wall, twist) for motion in motions for twist in motion.directions]
        own = self._slip()
        self.basis = _append(own, [self._carried(*twist) for twist in twists])
        self.slip_basis = _append(own, [self._left_behind(*twist) for twist in twists])
        self._plate_count = len(twists)

    def _slip(self) -> sparse.csr_matrix:
        """Columns of the particles' own motion, relative to their plates."""
        body, count = self._body, len(self._body.points)
        free = np.ones((3, count), bool)
        free[2, body.cloud.wall >= 0] = False
        for across in body.cloud.symmetry:  # then the plates are horizontal, and their frame is that of space
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
        """Velocity `(3 n,)` with which a plate takes particles along: pinned ones wholly, others along its normal."""
        field = self._rigid(wall, twist)
        return (field - self._sliding(field)).T.ravel()

    def _left_behind(self, wall: int, twist: Floats) -> Floats:
        """Velocity `(3 n,)` relative to a plate of the particles that slide on it and stay where they are."""
        return -self._sliding(self._rigid(wall, twist)).T.ravel()

    def _rigid(self, wall: int, twist: Floats) -> Floats:
        """Velocity `(n, 3)` of a plate at the particles on it."""
        body = self._body
        on_plate = body.cloud.wall == wall
        field = np.zeros_like(body.points)
        field[on_plate] = body.plates[wall].rigid_velocity(twist, body.points[on_plate])
        return field

    def _sliding(self, field: Floats) -> Floats:
        """The part of a field `(n, 3)` along the plates, where nothing is pinned."""
        body = self._body
        return np.where(self._pinned[:, None], 0.0, slide(body.plates, body.cloud.wall, field))

    def given(self, time_step: float) -> Floats:
        """The velocity v0 `(3 n,)` [m/s] of prescribed motion over a time step [s]."""
        return self._prescribed(self._carried, time_step)

    def slip_given(self, time_step: float) -> Floats:
        """Velocity relative to the plates `(3 n,)` [m/s] that prescribed motion over a time step [s] gives."""
        return self._prescribed(self._left_behind, time_step)

    def _prescribed(self, field: Callable[[int, Floats], Floats], time_step: float) -> Floats:
        """Sum of a field of all plates that move along a prescribed path."""
        plates = self._body.plates
        twists = ((motion.wall, motion.given(plates[motion.wall], time_step)) for motion in self._motions)
        return sum((field(wall, twist) for wall, twist in twists), np.zeros(3 * len(self._body.points)))

    def reduce(self, load: Floats) -> Floats:
        """Generalised forces `(d,)` of forces on the particles `(3 n,)`, with the loads on floating plates [N]."""
        plates = [motion.directions[:, :3] @ motion.load for motion in self._motions]
        own = np.zeros(self.basis.shape[1] - self._plate_count)
        return self.basis.T @ load + np.concatenate([own, *plates])

    def twists(self, unknowns: Floats, time_step: float) -> dict[int, Floats]:
        """Twist `(6,)` of each plate that moves, by its index."""
        rates = unknowns[len(unknowns) - self._plate_count :]
        result, start = {}, 0
        for motion in self._motions:
            stop = start + len(motion.directions)
            given = motion.given(self._body.plates[motion.wall], time_step)
            result[motion.wall] = given + rates[start:stop] @ motion.directions
            start = stop
        return result


def _append(matrix: sparse.csr_matrix, columns: Sequence[Floats]) -> sparse.csr_matrix:
    """A matrix with more columns."""
    return sparse.hstack([matrix, *(sparse.csr_matrix(column).T for column in columns)], format="csr")


class StepEquations:
    """Equations of a body at its current positions, for any time step.

    Degrees of freedom are stored by component: all x, all y, all z.
    """

    def __init__(self, body: Body, physics: Physics, space: Discretisation) -> None:
        """Build what does not depend on the time step.

        Args:
            body: the liquid body.
            physics: what acts on it.
            space: operators at the body's current positions.
        """
        self._body, self._physics, self._space = body, physics, space
        self._admissible = Admissible(body, physics.pinned(body), physics.motions)
        self._volume = body.volume()[0]
        self._reduced_constraint = (space.constraint @ self._admissible.basis).tocsr()
        self._force = physics.force(body)

    def problem(self, time_step: float, volume: float) -> SaddlePoint:
        """Build the saddle-point problem for a time step [s] that ends at a volume [m^3]."""
        body, physics, space = self._body, self._physics, self._space
        operator = sum(part.matrix(body, space, time_step) for part in physics.operators)
        load = self._force + sum(momentum.load(body, space, time_step) for momentum in physics.momenta)
        given, basis = self._admissible.given(time_step), self._admissible.basis
        rate = (volume - self._volume) / time_step * space.volume_share - space.constraint @ given
        reduced, drag = self._friction(time_step)
        return SaddlePoint(
            operator=(basis.T @ operator @ basis + reduced).tocsr(),
            constraint=self._reduced_constraint,
            load=self._admissible.reduce(load.T.ravel() - operator @ given) + drag,
            rate=rate,
            stabilisation=self._stabilisation(time_step),
        )

    def _stabilisation(self, time_step: float) -> sparse.csr_matrix | None:
        """S = tau times the space's, 1/tau = 1/dt + the rate of diffusion (Codina 2000)."""
        space = self._space
        if space.stabilisation is None:
            return None
        return time_step / (1.0 + time_step * space.diffusion_rate) * space.stabilisation

    def _friction(self, time_step: float) -> tuple[sparse.csr_matrix | float, Floats | float]:
        """Frictions on the degrees of freedom: matrix `(d, d)` [kg/s], and the drag of plates that move `(d,)` [N]."""
        parts = [part.matrix(self._body, self._space, time_step) for part in self._physics.frictions]
        if not parts:
            return 0.0, 0.0
        slip = self._admissible.slip_basis
        return slip.T @ sum(parts) @ slip, -(slip.T @ (sum(parts) @ self._admissible.slip_given(time_step)))

    def expand(self, unknowns: Floats, time_step: float) -> tuple[Floats, dict[int, Floats]]:
        """Velocities `(n, 3)` of the degrees of freedom `(d,)`, and the twists of the plates that move."""
        full = self._admissible.basis @ unknowns + self._admissible.given(time_step)
        return np.ascontiguousarray(full.reshape(3, -1).T), self._admissible.twists(unknowns, time_step)
