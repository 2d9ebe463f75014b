"""Choice of the structure around liquid solder: elastic board and package, or rigid plates, with the reason."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.effect import Decision, decide_all
from reflowshock.fem.problem.thermal import Thermal

if TYPE_CHECKING:
    from reflowshock.fem.statics.state import HeatedStructure
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.workflow.package.case import PackageCase


def thermal_effects(case: "PackageCase", thermal: Thermal, temperatures: Sequence[float]) -> dict[str, Decision]:
    """Decide which effects act between solder and structure, at temperatures [K] with liquid solder.

    Args:
        case: Case of a package.
        thermal: Temperatures of the case.
        temperatures: Temperatures of the load steps with liquid solder [K].

    Returns:
        Name of an effect -> its decision: ``on``, ``why`` and, if predicted, ``influence``.
    """
    from reflowshock.fem.estimates.thermal_effects import HEATED_EFFECTS, Heated, PackageSizes
    from reflowshock.meshing.board.pads import corner_axis

    package, board = case.package, case.board
    sizes = PackageSizes(
        board=board.thickness,
        substrate=package.substrate.thickness,
        die=package.die.thickness,
        die_reach=0.5 * hypot(package.die.length, package.die.width),
        reach=hypot(*corner_axis(package)),
        pitch=package.pitch,
        pad_radius=package.package_pad.wetted_radius,
        standoff=package.standoff,
    )
    heated = Heated(thermal, case.materials.by_role, sizes, case.solder.surface_tension, temperatures)
    return decide_all(HEATED_EFFECTS, heated)


def open_structure(
    case: "PackageCase", thermal: Thermal, mesh: Path, pads: "list[PadSite]", flexible: bool
) -> "AbstractContextManager[HeatedStructure]":
    """Return board and package as a structure: finite elements in a separate process, or rigid plates.

    Args:
        case: Case of a package.
        thermal: Temperatures of the case.
        mesh: File with the flat mesh of board and package.
        pads: Pad table.
        flexible: Whether board and package bend.

    Returns:
        Context that yields the structure and ends its process.
    """
    from reflowshock.fem.statics.pads import Pads
    from reflowshock.fem.statics.plates import RigidPlates
    from reflowshock.fem.statics.process import StructureProcess
    from reflowshock.fem.statics.state import Assembly

    lower = np.array([(pad.x, pad.y, pad.z_board) for pad in pads])
    upper = lower + np.array([(*pad.offset, pad.gap) for pad in pads])
    radii = np.array([(pad.wetted_radius_board, pad.wetted_radius_package) for pad in pads])
    between = Pads([pad.name for pad in pads], np.stack((lower, upper), axis=1), radii)
    assembly = Assembly(mesh, between, case.materials, thermal, case.solder.gravity)
    return StructureProcess(assembly) if flexible else nullcontext(RigidPlates(assembly))


def frozen_displacement(case: "PackageCase", structure: "HeatedStructure", displacement: np.ndarray) -> np.ndarray:
    """Return a displacement plus the lift of a prescribed warpage, which rigid plates have from the start.

    Args:
        case: Case of a package.
        structure: Board and package.
        displacement: Displacement of the nodes, shape (n, 3) [m].

    Returns:
        Displacement of the nodes, shape (n, 3) [m].
    """
    from reflowshock.meshing.board.pads import lift

    raised = displacement.copy()
    x, y = structure.points[:, :2].T
    raised[:, 2] += structure.package * lift(case.package, case.warpage, x, y)
    return raised
