"""The cases of a package on a board: its joints reflowed; then the board dropped, where a shock is given."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.problem.shock import Shock
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.meshing.board.parameters import Board, Package, Warpage
from reflowshock.particles.parameters.solder import Reflow, Solder
from reflowshock.workflow.board_drop import given_surfaces
from reflowshock.workflow.case import fields
from reflowshock.workflow.case.kind import Case, of_particles
from reflowshock.workflow.case.problems import Problem
from reflowshock.workflow.case.pulse_files import unreadable_pulses
from reflowshock.workflow.case.stage_table import Pipeline, package_pipeline
from reflowshock.workflow.case.toml_file import beside

# Where solder overflows a sixth of the steps: tests/verification/test_particles_large_steps.py
LARGE_STEPS = 100.0


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
        """The stages: with temperatures, the reflow needs the mesh of board and package."""
        return package_pipeline(heated=self.thermal is not None, dropped=False)

    @classmethod
    def completed(cls, table: dict) -> dict:
        """With temperatures take large time steps: load steps are at rest, only the shape there counts."""
        solder = table.get("solder")
        if "thermal" not in table or not isinstance(solder, dict):
            return table
        numerics = solder.get("numerics", {})
        if isinstance(numerics, dict):
            numerics = {"time_step_limit": LARGE_STEPS} | numerics
        return table | {"solder": solder | {"numerics": numerics}}

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Take files of surfaces as relative to the folder of the case file."""
        return given_surfaces.located(table, folder)

    @property
    def ranks_by_key(self) -> dict[str, int]:
        """MPI ranks of the reflow, too, if it has any."""
        of_reflow = {"reflow.ranks": self.reflow.ranks} if self.reflow.ranks is not None else {}
        return super().ranks_by_key | of_reflow

    @property
    def files(self) -> dict[str, Path]:
        """Surfaces of joints."""
        return given_surfaces.files(self.package)

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible package, joint or board together."""
        from reflowshock.fem.problem import thermal_checks
        from reflowshock.meshing.board import checks as meshing_checks
        from reflowshock.meshing.board.pads import pad_table
        from reflowshock.particles.parameters import checks as particles_checks
        from reflowshock.workflow.board_drop.reflow_pool import joint_geometries
        from reflowshock.workflow.reflow import forecast as reflow_forecast

        contradictions = meshing_checks.problems(self.package, self.board, self.warpage)
        if contradictions:
            return self.in_words(contradictions)
        heated = (
            thermal_checks.problems(self.thermal, self.materials.by_role, self.warpage.corner) if self.thermal else []
        )
        pads = pad_table(self.package, self.board, self.warpage)
        geometries = joint_geometries(pads)
        of_solder = of_particles(particles_checks.problems(self.solder, geometries, self.package.pitch))
        if self.thermal:
            of_solder += reflow_forecast.problems(self.solder, geometries, self.thermal, self.package.pitch)
        given = given_surfaces.problems(self.package, pads, self.thermal is not None)
        return self.in_words(heated) + of_solder + list(given)

    def in_words(self, found: Iterable[Any]) -> list[Problem]:
        """Say what checks of meshing or fem found in the words of a case file, values in the user's units."""
        known = {key: field for key, _, field in fields.leaves(self)}
        return [
            Problem(problem.key, problem.message, fields.shown(problem.value, known.get(problem.key)), problem.allowed)
            for problem in found
        ]


class BoardDropCase(PackageCase):
    """A package on a board: its joints reflowed, then the board dropped."""

    ranks_key = "shock.ranks.total"

    shock: Shock

    @property
    def pipeline(self) -> Pipeline:
        """The stages: those of the package, then the shock."""
        return package_pipeline(heated=self.thermal is not None, dropped=True)

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Take surfaces and the shock's table as relative to the folder of the case file."""
        shock = table.get("shock")
        if isinstance(shock, dict) and isinstance(shock.get("table"), str):
            shock["table"] = beside(folder, shock["table"])
        return super().located(table, folder)

    @property
    def files(self) -> dict[str, Path]:
        """Surfaces of joints, and the shock's table."""
        return super().files | {key: path for key, (path, _) in self.pulse_tables.items()}

    @property
    def pulse_tables(self) -> dict[str, tuple[Path, str]]:
        """The shock's table, if it has one."""
        return {} if self.shock.table is None else {"shock.table": (Path(self.shock.table), "acceleration")}

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible package, joint, board or shock together."""
        from reflowshock.fem.problem import shock_checks
        from reflowshock.meshing.board import checks as meshing_checks
        from reflowshock.workflow.board_drop import fine_joints, identical_joints, shock_cooling

        found = super().problems()
        if meshing_checks.problems(self.package, self.board, self.warpage):
            return found
        found += self.in_words(shock_checks.problems(self.shock)) + list(fine_joints.problems(self))
        found += unreadable_pulses(self.pulse_tables)
        if self.shock.numerics.kinematics == "auto" and not found:
            found += self._decided_problems()
        if found:
            return found
        found += identical_joints.problems(self)
        found += shock_cooling.problems(self)
        return (found + self._flow_problems() + self._coupling_problems()) or self._impossible_steps()

    @property
    def decided(self) -> "BoardDropCase":
        """The case with kinematics that are small or finite, as its board's deflection calls for.

        Raises:
            PulseError: the table of the pulse cannot be read.
        """
        if self.shock.numerics.kinematics != "auto":
            return self
        from reflowshock.workflow.board_drop.board_deflection import decide_kinematics

        numerics = self.shock.numerics.model_copy(update={"kinematics": decide_kinematics(self)[0]})
        return self.model_copy(update={"shock": self.shock.model_copy(update={"numerics": numerics})})

    def _decided_problems(self) -> list[Problem]:
        """Find what does not go with the kinematics that ``auto`` decides on."""
        from reflowshock.fem.problem import shock_checks

        return self.in_words(shock_checks.problems(self.decided.shock))

    def _impossible_steps(self) -> list[Problem]:
        from reflowshock.workflow.board_drop.forecast import step_problems

        return list(step_problems(self))

    def _flow_problems(self) -> list[Problem]:
        """Find a limit of plastic work where nothing yields, and linear steps where something does."""
        failure, numerics, found = self.shock.failure, self.shock.numerics, []
        yielding = [role for role, material in self.materials.by_role.items() if material.plasticity is not None]
        if failure.plastic_work_density is not None and "solder" not in yielding:
            message = "limits the plastic work of solder that does not yield"
            allowed = 'materials.solder of the library, such as "SAC405", or with a table plasticity'
            limit = fields.shown(failure.plastic_work_density, type(failure).model_fields["plastic_work_density"])
            found.append(Problem("shock.failure.plastic_work_density", message, limit, allowed))
        if numerics.dns_solver == "implicit" and yielding:
            message = f"is linear, {' and '.join(yielding)} yields"
            found.append(Problem("shock.numerics.dns_solver", message, "implicit", "explicit, or elastic materials"))
        return found

    def _coupling_problems(self) -> list[Problem]:
        """Find local steps of what has a path."""
        if self.shock.coupling.scheme != "local_steps" or "two_scale" not in self.shock.numerics.modes:
            return []
        yielding = [role for role, material in self.materials.by_role.items() if material.plasticity is not None]
        if not yielding and self.decided.shock.numerics.kinematics == "small":
            return []
        why = f"{' and '.join(yielding)} yields" if yielding else "shock.numerics.kinematics is finite"
        message = f"needs elastic materials at small strains, {why}"
        allowed = "held_velocity, impulse, gravouil_combescure, auto"
        return [Problem("shock.coupling.scheme", message, "local_steps", allowed)]

    @property
    def ranks(self) -> int:
        """MPI ranks of the shock."""
        return self.shock.ranks.total
