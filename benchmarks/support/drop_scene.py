"""Packages on boards as mesh files, without a reflow: joints are barrels of the case's volume between its pads."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from meshing.assembly import write_assembly
from meshing.joints_file import write_joints
from meshing.pads import PadSite, pad_table
from meshing.parameters import Board, JointNumerics, Package, Warpage
from meshing.solder_mesh import mesh_joint
from meshing.surface import ClosedSurface
from tests.support.joint_surfaces import barrel
from workflow.case import read_case

CASE = Path(__file__).parents[2] / "cases" / "bga_drop" / "case.toml"
HEIGHTS = np.linspace(0.0, 1.0, 25)  # of the sections between which a barrel is a cone


@dataclass(frozen=True, slots=True)
class DropScene:
    """The package on its board of ``cases/bga_drop``, in other sizes.

    Attributes:
        package: Array, pads, layers, joints and how they are meshed.
        board: The board.
        warpage: Of the package.
        volume: Of the solder of a joint [m^3].
    """

    package: Package
    board: Board
    warpage: Warpage
    volume: float

    @classmethod
    def of_case(cls, path: Path = CASE) -> "DropScene":
        """Return the scene of a case file."""
        case = read_case(path)
        return cls(case.package, case.board, case.warpage, case.solder.volume)

    def write(self, folder: Path) -> tuple[Path, Path]:
        """Write ``assembly.msh`` and ``joints.msh``; return their paths."""
        paths = folder / "assembly.msh", folder / "joints.msh"
        write_assembly(self.package, self.board, self.warpage, paths[0])
        self.write_joints(paths[1], self.package.joint_numerics)
        return paths

    def write_joints(self, path: Path, numerics: JointNumerics) -> None:
        """Write the joints, meshed as ``numerics`` say."""
        package = self.package.model_copy(update={"joint_numerics": numerics})
        sites = pad_table(package, self.board, self.warpage)
        write_joints([mesh_joint(barrel_of(site, self.volume), site, package, self.warpage) for site in sites], path)


def barrel_of(site: PadSite, volume: float) -> ClosedSurface:
    """Return the barrel of a volume [m^3] that fills the gap between the wetted discs of a joint."""
    lower, upper = site.wetted_radius_board, site.wetted_radius_package

    def excess(bulge: float) -> float:
        radii = lower + (upper - lower) * HEIGHTS + 4.0 * bulge * HEIGHTS * (1.0 - HEIGHTS)
        squares = radii[1:] ** 2 + radii[1:] * radii[:-1] + radii[:-1] ** 2
        return float(np.pi / 3.0 * site.gap * (HEIGHTS[1] * squares).sum()) - volume

    return barrel(site.gap, brentq(excess, -0.5 * lower, lower), lower, upper)
