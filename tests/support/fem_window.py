"""One window of the two-scale scheme as a linear operator: both participants of the program on one rank."""

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI

from fem.body import make_body, make_pieces
from fem.coupling.held_velocity import Macro, Meso
from fem.exchange import CutChannels
from fem.loads import Load
from fem.local_mesh import distribute
from fem.materials.roles import Materials
from fem.mesh import MeshData
from fem.scene import model_inputs
from tests.support.fem_division import Divide, divide, surveyed


class Window:
    """Macro and meso model on one rank, taking turns."""

    def __init__(
        self,
        mesh: MeshData,
        materials: Materials,
        fraction: float,
        division: Divide = divide,
        loads: Sequence[Load] = (),
    ) -> None:
        """Build both, from the program's division of the mesh or another one."""
        whole, found, rules = surveyed(mesh, materials, fraction)
        divided = division(whole, found, rules)
        self.plan = divided.plan
        bodies = {}
        for role, item in model_inputs(whole, divided).items():
            pieces = make_pieces(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials)
            bodies[role] = make_body(MPI.COMM_SELF, pieces, item.tables, np.ones(len(pieces.steps)))
        channels = CutChannels.open(MPI.COMM_SELF, bodies["macro"].cut, bodies["meso"].cut, receiver_waits=False)
        self.meso = Meso(bodies["meso"], list(loads), self.plan, channels)
        self.macro = Macro(bodies["macro"], list(loads), self.plan, channels)
        self._channels = channels
        self._macro_free = bodies["macro"].free
        self._meso_free = bodies["meso"].free.copy()
        self._meso_free[bodies["meso"].cut] = False

    @property
    def size(self) -> int:
        return 2 * int(self._macro_free.sum() + self._meso_free.sum())

    def run(self) -> None:
        self.macro.begin_window()
        self.meso.begin_window()
        self.macro.finish_window()

    def apply(self, state: np.ndarray) -> np.ndarray:
        """Return the state (displacements, then velocities times DT) one window later."""
        displacement, velocity = np.split(state, 2)
        count = int(self._macro_free.sum())
        for part, values in ((self.macro, slice(0, count)), (self.meso, slice(count, None))):
            free = self._macro_free if part is self.macro else self._meso_free
            part.motion.displacement[:], part.motion.velocity[:] = 0.0, 0.0
            part.motion.displacement[free] = displacement[values]
            part.motion.velocity[free] = velocity[values] / self.plan.window
        macro, meso = self.macro.motion, self.meso.motion
        meso.displacement[meso.body.cut] = macro.displacement[macro.body.cut]
        meso.body.tie.spread(meso.displacement)
        macro.update_force()
        meso.update_force()
        self._channels.forces.send(meso.force)
        self._channels.forces.receive(self.macro.foreign_force())
        macro.force += self.macro.foreign_force()
        self.run()
        return np.concatenate(
            [macro.displacement[self._macro_free], meso.displacement[self._meso_free]]
            + [self.plan.window * macro.velocity[self._macro_free], self.plan.window * meso.velocity[self._meso_free]]
        )

    def spectral_radius(self) -> float:
        """Return the largest magnitude of an eigenvalue of the window's amplification matrix."""
        columns = np.empty((self.size, self.size))
        for k, unit in enumerate(np.eye(self.size)):
            columns[:, k] = self.apply(unit)
        return float(np.abs(np.linalg.eigvals(columns)).max())
