"""A package on a board under input-G: what a run of it has of its own."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.coupling.planner import Plan
from reflowshock.fem.division.checks import check_pulses
from reflowshock.fem.division.tables import JointTables
from reflowshock.fem.dynamics.history import History, Signal
from reflowshock.fem.dynamics.modal import natural_modes
from reflowshock.fem.estimates.estimate import implicit_plan, largest_implicit_step, shortened
from reflowshock.fem.estimates.placement import check_size
from reflowshock.fem.loads.load import Load
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.loads.shock_loads import shock_loads
from reflowshock.fem.loads.shock_pulse import shock_pulse
from reflowshock.fem.loads.structure_pulses import pulse_durations
from reflowshock.fem.model.global_matrix import Equations
from reflowshock.fem.model.steps import Steps
from reflowshock.fem.output.joint_interface import JointInterfaceStress, picture_windows
from reflowshock.fem.output.package_result import PackageReport
from reflowshock.fem.output.settled import WATCHED, is_settled
from reflowshock.fem.output.structure_modes import ModeTable, write_modes
from reflowshock.fem.output.watch_joints import JointWatch
from reflowshock.fem.parallel.agreement import agreed
from reflowshock.fem.parallel.communicators import Communicators, Role
from reflowshock.fem.parallel.whereabouts import HERE
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.kinematics import TURNING
from reflowshock.fem.run.dynamics import place, run_dynamics
from reflowshock.fem.setup.models import Divided, Model
from reflowshock.fem.setup.package_models import build_package, divided_package, elastic_package

SPEEDS = 201  # times at which the largest velocity of the table is looked for
NON_TRIVIAL = 1e-4  # of the energy that the pulse gives a free body: from there on the balance is judged


@dataclass(frozen=True, slots=True)
class PackageDrop:
    """A package on a board; a ``dynamics.DynamicProblem``."""

    request: RunInput
    divided: Divided[JointTables]
    pulse: Pulse

    @classmethod
    def read(cls, world: MPI.Comm, request: RunInput) -> "PackageDrop":
        """Read and divide the meshes; collective. Errors as ``run_dynamics``."""
        if request.coupled:
            check_size(request.shock.ranks, world.size)
        divided = divided_package(world, request)
        return cls(request, divided, agreed(world, lambda: pulse_of(request, divided.steps.plan.window)))

    @property
    def signals(self) -> Mapping[str, Signal]:
        """Return the acceleration of the table."""
        return {"base_acceleration": self.pulse.value}

    @property
    def report(self) -> PackageReport:
        """Return what the result tells of it."""
        return PackageReport(self.request)

    def place(self, world: MPI.Comm) -> Plan:
        """Choose which ranks carry which model and which cells."""
        return place(world, self.divided, self.request)

    def build(
        self, comms: Communicators, cells: Mapping[Role, NDArray[np.int32]]
    ) -> tuple[dict[Role, Model[JointTables]], Steps]:
        """Return the models, and steps that may be implicit or end early."""
        models, steps = build_package(comms, self.divided, self.request, cells)
        request, shock = self.request, self.request.shock
        ends = [request.end, shock.numerics.dns_duration if request.mode == "dns" else None]
        end = min((end for end in ends if end is not None), default=shock.decided_duration)
        if end < shock.decided_duration:
            steps = replace(steps, plan=shortened(steps.plan, end))
        if request.implicit:
            largest = largest_implicit_step(shock.decided_duration, pulse_durations({"drop": self.pulse}))
            steps = replace(steps, plan=implicit_plan(steps.plan, largest))
        return models, steps

    def loads(self, comm: MPI.Comm, model: Model[JointTables], steps: Steps) -> list[Load]:
        """Return the loads and the damping of a model."""
        return shock_loads(comm, steps.moved_mass, model.body, model.tables, self.request.shock)

    def watch(self, model: Model[JointTables]) -> JointWatch:
        """Return the watch points of a model."""
        yields, damping = self.request.materials.solder.plasticity is not None, self.request.shock.damping.coefficients
        turning = self.request.kinematics in TURNING
        return JointWatch(model.tables, model.body, yields, damping, turning)

    def trivial_energy(self, steps: Steps) -> float:
        """Return a small part of the energy [J] that the pulse gives a free body."""
        times = np.linspace(0.0, self.request.shock.decided_duration, SPEEDS)
        speed = max(abs(self.pulse.integral(time)) for time in times)
        return NON_TRIVIAL * 0.5 * steps.moved_mass * speed**2

    def pictures(
        self, world: MPI.Comm, models: Mapping[Role, Model[JointTables]], steps: Steps
    ) -> Sequence[JointInterfaceStress]:
        """Return what is taken at ``shock.picture_times``."""
        times = self.request.shock.picture_times
        tables = {role: (model.tables.joint_interface, model.body) for role, model in models.items()}
        return [JointInterfaceStress(world, tables, picture_windows(times, steps.plan))] if times else []

    @property
    def is_over(self) -> Callable[[History], bool] | None:
        """Return what says whether the shock is over before its end."""
        return (lambda history: is_settled(history.arrays(WATCHED))) if self.request.settles else None

    def find_modes(
        self, comms: Communicators, models: Mapping[Role, Model[JointTables]], steps: Steps
    ) -> ModeTable | None:
        """Return the natural modes, if the run is asked for them: of one model, whatever those of the run are."""
        if not self.request.shock.modes:
            return None
        with HERE.busy("finds natural modes"):
            found = agreed(comms.world, lambda: modes_of(self.request) if comms.world.rank == 0 else None)
        table: ModeTable = comms.world.bcast(found)
        return table


def run(world: MPI.Comm, request: RunInput) -> None:
    """Run one shock and write its results; collective over ``world``, errors as ``run_dynamics``."""
    run_dynamics(world, PackageDrop.read(world, request))


def modes_of(request: RunInput) -> ModeTable:
    """Find and write the natural modes of board and package, whose joints are coarse where there are coarse ones.

    They are those of one linear elastic model with all supports at rest.

    Raises:
        ValueError: More modes are wanted than there are.
    """
    model, mass = elastic_package(request)
    modes = natural_modes(Equations.of(MPI.COMM_SELF, model.body), request.shock.modes)
    table = ModeTable(modes.frequency, modes.effective_mass / mass)
    write_modes(request.output, table)
    return table


def pulse_of(request: RunInput, window: float) -> Pulse:
    """Return the pulse of a run whose window is given [s]; errors as ``shock_pulse`` and ``check_pulses``."""
    pulse = shock_pulse(request.shock).pulse
    if request.coupled:
        check_pulses(pulse_durations({"drop": pulse}), window, request.numerics.step_fraction)
    return pulse
