"""The input file of a run: which models, meshes, materials and loads, and where the results go."""

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


class RunInput(PackageInput, BoardFittings):
    """A package on a board, dropped.

    ``checkpoints`` is a folder from which a run continues, ``cooling`` the file of the state in which it begins. A run
    ends at ``end`` [s], or before the end of its shock when ``output.settled`` says so, if it ``settles``.
    """

    mode: Literal["two_scale", "dns"]
    settles: bool = False
    end: float | None = Field(None, gt=0)
    checkpoints: Path | None = None
    cooling: Path | None = None

    @property
    def numerics(self) -> ShockNumerics:
        """Return how the motion is computed."""
        return self.shock.numerics

    @property
    def part_materials(self) -> Materials:
        """Return the material of each role that a part can have."""
        return self.materials

    @property
    def formulation(self) -> str:
        """Return the formulation of hexahedra."""
        return self.shock.numerics.formulation

    @property
    def kinematics(self) -> Kinematics:
        """Return whether rotations and strains are small."""
        return self.shock.numerics.decided_kinematics

    @property
    def coupled(self) -> bool:
        """Return whether the run has two models."""
        return self.mode == "two_scale"

    def ranks(self, started: int) -> Ranks:
        """Return which of so many ranks work on which model."""
        return self.shock.ranks

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
    def initial_velocity(self) -> tuple[float, float, float]:
        """Return the velocity of all that is free at time zero [m/s]: none."""
        return 0.0, 0.0, 0.0

    @property
    def hht_alpha(self) -> float:
        """Return the alpha of the HHT method."""
        return 0.0

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
    def files(self) -> tuple[Path, ...]:
        """Return all files that results depend on."""
        return (self.mesh, *(Path(load.table) for load in self.loads.values() if load.table is not None))

    @property
    def numerics(self) -> DynamicsNumerics:
        """Return how the motion is computed."""
        return self.dynamics.numerics

    @property
    def part_materials(self) -> dict[str, Material]:
        """Return the material of each part: of each layer."""
        return self.layer_materials

    @property
    def formulation(self) -> str:
        """Return the formulation of hexahedra."""
        return self.structure.formulation

    @property
    def kinematics(self) -> Kinematics:
        """Return whether rotations and strains are small."""
        return self.dynamics.kinematics

    @property
    def initial_velocity(self) -> tuple[float, float, float]:
        """Return the velocity of all that is free at time zero [m/s]."""
        return self.dynamics.initial_velocity

    @property
    def hht_alpha(self) -> float:
        """Return the alpha of the HHT method."""
        return self.dynamics.numerics.hht_alpha

    @property
    def implicit(self) -> bool:
        """Whether the run takes implicit steps."""
        return self.solver == "implicit"

    @property
    def coupled(self) -> bool:
        """Return whether the run has two models."""
        return self.solver == "explicit" and self.dynamics.coupling is not None

    def ranks(self, started: int) -> Ranks:
        """Return which of so many ranks work on which model."""
        coupling = self.dynamics.coupling or LayerCoupling()
        return Ranks(total=started, placement=coupling.placement, macro=coupling.macro_ranks)

    @property
    def finds_modes(self) -> bool:
        """Return whether this run is the one of the problem's solvers that finds the natural modes."""
        alone = [solver for solver in self.dynamics.solvers if solver != "explicit" or not self.dynamics.coupling]
        return self.dynamics.modes > 0 and self.solver in alone[:1]


# What ``python -m fem INPUT.json`` reads.
INPUT: TypeAdapter[RunInput | CoolingInput | StructureInput] = TypeAdapter(
    Annotated[RunInput | CoolingInput | StructureInput, Field(discriminator="mode")]
)
