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
GIVEN = ("package.surfaces", "package.surface_unit")
JOINT_MESHES = (
    "package.joint_numerics",
    "package.coarse_joint_numerics",
    "shock.coupling.fine_joints",
    "shock.coupling.direction",
    "shock.identical_joints",
)

PAGE = ("report.html", "summary.json")


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
        on_top: those of its files that a run folder also shows at its top.
    """

    name: str
    parameters: tuple[str, ...]
    follows: tuple[str, ...]
    products: tuple[str, ...]
    pads: bool = False
    on_top: tuple[str, ...] = ()

    @property
    def record(self) -> str:
        """File, relative to the run folder, in which the stage says what it used, found and measured."""
        return f"{self.name}/stage.json"


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

    def read_by(self, name: str) -> tuple[str, ...]:
        """Return the names of the stages whose products one reads: that it follows, and that those follow, in order."""
        if self[name].pads:
            return ("geometry",)
        found = set(self[name].follows)
        for stage in reversed(self.upstream(name)[:-1]):
            found |= set(stage.follows) if stage.name in found else set()
        return tuple(one for one in self.names if one in found)


def report_of(*follows: str) -> Stage:
    """Return the last stage of a pipeline, which tells what the others found."""
    return Stage("report", ("case", "scale"), follows, tuple(f"report/{name}" for name in PAGE), on_top=PAGE)


DRAWN_MESH = (*DRAWN, "package.copper", "package.substrate", "package.die", "package.numerics", "board")
HEATED = tuple(
    f"thermal.{name}"
    for name in (
        "reference", "peak", "melting", "solidification", "steps", "package", "corner_displacement", "tolerance",
        "effects.flexible", "effects.solder_force",
    )
)  # fmt: skip
STRUCTURE_ROLES = tuple(f"materials.{role}" for role in ("board", "substrate", "die", "copper"))
COOLED = ("thermal.solidification", "thermal.final", "thermal.effects.residual_stress")


def package_pipeline(heated: bool, dropped: bool) -> Pipeline:
    """Return the stages of a package on a board.

    Args:
        heated: whether the reflow has temperatures: it then needs the mesh of board and package.
        dropped: whether there is a shock.
    """
    geometry = Stage(
        "geometry", DRAWN_MESH, (), ("geometry/assembly.msh", "geometry/pads.json", "geometry/preview.png")
    )
    solid = ("reflow/shapes.h5", "reflow/joints.json", "reflow/pads.json")
    if heated:
        last = () if dropped else COOLED  # what is told of cooling, where no shock begins with it
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
    shock = Stage("shock", ("shock", "materials", *COOLED), ("solder_mesh",), ())
    stages = (geometry, reflow, surface, solder_mesh, *((shock,) if dropped else ()))
    follows = tuple(stage.name for stage in stages)
    return Pipeline((*stages, report_of(*follows)))


BOARD_DROP = package_pipeline(heated=False, dropped=True)


def _one_body(scene: str) -> Pipeline:
    """Reflow of one scene, and its report."""
    reflow = Stage("reflow", (scene, "solder", "gravity"), (), ("reflow/shape.h5", "reflow/particles.vtu"))
    return Pipeline((reflow, report_of("reflow")))


DROP = _one_body("drop")
JOINT = _one_body("joint")
DROPS = _one_body("drops")
OSCILLATION = _one_body("oscillation")

MESHED = ("length", "width", "cells", "refine", "symmetry", "element", "layers", "holes")
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
        report_of("geometry", "shock", "comparison"),
    )
)
