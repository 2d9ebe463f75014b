"""Window of held velocity on a mesh divided by the program or otherwise."""

from collections.abc import Sequence

from reflowshock.cases.hard.trials.coupled import HELD, Coupled, Divide, models_of
from reflowshock.fem.coupling.held_velocity import HeldVelocity
from reflowshock.fem.division.divide import divide
from reflowshock.fem.loads.load import Load
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.materials.roles import Materials


class Window(Coupled):
    """Macro and meso model on one rank, advanced in turns."""

    def __init__(
        self,
        mesh: MeshData,
        materials: Materials,
        fraction: float,
        division: Divide = divide,
        loads: Sequence[Load] = (),
    ) -> None:
        """Build both models from the program's division of the mesh or another one."""
        models = models_of(mesh, materials, HELD, fraction, division)
        super().__init__(models.bodies(), models.division.plan, HeldVelocity(), loads)
