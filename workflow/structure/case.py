"""The case of a structure: a box of layers, held and loaded, whose motion is computed."""

from pathlib import Path

from pydantic import Field

from fem.problem.structure import StructureScene
from meshing.board.box_plan import Box, BoxHoles, BoxLayer
from workflow.case.kind import Case
from workflow.case.problems import Problem
from workflow.case.pulse_files import unreadable_pulses
from workflow.case.stage_table import STRUCTURE
from workflow.case.toml_file import beside
from workflow.structure.references import AnyReference, reference_problems


class StructureCase(StructureScene, Case):
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
        from fem.problem.structure_pulses import QUANTITY

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
    def scene(self) -> StructureScene:
        """All of it as the solver takes it."""
        return StructureScene(**{name: getattr(self, name) for name in StructureScene.model_fields})

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
        from fem.problem import structure_checks
        from meshing.board.box_checks import box_problems

        boxes = [Problem(found.key, found.message, found.value, found.allowed) for found in box_problems(self.box)]
        scenes = [
            Problem(found.key, found.message, found.value, found.allowed, found.hint)
            for found in structure_checks.problems(self.scene)
        ]
        found = [*boxes, *scenes, *unreadable_pulses(self.pulse_tables)]
        found += reference_problems(self.references, self.scene)
        return found or self._impossible_steps()

    def _impossible_steps(self) -> list[Problem]:
        from workflow.structure.findings import waves_that_do_not_pass
        from workflow.structure.forecast import step_problems

        return [*step_problems(self), *waves_that_do_not_pass(self)]

    @property
    def ranks(self) -> int:
        """MPI ranks of each solver."""
        return self.dynamics.ranks
