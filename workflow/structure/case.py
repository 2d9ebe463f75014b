"""The case of a structure: a box of layers, held and loaded, whose motion is computed."""

from pathlib import Path

from pydantic import Field

from reflowshock.fem.problem.structure import StructureProblem
from reflowshock.meshing.board.box_plan import Box, BoxHoles, BoxLayer
from reflowshock.workflow.case.kind import Case
from reflowshock.workflow.case.problems import Problem
from reflowshock.workflow.case.pulse_files import unreadable_pulses
from reflowshock.workflow.case.stage_table import STRUCTURE
from reflowshock.workflow.case.toml_file import beside
from reflowshock.workflow.structure.references import AnyReference, reference_problems


class StructureCase(StructureProblem, Case):
    """A box of layers under supports and loads."""

    kind = "structure"
    stages = STRUCTURE
    ranks_key = "dynamics.ranks"

    references: dict[str, AnyReference] = Field(default_factory=dict)

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Take the tables of loads as relative to the folder of the case file."""
        loads = table.get("loads")
        for load in loads.values() if isinstance(loads, dict) else ():
            if isinstance(load, dict) and isinstance(load.get("table"), str):
                load["table"] = beside(folder, load["table"])
        return table

    @property
    def pulse_tables(self) -> dict[str, tuple[Path, str]]:
        """Tables of loads."""
        from reflowshock.fem.loads.structure_pulses import QUANTITY

        return {
            f"loads.{name}.table": (Path(load.table), QUANTITY[load.kind])
            for name, load in self.loads.items()
            if load.table is not None
        }

    @property
    def files(self) -> dict[str, Path]:
        """Tables of loads."""
        return {key: path for key, (path, _) in self.pulse_tables.items()}

    @property
    def scene(self) -> StructureProblem:
        """All of it as the solver takes it."""
        return StructureProblem(**{name: getattr(self, name) for name in StructureProblem.model_fields})

    @property
    def box(self) -> Box:
        """The body as the mesher takes it."""
        body = self.structure.refined
        layers = tuple(
            BoxLayer(name, layer.thickness, layer.cells, layer.in_plane) for name, layer in body.layers.items()
        )
        holes = BoxHoles(body.holes.spacing, body.holes.diameter) if body.holes else None
        return Box((body.length, body.width), body.cells, layers, body.symmetry, body.element, holes)

    def problems(self) -> list[Problem]:
        """Find what does not fit together: materials, places, facet sets, loads, references."""
        from reflowshock.fem.problem import structure_checks
        from reflowshock.meshing.board.box_checks import box_problems

        boxes = [Problem(found.key, found.message, found.value, found.allowed) for found in box_problems(self.box)]
        scenes = [
            Problem(found.key, found.message, found.value, found.allowed, found.hint)
            for found in structure_checks.problems(self.scene)
        ]
        found = [*boxes, *scenes, *unreadable_pulses(self.pulse_tables)]
        found += reference_problems(self.references, self.scene)
        return found or self._impossible_steps()

    def _impossible_steps(self) -> list[Problem]:
        from reflowshock.workflow.structure.findings import waves_that_do_not_pass
        from reflowshock.workflow.structure.forecast import step_problems

        return [*step_problems(self), *waves_that_do_not_pass(self)]

    @property
    def ranks(self) -> int:
        """MPI ranks of each solver."""
        return self.dynamics.ranks
