"""Packages on boards as mesh files without a reflow: joints are barrels of the solder volume between their pads."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from reflowshock.cases.hard.trials.surfaces import barrel
from reflowshock.fem.mesh.mesh_file import read_mesh
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.shock import Ranks
from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.board.displaced_assembly import prescribed_displacement, write_displaced_assembly
from reflowshock.meshing.board.package_side import PackageSide
from reflowshock.meshing.board.pads import PadSite, pad_table
from reflowshock.meshing.joint.column import columns_of
from reflowshock.meshing.joint.joints_file import write_joints
from reflowshock.meshing.joint.solder_mesh import JointMesh, mesh_coarse_joint, mesh_joint
from reflowshock.meshing.surface.closed_surface import ClosedSurface
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.pipeline.reader import read_case
from tests.support.fem_models import write_msh

CASES = Path(__file__).parents[2] / "cases"
HEIGHTS = np.linspace(0.0, 1.0, 25)  # heights of the sections of a barrel
SHIFT = 1e-6  # over an element's edge: no element is a box, without a change of results
Mesher = Callable[..., JointMesh]


@dataclass(frozen=True, slots=True)
class DropScene:
    """Meshes of a case, and inputs of runs on them.

    Attributes:
        case: Case, with its copper at its true mass.
        folder: Folder of the meshes.
    """

    case: BoardDropCase
    folder: Path

    @classmethod
    def write(cls, folder: Path, overrides: tuple[str, ...] = (), name: str = "bga_drop") -> "DropScene":
        """Mesh a case with overrides ``key=value``."""
        case = read_case(CASES / name / "case.toml", ("shock.numerics.mass_scaled=[]", *overrides))
        assert isinstance(case, BoardDropCase)
        write_assembly(case.package, case.board, folder / "flat.msh")
        displacement = prescribed_displacement(case.package, case.warpage)
        side = write_displaced_assembly(folder / "flat.msh", displacement, folder / "assembly.msh")
        (folder / "flat.msh").unlink()
        columns = {site.name: columns_of(site, case.package, case.board, side) for site in pad_sites(case)}
        fine = [
            mesh_barrel(case, site, partial(mesh_joint, columns=columns[site.name]), side) for site in pad_sites(case)
        ]
        write_joints(fine, folder / "joints.msh")
        coarse = [mesh_barrel(case, site, mesh_coarse_joint, side) for site in pad_sites(case)]
        write_joints(coarse, folder / "coarse_joints.msh")
        return cls(case, folder)

    def without_boxes(self, folder: Path) -> "DropScene":
        """Write the meshes again with slightly distorted elements, so that each element has its own matrix."""
        for path in self.folder.glob("*.msh"):
            mesh = read_mesh(path)
            length, phase = np.ptp(mesh.points[:, 0]), 1e4 * mesh.points[:, 1] + 3e4 * mesh.points[:, 2]
            shift = SHIFT * self.case.board.numerics.element_size * np.cos(phase)
            moved = mesh.points + np.outer(shift * np.sin(np.pi * mesh.points[:, 0] / length), [1.0, 0.0, 0.0])
            write_msh(replace(mesh, points=moved), folder / path.name)
        return replace(self, folder=folder)

    def request(self, mode: str, coupling: dict, shock: dict) -> RunInput:
        """Return the input of a run on one rank; ``shock`` holds values of the shock or its numerics."""
        numerics = {key: shock[key] for key in shock if key in type(self.case.shock.numerics).model_fields}
        tables = self.case.shock.model_dump() | {key: value for key, value in shock.items() if key not in numerics}
        tables["numerics"] |= numerics
        tables["coupling"] = coupling  # replaces the coupling of the case
        tables["ranks"] = Ranks(total=1, placement="shared").model_dump()
        return RunInput(
            mode=mode,
            meshes=(self.folder / "assembly.msh", self.folder / "joints.msh"),
            coarse_joints=self.folder / "coarse_joints.msh",
            shock=tables,
            materials=self.case.materials,
            output=self.folder,
        )


def pad_sites(case: BoardDropCase) -> list[PadSite]:
    """Return positions and sizes of the pads of all joints of a case, row by row."""
    return pad_table(case.package, case.board, case.warpage)


def mesh_barrel(case: BoardDropCase, site: PadSite, mesher: Mesher, side: PackageSide) -> JointMesh:
    """Return the mesh of a joint whose solder is a barrel of the case's volume.

    Args:
        case: Package and solder.
        site: Positions and sizes of the pads.
        mesher: Function that meshes a closed surface at a site, e.g. ``mesh_joint``.
        side: Underside of the package.
    """
    return mesher(make_barrel(site, case.solder.volume), site, case.package, side)


def make_barrel(site: PadSite, volume: float) -> ClosedSurface:
    """Return the closed surface of a barrel of solder that fills the gap between the wetted discs of a joint.

    Args:
        site: Gap and wetted radii of the joint.
        volume: Volume of the barrel [m^3].
    """
    lower, upper = site.wetted_radius_board, site.wetted_radius_package

    def excess(bulge: float) -> float:
        radii = lower + (upper - lower) * HEIGHTS + 4.0 * bulge * HEIGHTS * (1.0 - HEIGHTS)
        squares = radii[1:] ** 2 + radii[1:] * radii[:-1] + radii[:-1] ** 2
        return float(np.pi / 3.0 * site.gap * (HEIGHTS[1] * squares).sum()) - volume

    return barrel(site.gap, brentq(excess, -0.5 * lower, lower), lower, upper)
