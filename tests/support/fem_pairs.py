"""Pairs of a coarse board and a finer block on it, for which any scheme's window can be tried."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem.body import Body
from fem.coupling.gravouil_combescure import GravouilCombescure
from fem.coupling.held_velocity import Answered, HeldVelocity, Macro
from fem.coupling.scheme import Scheme, scheme_of
from fem.estimate import WindowPlan
from fem.exchange import CutChannels
from fem.loads import Load
from fem.levels.choose import Pace, choose_levels
from fem.materials.library import FR4
from fem.materials.parameters import Isotropic
from fem.materials.roles import Materials
from fem.mesh import MeshData, append
from fem.motion import Motion
from fem.tie import tie_joints
from tests.support.fem_coupled import Coupled, Models, bodies_of, split
from tests.support.fem_models import grid, mesh_of, on

SIZE, THICKNESS = 0.5e-3, 0.25e-3  # of a board element [m]
FRACTION = 0.9  # of the critical step of elements, the program's default
BOARD_IMPEDANCE = float(np.sqrt(FR4.density * FR4.young_modulus_out_of_plane))


@dataclass(frozen=True)
class Pair:
    """A board of FR4 and a block tied to its top off the grid, in a corner.

    Attributes:
        substeps: m that the steps of both call for.
        impedance: sqrt(density E) of the block over that of the board across.
        ratio: Board elements over elements of the block, in size.
        shape: Of board and block.
        free: Whether nothing holds them.
        layers: Of the board.
        columns: Elements of the board in plane, each way.
        height: Layers of the block.
        thinnest: Thickness of the block's top layer over that of the others.
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

    def mesh(self) -> MeshData:
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
        """Return materials with the impedance of the block whose critical step is a little above 1/m of the board's."""
        trial = Materials(solder=Isotropic(density=1e3, young_modulus=1e9, poisson_ratio=0.35))
        board, block = (pieces.steps.min() for pieces, _ in self.models(trial).values())
        slowness = 1e-3 * board / block / (self.substeps - 0.02)
        product = self.impedance * BOARD_IMPEDANCE
        return Materials(
            solder=Isotropic(density=product * slowness, young_modulus=product / slowness, poisson_ratio=0.35)
        )

    def models(self, materials: Materials, buffer: int = 0) -> Models:
        """Return the models: the block is meso, and so many layers of board around it."""
        mesh = self.mesh()
        macro, (_, tie, _) = board_cells(mesh), tie_joints(mesh)
        near = np.zeros(len(mesh.points), bool)
        near[tie.master] = True
        for _ in range(buffer):
            layer = macro & near[mesh.cells].any(axis=1)
            near[mesh.cells[layer]] = True
            macro = macro & ~layer
        return split(mesh, materials, macro, ~macro)

    def coupled(self, scheme: Scheme, buffer: int = 0, fraction: float = FRACTION, loads: Sequence[Load] = ()) -> Coupled:
        """Return both models at the steps that follow from those of board and block."""
        models = self.models(self.materials(), buffer)
        board = min(pieces.steps[pieces.roles == "board"].min(initial=np.inf) for pieces, _ in models.values())
        smallest = min(pieces.steps.min() for pieces, _ in models.values())
        plan = WindowPlan(fraction * board, int(np.ceil(board / smallest)), 1, 1)
        return Coupled(bodies_of(models), plan, scheme, loads)

    def leveled(self, most: int = 1, fraction: float = FRACTION, loads: Sequence[Load] = ()) -> Coupled:
        """Return both models of local steps: macro are the elements of level 0."""
        mesh, materials = self.mesh(), self.materials()
        moved, tie, _ = tie_joints(mesh)
        whole = np.ones(len(mesh.cells), bool)
        pieces, _ = split(mesh, materials, whole, whole)["macro"]
        steps = np.empty(len(mesh.cells))
        steps[pieces.local.cell_numbers] = pieces.steps
        window = fraction * steps[board_cells(mesh)].min()
        pace = Pace(steps, np.full(len(steps), 1e5), window, fraction)  # many elements each: levels are worth while
        level, ratios = choose_levels(moved.cells, tie, pace, most)
        models = split(mesh, materials, level == 0, level > 0, (level, ratios))
        plan = WindowPlan(window, int(np.prod(ratios)), 1, 1)
        return Coupled(bodies_of(models, window), plan, scheme_of("local_steps"), loads)


Maker = Callable[[Pair, float], Coupled]
SCHEMES: dict[str, Maker] = {
    "held_velocity": lambda pair, fraction: pair.coupled(HeldVelocity(), 2, fraction),
    "gravouil_combescure": lambda pair, fraction: pair.coupled(GravouilCombescure(), 0, fraction),
    "local_steps": lambda pair, fraction: pair.leveled(1, fraction),
    "local_steps of 3 levels": lambda pair, fraction: pair.leveled(3, fraction),
}
PRINTED = "as printed"


def board_cells(mesh: MeshData) -> np.ndarray:
    return mesh.in_parts("board".__eq__)


def shaped(mesh: MeshData, shape: str) -> MeshData:
    """Return a pair of another shape: inner nodes moved at random, or the interface a paraboloid of 5 mm radius."""
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
    """The paper's scheme as printed: the block alone is meso, only its internal force goes to the board, no mass."""

    def macro(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> Macro:
        return PrintedMacro(body, loads, plan, channels)


class PrintedMacro(Macro):
    def __init__(self, body: Body, loads: list[Load], plan: WindowPlan, channels: CutChannels) -> None:
        channels.forces.receive(np.zeros((len(body.mass), 3)))
        motion = Motion(body, loads, plan.window, np.empty(0, np.int32), np.zeros(len(body.mass)))
        Answered.__init__(self, motion, plan, channels)


ALL_SCHEMES = SCHEMES | {PRINTED: lambda pair, fraction: pair.coupled(Printed(), 0, fraction)}
