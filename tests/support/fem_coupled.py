"""Two coupled models on one rank: any scheme, by the program's own operators, from any two sets of cells."""

from collections.abc import Mapping, Sequence

import numpy as np
from mpi4py import MPI

from fem.body import Body, Pieces, Response, make_body, make_pieces
from fem.coupling.gravouil_combescure import GravouilCombescure
from fem.coupling.one_way import OneWay
from fem.coupling.scheme import Scheme
from fem.estimate import WindowPlan
from fem.exchange import CutChannels
from fem.ledger import ledger_sums
from fem.loads import Load
from fem.local_mesh import distribute
from fem.materials.parameters import Material
from fem.materials.roles import Materials
from fem.mesh import MeshData
from fem.scene import Tables
from fem.supports import HELD, held_components
from fem.tie import Tie, net_load, tie_joints

Models = dict[str, tuple[Pieces, Tables]]


def split(
    mesh: MeshData,
    materials: Materials | Mapping[str, Material],
    macro: np.ndarray,
    meso: np.ndarray,
    levels: tuple[np.ndarray, tuple[int, ...]] | None = None,
) -> Models:
    """Return the pieces and tables of the cells of two models, (ne,) bool each, joined by ties and common nodes."""
    level, ratios = levels or (np.zeros(len(mesh.cells), np.int32), ())
    mesh, tie, moved = tie_joints(mesh)
    numbers = {"macro": numbering(mesh, tie, macro), "meso": numbering(mesh, tie, meso)}
    common = (numbers["macro"] >= 0) & (numbers["meso"] >= 0)
    common[tie.slave] = False
    result = {}
    for role, cells in (("macro", macro), ("meso", meso)):
        number = numbers[role]
        mine = number[tie.slave] >= 0
        used = np.unique(mesh.cells[cells])
        facets = {name: number[quads[np.isin(quads, used).all(axis=1)]] for name, quads in mesh.facets.items()}
        part = MeshData(mesh.points[used], number[mesh.cells[cells]], mesh.part[cells], mesh.part_names, facets)
        held = held_components(part, HELD)
        tables = Tables(
            part=part.part,
            part_names=part.part_names,
            tie=Tie(number[tie.slave[mine]], number[tie.master[mine]], tie.weight[mine]),
            master_points=mesh.points[tie.master[mine]],
            moved=moved,
            held_nodes=np.flatnonzero(held.any(axis=1)),
            held=held[held.any(axis=1)],
            cut=number[common],
            nodes=int(number.max()) + 1,
            level=level[cells],
            ratios=ratios if level[cells].any() else (),
        )
        result[role] = make_pieces(distribute(MPI.COMM_SELF, part), tables, materials), tables
    return result


def numbering(mesh: MeshData, tie: Tie, cells: np.ndarray) -> np.ndarray:
    """Return the number of each node in a model of some cells, masters without a cell last, -1 elsewhere."""
    number = np.full(len(mesh.points), -1, np.int32)
    used = np.unique(mesh.cells[cells])
    number[used] = np.arange(len(used))
    masters = tie.master[number[tie.slave] >= 0]
    absent = np.unique(masters[number[masters] < 0])
    number[absent] = np.arange(len(used), len(used) + len(absent))
    return number


def bodies_of(models: Models, step: float = np.inf) -> dict[str, Body]:
    """Return the bodies of both models; ``step`` is that of levels and of laws that depend on the rate."""
    return {
        role: make_body(MPI.COMM_SELF, *model, np.ones(len(model[0].steps)), Response(step=step))
        for role, model in models.items()
    }


class Coupled:
    """Macro and meso model on one rank, taking turns; its window as a matrix."""

    def __init__(
        self, bodies: Mapping[str, Body], plan: WindowPlan, scheme: Scheme, loads: Sequence[Load] = ()
    ) -> None:
        self.plan, self._scheme = plan, scheme
        channels = CutChannels.open(MPI.COMM_SELF, bodies["macro"].cut, bodies["meso"].cut, receiver_waits=False)
        make = {"macro": scheme.macro, "meso": scheme.meso}
        made = {role: make[role](bodies[role], list(loads), plan, channels) for role in scheme.order}
        self.macro, self.meso = made["macro"], made["meso"]
        self.parts = (self.macro, self.meso)
        self._linked = isinstance(scheme, GravouilCombescure)
        self._free = [part.motion.mobility > 0.0 for part in self.parts]
        self._impedance = float(bodies["macro"].mass.mean()) / plan.window  # a unit of the link's impulse

    def run(self) -> None:
        for part in self.parts:
            part.begin_window()
        for part in self.parts:
            part.finish_window()

    def sums(self) -> np.ndarray:
        """Return the ledger's sums of both models."""
        return ledger_sums(self.macro, 1.0) + ledger_sums(self.meso, -1.0)

    def momentum(self) -> np.ndarray:
        """Return linear and angular momentum (6,)."""
        total = np.zeros(6)
        for part in self.parts:
            motion = part.motion
            velocity = np.where(motion.mobility > 0.0, motion.present_velocity(), 0.0)
            total += net_load(motion.body.local.points, motion.ledger_mass[:, None] * velocity)
        return total

    @property
    def size(self) -> int:
        cut = 3 * len(self.macro.motion.body.cut) if self._linked else 0
        return 2 * sum(int(free.sum()) for free in self._free) + cut

    def apply(self, state: np.ndarray) -> np.ndarray:
        """Return the state one window later: displacements, velocities times DT, link over a unit."""
        counts = [int(free.sum()) for free in self._free]
        values = np.split(state, np.cumsum(counts + counts))
        for part, free, place, speed in zip(self.parts, self._free, values[:2], values[2:4], strict=True):
            part.motion.displacement[:], part.motion.velocity[:] = 0.0, 0.0
            part.motion.displacement[free] = place
            part.motion.velocity[free] = speed / self.plan.window
        self._complete(values[4].reshape(-1, 3) * self._impedance / self.plan.window)
        self.run()
        moved = [part.motion.displacement[free] for part, free in zip(self.parts, self._free, strict=True)]
        moved += [
            self.plan.window * part.motion.velocity[free] for part, free in zip(self.parts, self._free, strict=True)
        ]
        if self._linked:
            link = self.meso.foreign_force()[self.meso.motion.body.cut]
            moved.append(link.ravel() * self.plan.window / self._impedance)
        return np.concatenate(moved)

    def _complete(self, link: np.ndarray) -> None:
        """Let all that follows from displacements and link follow: slaves, the held cut, forces."""
        macro, meso = self.macro.motion, self.meso.motion
        if not self._linked:
            meso.displacement[meso.body.cut] = macro.displacement[macro.body.cut]
        for part in self.parts:
            part.motion.body.tie.spread(part.motion.displacement)
            part.motion.update_force()
        if self._linked:
            self.meso.foreign_force()[meso.body.cut] = link
            meso.force += self.meso.foreign_force()
            self.macro.foreign_force()[macro.body.cut] = -link
        elif not isinstance(self._scheme, OneWay):
            self.macro.foreign_force()[macro.body.cut] = meso.force[meso.body.cut]
        macro.force += self.macro.foreign_force()

    def matrix(self) -> np.ndarray:
        """Return the amplification matrix of a window."""
        return np.column_stack([self.apply(unit) for unit in np.eye(self.size)])

    def spectral_radius(self) -> float:
        return float(np.abs(np.linalg.eigvals(self.matrix())).max())
