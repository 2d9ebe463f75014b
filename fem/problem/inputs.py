"""Input file of a run: models, meshes, materials, loads, and the folder of the results."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from reflowshock.fem.problem.fittings import BoardFittings
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.fem.problem.shock import Ranks, Shock, ShockNumerics
from reflowshock.fem.problem.structure import DynamicsNumerics, LayerCoupling, SolverName, StructureProblem
from reflowshock.materials.parameters import Material
from reflowshock.materials.roles import Materials
from reflowshock.parameters import Parameters

UNRELATED = {"checkpoint_seconds", "watchdog_seconds"}  # numerics that results do not depend on


class PackageInput(Parameters):
    """A package on a board; SI floats.

    ``meshes`` have fine meshes of all joints, ``coarse_joints`` the coarse meshes of joints that are not fine.
    """

    meshes: tuple[Path, ...] = Field(min_length=1)
    coarse_joints: Path | None = None
    shock: Shock
    materials: Materials = Materials()
    output: Path

    @property
    def watchdog_seconds(self) -> float:
        """Longest time that a rank may wait for another [s]."""
        return self.shock.numerics.watchdog_seconds

    @property
    def mesh_files(self) -> tuple[Path, ...]:
        """All mesh files."""
        return (*self.meshes, self.coarse_joints) if self.coarse_joints else self.meshes

    @property
    def one_way(self) -> bool:
        """Whether a coarse model of the whole package drives a finer model of some joints."""
        return False


class CoolingInput(PackageInput):
    """Cooling of the whole model from its stress-free state by the temperature ``change`` [K]."""

    mode: Literal["cooling"]
    change: float


class RunInput(PackageInput, BoardFittings):
    """Drop of a package on a board.

    ``checkpoints`` is a folder from which a run continues, ``cooling`` the file of its initial state. A run ends at
    ``end`` [s]; if ``settles`` is true, it ends as soon as ``output.settled`` finds that no higher peak follows.
    """

    mode: Literal["two_scale", "dns"]
    settles: bool = False
    end: float | None = Field(None, gt=0)
    checkpoints: Path | None = None
    cooling: Path | None = None

    @property
    def numerics(self) -> ShockNumerics:
        """Numerical parameters of the motion."""
        return self.shock.numerics

    @property
    def part_materials(self) -> Materials:
        """Material of each role of a part."""
        return self.materials

    @property
    def formulation(self) -> str:
        """Formulation of hexahedra."""
        return self.shock.numerics.formulation

    @property
    def kinematics(self) -> Kinematics:
        """Kinematics of the elements: small, corotational or finite."""
        return self.shock.numerics.decided_kinematics

    @property
    def coupled(self) -> bool:
        """Whether the run has two models."""
        return self.mode == "two_scale"

    def ranks(self, started: int) -> Ranks:
        """Return how the started MPI ranks are divided between the models."""
        return self.shock.ranks

    @property
    def computed(self) -> str:
        """JSON text of all parameters that the results depend on, without output paths, ranks and failure limits."""
        shock: Any = {"ranks": True, "numerics": UNRELATED, "failure": True}
        return self.model_dump_json(exclude={"output": True, "checkpoints": True, "cooling": True, "shock": shock})

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that the results depend on."""
        tables = (Path(self.shock.table),) if self.shock.table else ()
        return (*self.mesh_files, *tables, *((self.cooling,) if self.cooling else ()))

    @property
    def one_way(self) -> bool:
        """Whether a coarse model of the whole package drives a finer model of some joints."""
        return self.mode == "two_scale" and self.shock.coupling.direction == "one_way"

    @property
    def initial_velocity(self) -> tuple[float, float, float]:
        """Initial velocity of the free nodes [m/s], zero."""
        return 0.0, 0.0, 0.0

    @property
    def hht_alpha(self) -> float:
        """Parameter alpha of the HHT method."""
        return 0.0

    @property
    def implicit(self) -> bool:
        """Whether the run takes implicit steps."""
        return self.mode == "dns" and self.shock.numerics.dns_solver == "implicit"


class StructureInput(StructureProblem):
    """A structure and one of its solvers; SI floats.

    ``checkpoints`` is a folder from which a run continues. The solver ``dns`` is the explicit solver without coupling.
    """

    mode: Literal["structure"]
    mesh: Path
    solver: SolverName
    output: Path
    checkpoints: Path | None = None

    @property
    def watchdog_seconds(self) -> float:
        """Longest time that a rank may wait for another [s]."""
        return self.dynamics.numerics.watchdog_seconds

    @property
    def computed(self) -> str:
        """JSON text of all parameters that the results depend on, without output paths and ranks."""
        ranks = {"placement", "macro_ranks"}
        dynamics: Any = {"ranks": True, "numerics": UNRELATED, "coupling": ranks}
        return self.model_dump_json(exclude={"output": True, "checkpoints": True, "dynamics": dynamics})

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that the results depend on."""
        return (self.mesh, *(Path(load.table) for load in self.loads.values() if load.table is not None))

    @property
    def numerics(self) -> DynamicsNumerics:
        """Numerical parameters of the motion."""
        return self.dynamics.numerics

    @property
    def part_materials(self) -> dict[str, Material]:
        """Material of each layer."""
        return self.layer_materials

    @property
    def formulation(self) -> str:
        """Formulation of hexahedra."""
        return self.structure.formulation

    @property
    def kinematics(self) -> Kinematics:
        """Kinematics of the elements: small, corotational or finite."""
        return self.dynamics.kinematics

    @property
    def initial_velocity(self) -> tuple[float, float, float]:
        """Initial velocity of the free nodes [m/s]."""
        return self.dynamics.initial_velocity

    @property
    def hht_alpha(self) -> float:
        """Parameter alpha of the HHT method."""
        return self.dynamics.numerics.hht_alpha

    @property
    def implicit(self) -> bool:
        """Whether the run takes implicit steps."""
        return self.solver == "implicit"

    @property
    def coupled(self) -> bool:
        """Whether the run has two models."""
        return self.solver == "explicit" and self.dynamics.coupling is not None

    def ranks(self, started: int) -> Ranks:
        """Return how the started MPI ranks are divided between the models."""
        coupling = self.dynamics.coupling or LayerCoupling()
        return Ranks(total=started, placement=coupling.placement, macro=coupling.macro_ranks)

    @property
    def finds_modes(self) -> bool:
        """Whether this run computes the natural modes; only the first solver with a single model does."""
        alone = [solver for solver in self.dynamics.solvers if solver != "explicit" or not self.dynamics.coupling]
        return self.dynamics.modes > 0 and self.solver in alone[:1]


# Type of the file that ``python -m fem INPUT.json`` reads.
INPUT: TypeAdapter[RunInput | CoolingInput | StructureInput] = TypeAdapter(
    Annotated[RunInput | CoolingInput | StructureInput, Field(discriminator="mode")]
)
