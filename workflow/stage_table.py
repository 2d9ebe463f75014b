"""The stages: what each reads and writes. Snakemake's rules and the reasons that `plan` gives both come from here."""

from dataclasses import dataclass

ARRAY = (
    "package.rows",
    "package.columns",
    "package.depopulated",
    "package.pitch",
    "package.standoff",
    "package.board_pad",
    "package.package_pad",
    "board.symmetry",
    "warpage",
)


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage of the pipeline.

    Attributes:
        name: name of the stage and of its folder.
        parameters: dotted keys of the parameters, or tables of them, that it depends on.
        follows: stages whose products it depends on: when they ran, it has to run.
        pads: whether it reads the pad table. Its ``parameters`` then contain all that this table depends on, so that
            it need not run again when the geometry changes elsewhere.
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


STAGES = (
    Stage(
        "geometry",
        (*ARRAY, "package.copper", "package.substrate", "package.die", "package.numerics", "board"),
        (),
        ("geometry/assembly.msh", "geometry/pads.json", "geometry/preview.png"),
    ),
    Stage("reflow", (*ARRAY, "solder"), (), ("reflow/shapes.h5", "reflow/joints.json"), pads=True),
    Stage("surface", (), ("reflow",), ("surface/surfaces.json",)),
    Stage(
        "solder_mesh",
        (*ARRAY, "package.copper", "package.joint_numerics", "materials.copper", "materials.solder"),
        ("surface",),
        ("solder_mesh/joints.msh", "solder_mesh/quality.json"),
        pads=True,
    ),
    Stage("shock", ("shock", "materials"), ("geometry", "solder_mesh"), ()),
    Stage(
        "report",
        ("case",),
        ("geometry", "reflow", "surface", "solder_mesh", "shock"),
        ("report.html", "summary.json"),
    ),
)
BY_NAME = {stage.name: stage for stage in STAGES}
NAMES = tuple(BY_NAME)


def upstream(name: str) -> tuple[str, ...]:
    """Return the stages up to and including one, in order."""
    return NAMES[: NAMES.index(name) + 1]
