"""Case of a structure: a box of layers with supports and loads, whose motion is computed."""

from pathlib import Path

from pydantic import Field

from reflowshock.fem.problem.fittings import Fittings
from reflowshock.fem.problem.structure import StructureProblem
from reflowshock.meshing.board.box_plan import Box, BoxHoles, BoxLayer
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.error_settings import CaseNumerics, Method
from reflowshock.workflow.case.stage import ERROR_METHOD, ERRORS, Pipeline, Stage, report_of
from reflowshock.workflow.case.toml_file import resolved_path
from reflowshock.workflow.structure.references import AnyReference

MESH_KEYS = ("length", "width", "cells", "refine", "symmetry", "element", "layers", "holes")
MOTION_KEYS = ("structure", "materials", *Fittings.model_fields, "loads", "dynamics")


def structure_pipeline(estimated: bool = False) -> Pipeline:
    """Return the stages of a structure.

    Args:
        estimated: Whether companions on coarser meshes estimate the errors of the motion.
    """
    keys = tuple(f"structure.{name}" for name in MESH_KEYS)
    stages = (
        Stage("geometry", keys, (), ("geometry/structure.msh", "geometry/preview.png")),
        Stage("shock", MOTION_KEYS, ("geometry",), ()),
        Stage("comparison", ("references",), ("shock",), ("comparison/comparison.json",)),
        *((ERRORS,) if estimated else ()),
    )
    follows = tuple(stage.name for stage in stages)
    return Pipeline((*stages, report_of(*follows, parameters=(ERROR_METHOD,))))


class StructureCase(StructureProblem, Case):
    """Box of layers with supports, loads and references."""

    kind = "structure"
    ranks_key = "dynamics.ranks"

    references: dict[str, AnyReference] = Field(default_factory=dict)
    numerics: CaseNumerics = CaseNumerics()

    @property
    def pipeline(self) -> Pipeline:
        """Stages of the structure, with the estimate of its errors if the case has one."""
        return structure_pipeline(self.estimates_errors)

    @property
    def error_method(self) -> Method:
        """Origin of the discretisation errors."""
        return self.numerics.error.method

    @property
    def has_exact_solution(self) -> bool:
        """Whether the motion is compared with an exact solution, so that its error is known."""
        return any(reference.is_exact for reference in self.references.values())

    @property
    def estimates_errors(self) -> bool:
        """Whether companions estimate the errors."""
        return self.error_method == "estimate" and not self.has_exact_solution

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Resolve the tables of loads and records relative to the folder of the case file."""
        named = [group for key in ("loads", "references") if isinstance(group := table.get(key), dict)]
        for item in (item for group in named for item in group.values()):
            if isinstance(item, dict) and isinstance(item.get("table"), str):
                item["table"] = resolved_path(folder, item["table"])
        return table

    @property
    def pulse_tables(self) -> dict[str, tuple[Path, str, str | None]]:
        """Tables of loads and records by key: file, quantity, column."""
        loads = {
            f"loads.{name}.table": (Path(load.table), load.quantity, load.table_column)
            for name, load in self.loads.items()
            if load.table is not None
        }
        return loads | {
            f"references.{name}.table": (Path(record.table), "acceleration", record.table_column)
            for name, reference in self.references.items()
            if (record := reference.record) is not None
        }

    @property
    def files(self) -> dict[str, Path]:
        """Files of the tables of loads and records by key."""
        return {key: path for key, (path, *_) in self.pulse_tables.items()}

    @property
    def problem(self) -> StructureProblem:
        """Problem for the solvers."""
        return StructureProblem(**{name: getattr(self, name) for name in StructureProblem.model_fields})

    @property
    def box(self) -> Box:
        """Geometry for the mesher, refined."""
        body = self.structure.refined
        layers = tuple(
            BoxLayer(name, layer.thickness, layer.cells, layer.in_plane) for name, layer in body.layers.items()
        )
        holes = BoxHoles(body.holes.spacing, body.holes.diameter) if body.holes else None
        return Box((body.length, body.width), body.cells, layers, body.symmetry, body.element, holes)

    @property
    def ranks(self) -> int:
        """MPI ranks of each solver."""
        return self.dynamics.ranks
