"""The stages: what each reads and writes. Snakemake's rules and the reasons that `plan` gives both come from here."""

from dataclasses import dataclass

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
JOINT_MESHES = (
    "package.joint_numerics",
    "package.coarse_joint_numerics",
    "shock.coupling.fine_joints",
    "shock.coupling.direction",
)


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage of the pipeline.

    Attributes:
        name: name of the stage and of its folder.
        parameters: dotted keys of the parameters, or tables of them, that it depends on.
        follows: stages whose products it depends on: when they ran, it has to run.
        pads: whether it reads the pad table as drawn. Its ``parameters`` then contain all that this table depends on,
            so that it need not run again when the geometry changes elsewhere.
        products: files that it writes, relative to the run folder.
    """

    name: str
    parameters: tuple[str, ...]
    follows: tuple[str, ...]
    products: tuple[str, ...]
    pads: bool = False

    @property
    def record(self) -> str:
        """File, relative to the run folder, in which the stage says what it used, found and measured."""
        return f"{self.name}/stage.json"

    @property
    def inputs(self) -> str:
        """File, relative to the run folder, with the values of its parameters."""
        return f"inputs/{self.name}.json"


@dataclass(frozen=True, slots=True)
class Pipeline:
    """The stages of a kind of case, in order."""

    stages: tuple[Stage, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the stages."""
        return tuple(stage.name for stage in self.stages)

    def __getitem__(self, name: str) -> Stage:
        return self.stages[self.names.index(name)]

    def upstream(self, name: str) -> tuple[Stage, ...]:
        """Return the stages up to and including one."""
        return self.stages[: self.names.index(name) + 1]


BOARD_DROP = Pipeline(
    (
        Stage(
            "geometry",
            (*DRAWN, "package.copper", "package.substrate", "package.die", "package.numerics", "board"),
            (),
            ("geometry/assembly.msh", "geometry/pads.json", "geometry/preview.png"),
        ),
        Stage(
            "reflow",
            (*PADS, "thermal", "solder"),
            (),
            ("reflow/shapes.h5", "reflow/joints.json", "reflow/pads.json"),
            pads=True,
        ),
        Stage("surface", (), ("reflow",), ("surface/surfaces.json",)),
        Stage(
            "solder_mesh",
            ("warpage", *JOINT_MESHES, "materials.copper", "materials.solder"),
            ("geometry", "surface"),
            ("solder_mesh/assembly.msh", "solder_mesh/joints.msh", "solder_mesh/quality.json"),
        ),
        Stage("shock", ("shock", "materials"), ("solder_mesh",), ()),
        Stage(
            "report",
            ("case",),
            ("geometry", "reflow", "surface", "solder_mesh", "shock"),
            ("report.html", "summary.json"),
        ),
    )
)


def _one_body(scene: str) -> Pipeline:
    """Reflow of one scene, and its report."""
    reflow = Stage("reflow", (scene, "solder", "gravity"), (), ("reflow/shape.h5", "reflow/particles.vtu"))
    return Pipeline((reflow, Stage("report", ("case",), ("reflow",), ("report.html", "summary.json"))))


DROP = _one_body("drop")
JOINT = _one_body("joint")
DROPS = _one_body("drops")
OSCILLATION = _one_body("oscillation")

MESHED = ("length", "width", "cells", "symmetry", "element", "layers", "holes")
STRUCTURE = Pipeline(
    (
        Stage(
            "geometry",
            tuple(f"structure.{name}" for name in MESHED),
            (),
            ("geometry/structure.msh", "geometry/preview.png"),
        ),
        Stage("shock", ("structure", "materials", "supports", "loads", "watch", "dynamics"), ("geometry",), ()),
        Stage("comparison", ("references",), ("shock",), ("comparison/comparison.json",)),
        Stage("report", ("case",), ("geometry", "shock", "comparison"), ("report.html", "summary.json")),
    )
)
