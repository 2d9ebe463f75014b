"""The input file of a run: which models, meshes, materials and loads, and where the results go."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.parameters import Parameters
from reflowshock.fem.problem.shock import Shock
from reflowshock.fem.problem.structure import SolverName, StructureProblem

UNRELATED = {"checkpoint_seconds", "watchdog_seconds"}  # numerics that results do not depend on


class PackageInput(Parameters):
    """A package on a board; SI floats.

    ``meshes`` have all joints fine, ``coarse_joints`` has those that are not.
    """

    meshes: tuple[Path, ...] = Field(min_length=1)
    coarse_joints: Path | None = None
    shock: Shock
    materials: Materials = Materials()
    output: Path

    @property
    def watchdog_seconds(self) -> float:
        """Return how long one wait of a rank may last [s]."""
        return self.shock.numerics.watchdog_seconds

    @property
    def mesh_files(self) -> tuple[Path, ...]:
        """Return all files of meshes."""
        return (*self.meshes, self.coarse_joints) if self.coarse_joints else self.meshes

    @property
    def one_way(self) -> bool:
        """Whether a coarse model of all drives a finer one of some joints."""
        return False


class CoolingInput(PackageInput):
    """Cooling of the whole model from where it is free of stress, ``change`` of temperature [K]."""

    mode: Literal["cooling"]
    change: float


class RunInput(PackageInput):
    """A package on a board, dropped.

    ``checkpoints`` is a folder from which a run continues, ``cooling`` the file of the state in which it begins.
    """

    mode: Literal["two_scale", "dns"]
    checkpoints: Path | None = None
    cooling: Path | None = None

    @property
    def computed(self) -> str:
        """Return all that results depend on: not where they go, nor which ranks compute them."""
        shock: Any = {"ranks": True, "numerics": UNRELATED}
        return self.model_dump_json(exclude={"output": True, "checkpoints": True, "cooling": True, "shock": shock})

    @property
    def files(self) -> tuple[Path, ...]:
        """Return all files that results depend on."""
        tables = (Path(self.shock.table),) if self.shock.table else ()
        return (*self.mesh_files, *tables, *((self.cooling,) if self.cooling else ()))

    @property
    def one_way(self) -> bool:
        """Whether a coarse model of all drives a finer one of some joints."""
        return self.mode == "two_scale" and self.shock.coupling.direction == "one_way"

    @property
    def implicit(self) -> bool:
        """Whether the run takes implicit steps."""
        return self.mode == "dns" and self.shock.numerics.dns_solver == "implicit"


class StructureInput(StructureProblem):
    """A structure and one of its solvers; SI floats. ``checkpoints`` is a folder from which a run continues.

    The solver ``dns`` is the explicit one without coupling.
    """

    mode: Literal["structure"]
    mesh: Path
    solver: SolverName
    output: Path
    checkpoints: Path | None = None

    @property
    def watchdog_seconds(self) -> float:
        """Return how long one wait of a rank may last [s]."""
        return self.dynamics.numerics.watchdog_seconds

    @property
    def computed(self) -> str:
        """Return all that results depend on: not where they go, nor which ranks compute them."""
        ranks = {"placement", "macro_ranks"}
        dynamics: Any = {"ranks": True, "numerics": UNRELATED, "coupling": ranks}
        return self.model_dump_json(exclude={"output": True, "checkpoints": True, "dynamics": dynamics})

    @property
    def coupled(self) -> bool:
        """Return whether the run has two models."""
        return self.solver == "explicit" and self.dynamics.coupling is not None

    @property
    def finds_modes(self) -> bool:
        """Return whether this run is the one of the problem's solvers that finds the natural modes."""
        alone = [solver for solver in self.dynamics.solvers if solver != "explicit" or not self.dynamics.coupling]
        return self.dynamics.modes > 0 and self.solver in alone[:1]


# What ``python -m fem INPUT.json`` reads.
INPUT: TypeAdapter[RunInput | CoolingInput | StructureInput] = TypeAdapter(
    Annotated[RunInput | CoolingInput | StructureInput, Field(discriminator="mode")]
)
