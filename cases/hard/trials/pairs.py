"""Pairs of a coarse board and a finer block for stability trials of any scheme."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.cases.hard.trials.coupled import Coupled, Models, models_of, surveyed
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.coupling.held_velocity import ForceReceiver, HeldVelocity, HeldVelocityMacro
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Load
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.exchange import InterfaceChannels
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic, Orthotropic
from reflowshock.materials.roles import Materials

SIZE, THICKNESS = 0.5e-3, 0.25e-3  # size and thickness of a board element [m]
FRACTION = 0.9  # step over the critical element step, the program's default


@dataclass(frozen=True)
class Pair:
    """FR4 board and a block tied to its top off the grid, in a corner.

    Attributes:
        substeps: Ratio m of the steps of both models.
        impedance: sqrt(density E) of the block over the board (across).
        ratio: Element size of the board over the block.
        shape: Shape of board and block.
        free: Whether the pair has no supports.
        layers: Layers of the board.
        columns: In-plane elements of the board in each direction.
        height: Layers of the block.
        thinnest: Thickness of the block's top layer over the other layers.
        board: Material of the board.
    """

    substeps: int = 4
    impedance: float = 1.0
    ratio: float = 2.0
    shape: Literal["flat", "distorted", "curved"] = "flat"
    free: bool = False
    layers: int = 4
    columns: int = 3
    height: int = 2
    thinnest: float = 1.0
    board: Orthotropic = FR4

    def mesh(self) -> MeshData:
        """Return board and block without common nodes."""
        ticks = np.arange(self.columns + 1) * SIZE
        board = mesh_of(
            *grid(ticks, ticks, -THICKNESS * np.arange(self.layers, -1.0, -1.0)),
            "board",
            {"board_side": on(2, 0.0)} | ({} if self.free else {"mounting_holes": on(0, ticks[-1])}),
        )
        cells = int(np.clip(round(self.ratio), 1, 3))
        side = 0.13 * SIZE + np.arange(cells + 1) * SIZE / self.ratio
        levels = np.arange(self.height + 1) * THICKNESS / self.ratio
        levels[-1] -= (1.0 - self.thinnest) * THICKNESS / self.ratio
        sets = {"foot@A1": on(2, 0.0), "pad_board@A1": on(2, 0.0), "pad_package@A1": on(2, levels[-1])}
        block = mesh_of(*grid(side, side, levels), "solder@A1", sets)
        return shaped(append([board, block]), self.shape)

    def materials(self) -> Materials:
        """Return materials with the block's impedance and a critical step slightly above 1/m of the board's."""
        trial = Materials(board=self.board, solder=Isotropic(density=1e3, young_modulus=1e9, poisson_ratio=0.35))
        _, survey_of_mesh, _ = surveyed(self.mesh(), trial)
        board, block = (survey_of_mesh.step[survey_of_mesh.role == role].min() for role in ("board", "solder"))
        slowness = 1e-3 * board / block / (self.substeps - 0.02)
        product = self.impedance * (self.board.density * self.board.young_modulus_out_of_plane) ** 0.5
        return Materials(
            board=self.board,
            solder=Isotropic(density=product * slowness, young_modulus=product / slowness, poisson_ratio=0.35),
        )

    def divided(self, coupling: Coupling, fraction: float = FRACTION) -> Models:
        """Return both models divided by the program."""
        return models_of(self.mesh(), self.materials(), coupling, fraction)

    def coupled(self, coupling: Coupling, fraction: float = FRACTION, loads: Sequence[Load] = ()) -> Coupled:
        """Return both models at the program's own steps."""
        models = self.divided(coupling, fraction)
        return Coupled(models.bodies(), models.division.plan, scheme_of(models.division.scheme), loads)

    def printed(self, fraction: float = FRACTION) -> Coupled:
        """Return both models coupled as printed in the paper, at the steps of the two models."""
        models = self.divided(Coupling(scheme="gravouil_combescure"), fraction)
        return Coupled(models.bodies(), models.division.plan, Printed())


SCHEMES = {
    "held_velocity": Coupling(scheme="held_velocity", levels=1),
    "held_velocity, levels auto": Coupling(scheme="held_velocity"),
    "impulse": Coupling(scheme="impulse"),
    "gravouil_combescure": Coupling(scheme="gravouil_combescure"),
    "local_steps": Coupling(scheme="local_steps", levels=1),
    "local_steps, levels auto": Coupling(scheme="local_steps"),
}


def board_cells(mesh: MeshData) -> NDArray[np.bool_]:
    """Return the mask of board cells (ne,)."""
    return mesh.in_parts("board".__eq__)


def shaped(mesh: MeshData, shape: str) -> MeshData:
    """Return a distorted pair (random inner nodes) or one with a paraboloid interface of 5 mm radius."""
    points = mesh.points.copy()
    if shape == "distorted":
        low, high = points.min(axis=0), points.max(axis=0)
        inside = (points > low + 1e-9) & (points < high - 1e-9)
        inside[:, 2] &= np.abs(points[:, 2]) > 1e-9
        edge = np.where(np.isin(np.arange(len(points)), mesh.cells[board_cells(mesh)]), THICKNESS, 0.0)
        block = np.flatnonzero(edge == 0.0)
        edge[block] = 0.5 * np.ptp(points[mesh.cells[~board_cells(mesh)][0]], axis=0).min()
        points += inside * edge[:, None] * np.random.default_rng(5).uniform(-0.25, 0.25, points.shape)
    if shape == "curved":
        points[:, 2] -= (points[:, 0] ** 2 + points[:, 1] ** 2) / (2 * 5e-3)
    return MeshData(points, mesh.cells, mesh.part, mesh.part_names, mesh.facets)


class Printed(HeldVelocity):
    """Scheme as printed in the paper: the block alone is meso; only its internal force acts on the board, no mass."""

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> HeldVelocityMacro:
        """Return the participant of the macro model, which receives and ignores the interface mass."""
        return PrintedMacro(body, loads, plan, channels)


class PrintedMacro(HeldVelocityMacro):
    """Board without the block's mass at its interface."""

    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: InterfaceChannels) -> None:
        """Start at rest; a ``Meso`` must have sent the interface mass."""
        channels.forces.receive(np.zeros((len(body.mass), 3)))
        motion = ExplicitMotion(body, loads, plan.window, np.empty(0, np.int32), np.zeros(len(body.mass)))
        ForceReceiver.__init__(self, motion, plan, channels)
