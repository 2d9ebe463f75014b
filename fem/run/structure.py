"""Dynamic run of a structure, as a problem of ``run_dynamics``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.coupling.planner import Plan
from reflowshock.fem.division.structure_tables import StructureTables
from reflowshock.fem.dynamics.history import Signal
from reflowshock.fem.estimates.placement import shared
from reflowshock.fem.loads.load import Load
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.loads.structure_loads import LoadedModel, damping_loads, structure_loads
from reflowshock.fem.loads.structure_pulses import pulse_durations, pulses_of
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.output.structure_modes import ModeTable, find_modes
from reflowshock.fem.output.structure_result import StructureReport
from reflowshock.fem.output.watch_points import PointWatch
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.problem.inputs import StructureInput
from reflowshock.fem.problem.kinematics import TURNING
from reflowshock.fem.run.dynamics import place_models, run_dynamics
from reflowshock.fem.run.time_loop import Pictures
from reflowshock.fem.setup.models import DividedModels
from reflowshock.fem.setup.structure_models import StructureModel, build_coupled, build_structure, divide_structure


@dataclass(frozen=True, slots=True)
class StructureDynamics:
    """Structure with one of its solvers; implements ``DynamicProblem``."""

    request: StructureInput
    divided: DividedModels[StructureTables] | None
    pulses: Mapping[str, Pulse]

    @classmethod
    def read(cls, world: MPI.Comm, request: StructureInput) -> "StructureDynamics":
        """Read the pulses, and divide the mesh of two coupled models; collective.

        Raises:
            AgreedError: The input or a mesh does not fit; on every rank.
        """
        pulses = agreed(world, lambda: pulses_of(request.loads))
        return cls(request, divide_structure(world, request) if request.coupled else None, pulses)

    @property
    def signals(self) -> Mapping[str, Signal]:
        """Value of each load over time, named ``load@<name>``."""
        return {f"load@{name}": pulse.value for name, pulse in self.pulses.items()}

    @property
    def report(self) -> StructureReport:
        """Report of the structure in the result file."""
        return StructureReport(self.request)

    def place(self, world: MPI.Comm) -> Plan:
        """Assign models and cells to ranks; a single model is on all ranks."""
        if self.divided is None:
            return Plan(shared(("structure",), world.size), {}, {})
        return place_models(world, self.divided, self.request)

    def build(
        self, comms: Communicators, cells: Mapping[Role, NDArray[np.int32]]
    ) -> tuple[dict[Role, StructureModel], Steps]:
        """Return the models and steps."""
        if self.divided is not None:
            return build_coupled(comms, self.divided, self.request, cells), self.divided.steps
        model, steps = build_structure(comms.models["structure"], self.request, pulse_durations(self.pulses))
        return {"structure": model}, steps

    def loads(self, comm: MPI.Comm, model: StructureModel, steps: Steps) -> list[Load]:
        """Return the loads and the damping of a model."""
        loads = structure_loads(LoadedModel(comm, model.body, model.tables, self.request), self.pulses)
        return loads + damping_loads(self.request.dynamics.damping, model.body)

    def watch(self, model: StructureModel) -> PointWatch:
        """Return the watch points of a model."""
        return PointWatch(model.tables.fitted.points, model.body, self.request.kinematics in TURNING)

    def trivial_energy(self, steps: Steps) -> float:
        """Return zero, since the balance is exact and is checked at any energy."""
        return 0.0

    def pictures(self, world: MPI.Comm, models: Mapping[Role, StructureModel], steps: Steps) -> Sequence[Pictures]:
        """Return no snapshots."""
        return ()

    @property
    def is_over(self) -> None:
        """None, since the run of a structure does not end early."""

    def find_modes(self, comms: Communicators, models: Mapping[Role, StructureModel], steps: Steps) -> ModeTable | None:
        """Return the natural modes if the input requests them, otherwise None."""
        if not self.request.finds_modes:
            return None
        return find_modes(comms.models["structure"], models["structure"], steps.moved_mass, self.request)


def run_structure(world: MPI.Comm, request: StructureInput) -> None:
    """Run the explicit or implicit solver on a structure and write its results; collective over ``world``.

    Args:
        world: Communicator of all ranks.
        request: Input with mesh, materials, loads, dynamics and output folder.

    Raises:
        AgreedError: The input or a mesh does not fit; on every rank.
        RankError: The number of ranks does not suit the problem; on every rank.
        EnergyError: The energy balance is violated; on every rank.
    """
    run_dynamics(world, StructureDynamics.read(world, request))
