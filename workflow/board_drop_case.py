"""The case of a package on a board: its joints reflowed, then the board dropped."""

from fem.material_roles import Materials
from fem.parameters import Shock
from meshing.parameters import Board, Package, Warpage
from particles.parameters import Solder
from workflow import fields
from workflow.case_kind import Case, of_particles
from workflow.problems import Problem
from workflow.stage_table import BOARD_DROP


class BoardDropCase(Case):
    """A package on a board: its joints reflowed, then the board dropped."""

    kind = "package"
    pipeline = BOARD_DROP
    ranks_key = "shock.ranks"

    package: Package
    board: Board
    warpage: Warpage = Warpage()
    solder: Solder
    materials: Materials = Materials()
    shock: Shock

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible package, joint or board together."""
        from meshing import checks as meshing_checks
        from meshing.pads import pad_table
        from particles import checks as particles_checks
        from workflow.reflow_pool import joint_geometries

        contradictions = meshing_checks.problems(self.package, self.board, self.warpage)
        if contradictions:
            known = {key: field for key, _, field in fields.leaves(self)}
            return [
                Problem(found.key, found.message, fields.shown(found.value, known.get(found.key)), found.allowed)
                for found in contradictions
            ]
        geometries = joint_geometries(pad_table(self.package, self.board, self.warpage))
        return of_particles(particles_checks.problems(self.solder, geometries, self.package.pitch))

    @property
    def ranks(self) -> int:
        """MPI ranks of the shock."""
        return self.shock.ranks.macro + self.shock.ranks.meso
