"""Drop test of a package on a board under input-G, as a problem of ``run_dynamics``."""

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
from reflowshock.fem.estimates.estimate import implicit_plan, largest_implicit_step, shorten_plan
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
from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.problem.inputs import RunInput
from reflowshock.fem.problem.kinematics import TURNING
from reflowshock.fem.run.dynamics import place_models, run_dynamics
from reflowshock.fem.setup.models import DividedModels, Model
from reflowshock.fem.setup.package_models import build_elastic_package, build_package, divide_package

SPEEDS = 201  # sampling points of the drop table's velocity
NON_TRIVIAL = 1e-4  # fraction of a free body's pulse energy above which the balance is checked


@dataclass(frozen=True, slots=True)
class PackageDrop:
    """Drop test of a package on a board; implements ``DynamicProblem``."""

    request: RunInput
    divided: DividedModels[JointTables]
    pulse: Pulse

    @classmethod
    def read(cls, world: MPI.Comm, request: RunInput) -> "PackageDrop":
        """Read and divide the meshes; collective.

        Raises:
            AgreedError: The input or a mesh does not fit; on every rank.
        """
        if request.coupled:
            check_size(request.shock.ranks, world.size)
        divided = divide_package(world, request)
        return cls(request, divided, agreed(world, lambda: _pulse_of(request, divided.steps.plan.window)))

    @property
    def signals(self) -> Mapping[str, Signal]:
        """Acceleration of the drop table."""
        return {"base_acceleration": self.pulse.value}

    @property
    def report(self) -> PackageReport:
        """Report of the package in the result file."""
        return PackageReport(self.request)

    def place(self, world: MPI.Comm) -> Plan:
        """Assign models and cells to ranks."""
        return place_models(world, self.divided, self.request)

    def build(
        self, comms: Communicators, cells: Mapping[Role, NDArray[np.int32]]
    ) -> tuple[dict[Role, Model[JointTables]], Steps]:
        """Return the models and the time steps, which may be implicit or end early."""
        models, steps = build_package(comms, self.divided, self.request, cells)
        request, shock = self.request, self.request.shock
        ends = [request.end, shock.numerics.dns_duration if request.mode == "dns" else None]
        end = min((end for end in ends if end is not None), default=shock.decided_duration)
        if end < shock.decided_duration:
            steps = replace(steps, plan=shorten_plan(steps.plan, end))
        if request.implicit:
            largest = largest_implicit_step(shock.decided_duration, pulse_durations({"drop": self.pulse}))
            steps = replace(steps, plan=implicit_plan(steps.plan, largest))
        return models, steps

    def loads(self, comm: MPI.Comm, model: Model[JointTables], steps: Steps) -> list[Load]:
        """Return the loads and the damping of a model."""
        return shock_loads(comm, steps.moved_mass, model.body, model.tables, self.request.shock)

    def watch(self, model: Model[JointTables]) -> JointWatch:
        """Return the watch points of a model."""
        yields, damping = self.request.materials.solder.plasticity is not None, self.request.shock.damping
        turning = self.request.kinematics in TURNING
        return JointWatch(model.tables, model.body, yields, damping, turning)

    def trivial_energy(self, steps: Steps) -> float:
        """Return a small fraction of the energy that the pulse gives to a free body [J]."""
        times = np.linspace(0.0, self.request.shock.decided_duration, SPEEDS)
        speed = max(abs(self.pulse.integral(time)) for time in times)
        return NON_TRIVIAL * 0.5 * steps.moved_mass * speed**2

    def pictures(
        self, world: MPI.Comm, models: Mapping[Role, Model[JointTables]], steps: Steps
    ) -> Sequence[JointInterfaceStress]:
        """Return the interface stress snapshots at ``shock.picture_times``."""
        times = self.request.shock.picture_times
        tables = {role: (model.tables.joint_interface, model.body) for role, model in models.items()}
        return [JointInterfaceStress(world, tables, picture_windows(times, steps.plan))] if times else []

    @property
    def is_over(self) -> Callable[[History], bool] | None:
        """Function that decides whether the shock has settled before its longest duration, or None."""
        damped = self.request.shock.damping.coefficients[0] > 0.0
        return (lambda history: is_settled(history.arrays(WATCHED), damped)) if self.request.settles else None

    def find_modes(
        self, comms: Communicators, models: Mapping[Role, Model[JointTables]], steps: Steps
    ) -> ModeTable | None:
        """Return the natural modes of a single undivided model if the input requests them, otherwise None."""
        if not self.request.shock.modes:
            return None
        with ACTIVITY.busy("finds natural modes"):
            modes = agreed(comms.world, lambda: _modes_of(self.request) if comms.world.rank == 0 else None)
        table: ModeTable = comms.world.bcast(modes)
        return table


def run_package(world: MPI.Comm, request: RunInput) -> None:
    """Run one shock of a package on a board and write its results; collective over ``world``.

    Args:
        world: Communicator of all ranks.
        request: Input with meshes, materials, shock and output folder.

    Raises:
        AgreedError: The input or a mesh does not fit; on every rank.
        RankError: The number of ranks does not suit the problem; on every rank.
        EnergyError: The energy balance is violated; on every rank.
    """
    run_dynamics(world, PackageDrop.read(world, request))


def _modes_of(request: RunInput) -> ModeTable:
    """Compute and write the natural modes of board and package, with coarse joints if a mesh of them exists.

    The model is linear elastic, undivided, and its supports are at rest.

    Raises:
        ValueError: More modes are requested than there are equations.
    """
    model, mass = build_elastic_package(request)
    modes = natural_modes(Equations.of(MPI.COMM_SELF, model.body), request.shock.modes)
    table = ModeTable(modes.frequency, modes.effective_mass / mass)
    write_modes(request.output, table)
    return table


def _pulse_of(request: RunInput, window: float) -> Pulse:
    """Return the pulse of a run with the given window [s]; raises as ``shock_pulse`` and ``check_pulses``."""
    pulse = shock_pulse(request.shock).pulse
    if request.coupled:
        check_pulses(pulse_durations({"drop": pulse}), window, request.numerics.step_fraction)
    return pulse
