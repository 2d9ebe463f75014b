"""Trial of boards with joints that are hard to divide; the program's choices must be stable and exact."""

import numpy as np

from reflowshock.cases.hard.trials.coupled import Coupled, models_of
from reflowshock.cases.hard.trials.coupling import Layout
from reflowshock.cases.hard.trials.grids import grid, joint_mesh, mesh_of, on
from reflowshock.cases.hard.trials.pairs import FRACTION
from reflowshock.cases.hard.trials.windows import through
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.roles import ELASTIC

SIZE, LAYER = 0.5e-3, 0.25e-3  # size and thickness of a board element [m]


def layout(parameters: Layout) -> dict[str, float]:
    """Return the growth of a window and the transfer errors of tie and interface.

    Raises:
        CouplingError: If the layout cannot be divided in this way.
    """
    models = models_of(LAYOUTS[parameters.layout](), ELASTIC, Coupling(scheme=parameters.scheme), FRACTION)
    coupled = Coupled(models.bodies(), models.division.plan, scheme_of(models.division.scheme))
    measures = {"growth": coupled.spectral_radius() - 1.0, "substeps": float(coupled.plan.substeps)}
    return measures | through(models)


def board(cells: int = 4, layers: int = 4, copper: float = 0.0, layer: float = LAYER) -> MeshData:
    """Return a board block held at its far side under a copper plate with shared nodes."""
    ticks, heights = np.arange(cells + 1) * SIZE, layer * np.arange(-layers, 1.0)
    top = copper if copper else 0.0
    points, hexahedra = grid(ticks, ticks, np.append(heights, copper) if copper else heights)
    above = points[hexahedra].mean(axis=1)[:, 2] > 0.0
    sets = {"mounting_holes": on(0, cells * SIZE), "board_side": on(2, top), "board_bottom": on(2, heights[0])}
    return mesh_of(points, hexahedra, np.where(above, "copper_board", "board"), sets)


def joint(x: float, y: float, z: float = 0.0, held_above: bool = False) -> MeshData:
    """Return a joint with its upper end free or tied."""
    mesh = joint_mesh("A1", x, y, layers=2)
    facets = {name: quads for name, quads in mesh.facets.items() if held_above or not name.startswith("head@")}
    return MeshData(mesh.points + [0.0, 0.0, z], mesh.cells, mesh.part, mesh.part_names, facets)


def overhang() -> MeshData:
    """Return a joint under a plate of 0.05 mm that overhangs it by more than a millimetre."""
    low = joint_mesh("A1", 0.0, 0.0, layers=2).points[:, 2].max()
    ticks = np.arange(4) * SIZE
    plate = mesh_of(*grid(ticks, ticks, [low, low + 0.05e-3]), "substrate", {"package_side": on(2, low)})
    return append([board(), joint(0.5 * SIZE, 0.5 * SIZE, held_above=True), plate])


def copper_interface() -> MeshData:
    """Return a joint on thick copper and thin board layers, both at the interface of local steps."""
    return append([board(4, 2, copper=0.5e-3, layer=0.15e-3), joint(0.7e-3, 0.7e-3, z=0.5e-3)])


def corner() -> MeshData:
    """Return a joint in a corner of the board, whose meso model touches two faces and an edge."""
    return append([board(), joint(0.25e-3, 0.25e-3)])


def two_regions() -> MeshData:
    """Return two joints in opposite corners of a board, with a meso model in two parts."""
    apart = joint(3.25e-3, 3.25e-3)
    names = tuple(name.replace("A1", "B2") for name in apart.part_names)
    facets = {name.replace("A1", "B2"): quads for name, quads in apart.facets.items()}
    second = MeshData(apart.points, apart.cells, apart.part, names, facets)
    return append([board(7, 4), joint(0.25e-3, 0.25e-3), second])


LAYOUTS = {"copper_interface": copper_interface, "overhang": overhang, "corner": corner, "two_regions": two_regions}
