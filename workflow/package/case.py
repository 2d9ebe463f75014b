"""Cases of a package on a board: reflow of its joints and, with a shock, drop of the board."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from reflowshock.fem.problem.fittings import BoardFittings
from reflowshock.fem.problem.shock import Shock
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.materials.roles import Materials
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.parameters import with_value
from reflowshock.particles.parameters.solder import Reflow, Solder
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.error_settings import CaseNumerics, Method
from reflowshock.workflow.case.stage import ERROR_METHOD, ERRORS, Pipeline, Stage, report_of
from reflowshock.workflow.case.toml_file import resolved_path
from reflowshock.workflow.package import given_surfaces, reference

if TYPE_CHECKING:
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.particles.core.geometry import JointGeometry

# Saves five sixths of the steps if solder overflows: tests/verification/test_particles_large_steps.py
LARGE_STEPS = 100.0


DRAWN = (
    "package.rows",
    "package.columns",
    "package.depopulated",
    "package.pitch",
    "package.standoff",
    "package.board_pad",
    "package.package_pad",
    "board.symmetry",
)
PADS = (*DRAWN, "warpage")
GIVEN = ("package.surfaces", "package.surface_unit")
JOINT_MESHES = (
    "package.joint_numerics",
    "package.coarse_joint_numerics",
    "package.imprint",
    "shock.coupling.fine_joints",
    "shock.coupling.direction",
    "shock.identical_joints",
)
DRAWN_MESH = (
    *DRAWN, "package.copper", "package.substrate", "package.die", "package.numerics", "package.imprint", "board",
)  # fmt: skip
HEATED = tuple(
    f"thermal.{name}"
    for name in (
        "reference", "peak", "melting", "solidification", "steps", "package", "corner_displacement", "tolerance",
        "effects.flexible", "effects.solder_force",
    )
)  # fmt: skip
STRUCTURE_ROLES = tuple(f"materials.{role}" for role in ("board", "substrate", "die", "copper"))
JUDGED_BY = ("shock.failure",)  # changes only the verdict, so histories stay valid
RANKS = "shock.ranks"  # results on different numbers of ranks differ by rounding only
COOLED = ("thermal.solidification", "thermal.final", "thermal.effects.residual_stress")


def package_pipeline(heated: bool, dropped: bool, estimated: bool = False) -> Pipeline:
    """Return the stages of a package on a board.

    Args:
        heated: Whether the reflow has temperatures, and so needs the mesh of board and package.
        dropped: Whether the case has a shock.
        estimated: Whether companions on coarser meshes estimate the errors of the shock.

    Returns:
        Stages in the order in which they run, each with its inputs and products.
    """
    geometry = Stage(
        "geometry", DRAWN_MESH, (), ("geometry/assembly.msh", "geometry/pads.json", "geometry/preview.png")
    )
    solid = ("reflow/shapes.h5", "reflow/joints.json", "reflow/pads.json")
    if heated:
        last = () if dropped else COOLED  # without a shock, the reflow reports on cooling
        parameters = (*PADS, *HEATED, *STRUCTURE_ROLES, "solder", *last)
        reflow = Stage("reflow", parameters, ("geometry",), (*solid, "reflow/structure.npz"))
    else:
        reflow = Stage("reflow", (*PADS, "thermal", "solder", *GIVEN), (), solid, pads=True)
    solder_mesh = Stage(
        "solder_mesh",
        ("warpage", "solder.volume", *JOINT_MESHES, "materials.copper", "materials.solder"),
        ("geometry", "surface"),
        ("solder_mesh/assembly.msh", "solder_mesh/joints.msh", "solder_mesh/quality.json"),
    )
    surface = Stage("surface", GIVEN, ("reflow",), ("surface/surfaces.json",))
    moved = ("shock", "materials", *BoardFittings.model_fields, *COOLED)
    shock = Stage("shock", moved, ("solder_mesh",), (), without=(*JUDGED_BY, RANKS))
    motion = (*((shock,) if dropped else ()), *((ERRORS,) if estimated else ()))
    stages = (geometry, reflow, surface, solder_mesh, *motion)
    follows = tuple(stage.name for stage in stages)
    return Pipeline((*stages, report_of(*follows, parameters=(*JUDGED_BY, ERROR_METHOD) if dropped else ())))


BOARD_DROP = package_pipeline(heated=False, dropped=True)


def joint_geometries(pads: "Sequence[PadSite]") -> "dict[str, JointGeometry]":
    """Return the geometry of each joint of a pad table, by joint name.

    Args:
        pads: Pad table, one entry per joint.

    Returns:
        Name -> gap, offset and wettable radii [m], and tilt [rad] of the joint.
    """
    from reflowshock.particles.core.geometry import JointGeometry

    return {
        pad.name: JointGeometry(pad.gap, pad.wetted_radius_board, pad.wetted_radius_package, pad.offset, pad.tilt)
        for pad in pads
    }


class PackageCase(Case):
    """A package on a board, whose joints are reflowed and meshed."""

    kind = "package"

    package: Package
    board: Board
    warpage: Warpage = Warpage()
    thermal: Thermal | None = None
    solder: Solder
    reflow: Reflow = Reflow()
    materials: Materials = Materials()

    @property
    def pipeline(self) -> Pipeline:
        """Stages of the package; with temperatures, the reflow needs the mesh of board and package."""
        return package_pipeline(heated=self.thermal is not None, dropped=False)

    @classmethod
    def completed(cls, table: dict) -> dict:
        """Return the table with large time steps as default for a case with temperatures.

        Its load steps end at rest, and only the shapes at rest are used.
        """
        solder = table.get("solder")
        if "thermal" not in table or not isinstance(solder, dict):
            return table
        numerics = solder.get("numerics", {})
        if not isinstance(numerics, dict):
            return table
        return table | {"solder": solder | {"numerics": {"time_step_limit": LARGE_STEPS} | numerics}}

    def resolved(self) -> Self:
        """Return the case with ispg, the cheapest scheme, if it names no scheme and ispg is verified for its joints."""
        from reflowshock.meshing.board.checks import problems

        if "scheme" in self.solder.numerics.model_fields_set:
            return self
        if problems(self.package, self.board, self.warpage):
            return self
        ispg = with_value(self.solder, "numerics.scheme", "ispg")
        with_ispg = self.model_copy(update={"solder": ispg})
        return self if with_ispg.unverified else with_ispg

    @property
    def unverified(self) -> str | None:
        """Property of the joints that the scheme ispg is not verified for, as text; None if it is verified for all."""
        from reflowshock.particles.parameters.joint_checks import unverified_joints

        lowest = 0.0 if self.thermal is None else self.thermal.lowest_corner
        return unverified_joints(self.joints.values(), self.solder, lowest)

    @property
    def joints(self) -> "dict[str, JointGeometry]":
        """Geometry of each joint by name, without displacements by temperature."""
        from reflowshock.meshing.board.pads import pad_table

        return joint_geometries(pad_table(self.package, self.board, self.warpage))

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Resolve surface files relative to the folder of the case file."""
        return given_surfaces.located(table, folder)

    @property
    def ranks_by_key(self) -> dict[str, int]:
        """MPI ranks by the key of the case file that sets them, including those of the reflow if it has any."""
        of_reflow = {"reflow.ranks": self.reflow.ranks} if self.reflow.ranks is not None else {}
        return super().ranks_by_key | of_reflow

    @property
    def files(self) -> dict[str, Path]:
        """Files of joint surfaces by key."""
        return given_surfaces.files(self.package)


class BoardDropCase(PackageCase, BoardFittings):
    """A package on a board: its joints reflowed, then the board dropped."""

    ranks_key = "shock.ranks.total"

    shock: Shock
    numerics: CaseNumerics = CaseNumerics()

    @property
    def cooled(self) -> bool:
        """Whether shocks begin with the residual stress of cooling."""
        return self.thermal is not None and self.thermal.effects.residual_stress == "on"

    @property
    def pipeline(self) -> Pipeline:
        """Stages of the package, then the shock and the estimate of its errors."""
        return package_pipeline(self.thermal is not None, dropped=True, estimated=self.estimates_errors)

    @property
    def error_method(self) -> Method:
        """Origin of the discretisation errors."""
        return self.numerics.error.method

    @property
    def estimates_errors(self) -> bool:
        """Whether companions estimate the errors; with temperatures each of them would repeat the reflow."""
        return self.error_method == "estimate" and self.thermal is None

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Resolve surface files, the table of the shock and the reference relative to the folder of the case file."""
        shock = table.get("shock")
        if isinstance(shock, dict):
            reference.located(shock, folder)
            if isinstance(shock.get("table"), str):
                shock["table"] = resolved_path(folder, shock["table"])
        return super().located(table, folder)

    @property
    def files(self) -> dict[str, Path]:
        """Files of joint surfaces, of the table of the shock and of the reference, by key."""
        tables = {key: path for key, (path, *_) in self.pulse_tables.items()}
        return super().files | tables | reference.files(self.shock.failure.reference)

    @property
    def pulse_tables(self) -> dict[str, tuple[Path, str, str | None]]:
        """Table of the shock by key: file, quantity, column; empty without one."""
        shock = self.shock
        return {} if shock.table is None else {"shock.table": (Path(shock.table), "acceleration", shock.table_column)}

    @property
    def ranks(self) -> int:
        """MPI ranks of the shock, the largest number if the run decides."""
        return self.shock.ranks.most

    @property
    def least_ranks(self) -> int:
        """Smallest number of MPI ranks of the shock."""
        return self.shock.ranks.least
