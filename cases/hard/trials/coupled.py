"""Two coupled models on one rank with any scheme, by the program's own operators, division and checks."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol, cast

import numpy as np
from mpi4py import MPI

from reflowshock.fem.coupling.gravouil_combescure import GravouilCombescure
from reflowshock.fem.coupling.held_velocity import ForceReceiver
from reflowshock.fem.coupling.impulse import Impulse
from reflowshock.fem.coupling.scheme import Scheme
from reflowshock.fem.division.checks import check_division
from reflowshock.fem.division.divide import divide
from reflowshock.fem.division.division import Division, Rules
from reflowshock.fem.division.tables import ModelInput, Tables, join_meshes, model_inputs
from reflowshock.fem.division.whole import Survey, Treatment, Whole, survey
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.energy_balance import ENERGIES, energy_sums
from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.estimates.estimate import WindowPlan
from reflowshock.fem.loads.load import Load
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.tie import net_load
from reflowshock.fem.model.assembly import ForceOptions, RankElements, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.communicators import Role
from reflowshock.fem.parallel.exchange import InterfaceChannels
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.parameters import Material
from reflowshock.materials.roles import ELASTIC, Materials, role_of_part

Divide = Callable[[Whole, Survey, Rules], Division]
DEFAULTS, HELD = ELASTIC, Coupling(scheme="held_velocity", levels=1)
DURATION = 1e-2  # [s] long enough for any number of windows


def surveyed(
    mesh: MeshData,
    materials: Materials | dict[str, Material] = DEFAULTS,
    fraction: float = 0.9,
    coupling: Coupling = HELD,
) -> tuple[Whole, Survey, Rules]:
    """Return a mesh, its survey, and division rules with coarse boards."""
    whole = join_meshes(mesh)
    coarse = whole.mesh.in_parts(lambda name: role_of_part(name) == "board")
    rules = Rules(coupling, coarse, fraction, 0.0, DURATION, 1, pushed=False)
    return whole, survey(whole.mesh, materials, Treatment()), rules


def checked(whole: Whole, survey_of_mesh: Survey, rules: Rules) -> Division:
    """Divide as the program does, with its checks."""
    division = divide(whole, survey_of_mesh, rules)
    check_division(whole, survey_of_mesh, division, rules)
    return division


MANY = 1e5  # weight of each element in cost estimates, so that step levels pay off


class Models(NamedTuple):
    """Elements and tables of each divided model."""

    parts: dict[Role, tuple[RankElements, Tables]]
    division: Division

    def bodies(self) -> dict[Role, Body]:
        """Return new bodies of both models on this rank, since terms may have a path."""
        step = self.division.meso_step
        return {
            role: make_body(MPI.COMM_SELF, *part, np.ones(len(part[0].steps)), ForceOptions(step=step))
            for role, part in self.parts.items()
        }


def models_of(
    mesh: MeshData, materials: Materials, coupling: Coupling, fraction: float, division: Divide = checked
) -> Models:
    """Divide a mesh by the program's rules or another function."""
    whole, survey_of_mesh, rules = surveyed(mesh, materials, fraction, coupling)
    divided = division(whole, replace(survey_of_mesh, cost=MANY * survey_of_mesh.cost), rules)
    inputs = model_inputs(whole, divided)
    return Models({role: rank_elements_of(item, materials) for role, item in inputs.items()}, divided)


def rank_elements_of(item: ModelInput, materials: Materials) -> tuple[RankElements, Tables]:
    """Return the elements and tables of one model on this rank."""
    return make_rank_elements(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials), item.tables


class Turn(Participant, Protocol):
    """Participant that moves by central differences."""

    @property
    def motion(self) -> ExplicitMotion:
        """Motion of the participant."""


class Coupled:
    """Macro and meso model on one rank, advanced in turns, with the window as a matrix."""

    def __init__(
        self, bodies: Mapping[Role, Body], plan: WindowPlan, scheme: Scheme, loads: Sequence[Load] = ()
    ) -> None:
        """Create both participants of a scheme, as on a rank with both models."""
        self.plan, self._scheme = plan, scheme
        channels = InterfaceChannels.open(
            MPI.COMM_SELF, bodies["macro"].interface, bodies["meso"].interface, receiver_waits=False
        )
        self._channels = channels
        make = {"macro": scheme.macro, "meso": scheme.meso}
        made = {role: make[role](bodies[role], list(loads), plan, channels) for role in scheme.order}
        self.macro, self.meso = cast(Turn, made["macro"]), cast(Turn, made["meso"])
        self.parts = (self.macro, self.meso)
        self._linked = isinstance(scheme, GravouilCombescure)
        self._free = [part.motion.mobility > 0.0 for part in self.parts]
        self._impedance = float(bodies["macro"].mass.mean()) / plan.window  # scale of the link's impulse

    def run(self) -> None:
        """Advance by one window."""
        for part in self.parts:
            part.begin_window()
        for part in self.parts:
            part.finish_window()

    def swing(self, speed: np.ndarray) -> None:
        """Start with a smooth velocity (3,) [m/s] that changes its sign once across both models."""
        low, high = (getattr(self.macro.motion.body.local.points[:, 0], end)() for end in ("min", "max"))
        for part in self.parts:
            motion = part.motion
            wave = np.cos(np.pi * (motion.body.local.points[:, 0] - low) / (high - low))
            motion.velocity[:] = np.where(motion.mobility > 0.0, np.outer(wave, speed), 0.0)

    def energies(self) -> dict[str, float]:
        """Return the energies of both models."""
        return dict(zip(ENERGIES, self.sums().tolist(), strict=False))

    def drift(self, windows: int, samples: int, look: Callable[[], None] = lambda: None) -> tuple[float, float]:
        """Run; return the drift of kinetic plus internal energy and the largest interface energy over the initial one.

        The energy oscillates with the interface energy; the drift compares its means over the first and last tenth of
        the run.
        ``look`` is called at each sample.
        """
        first, energies = self.held(), []
        for _ in range(samples):
            for _ in range(windows // samples):
                self.run()
            energies.append((self.held(), abs(self.energies()["interface"])))
            look()
        energy, interface = np.array(energies).T / first
        tenth = samples // 10
        return abs(float(energy[-tenth:].mean() - energy[:tenth].mean())), float(interface.max())

    def held(self) -> float:
        """Return kinetic plus internal energy."""
        energies = self.energies()
        return energies["kinetic"] + energies["internal"]

    def sums(self) -> np.ndarray:
        """Return the sums of both models."""
        return energy_sums(self.macro, 1.0) + energy_sums(self.meso, -1.0)

    def momentum(self) -> np.ndarray:
        """Return linear and angular momentum (6,)."""
        total = np.zeros(6)
        for part in self.parts:
            motion = part.motion
            velocity = np.where(motion.mobility > 0.0, motion.present_velocity(), 0.0)
            total += net_load(motion.body.local.points, motion.counted_mass[:, None] * velocity)
        return total

    @property
    def size(self) -> int:
        """Return the number of values of a state."""
        interface = 3 * len(self.macro.motion.body.interface) if self._linked else 0
        return 2 * sum(int(free.sum()) for free in self._free) + interface

    def apply(self, state: np.ndarray) -> np.ndarray:
        """Return the state after one window: displacements, velocities times DT, scaled link."""
        counts = [int(free.sum()) for free in self._free]
        values = np.split(state, np.cumsum(counts + counts))
        for part, free, displacement, speed in zip(self.parts, self._free, values[:2], values[2:4], strict=True):
            part.motion.displacement[:], part.motion.velocity[:] = 0.0, 0.0
            part.motion.displacement[free] = displacement
            part.motion.velocity[free] = speed / self.plan.window
        self._complete(values[4].reshape(-1, 3) * self._impedance / self.plan.window)
        self.run()
        moved = [part.motion.displacement[free] for part, free in zip(self.parts, self._free, strict=True)]
        moved += [
            self.plan.window * part.motion.velocity[free] for part, free in zip(self.parts, self._free, strict=True)
        ]
        if self._linked:
            link = self.meso.foreign_force()[self.meso.motion.body.interface]
            moved.append(link.ravel() * self.plan.window / self._impedance)
        return np.concatenate(moved)

    def complete(self) -> None:
        """Update all dependent quantities after displacements and velocities were set, without a link."""
        self._complete(np.zeros((len(self.meso.motion.body.interface), 3)))

    def _complete(self, link: np.ndarray) -> None:
        """Update slaves, the held interface and forces from displacements and link."""
        macro, meso = self.macro.motion, self.meso.motion
        pushed = isinstance(self._scheme, Impulse)
        if pushed:
            macro.displacement[macro.body.interface] = meso.displacement[meso.body.interface]
        elif not self._linked:
            meso.displacement[meso.body.interface] = macro.displacement[macro.body.interface]
        for part in self.parts:
            part.motion.body.tie.spread(part.motion.displacement)
            part.motion.update_force()
        if self._linked:
            self.meso.foreign_force()[meso.body.interface] = link
            meso.force += self.meso.foreign_force()
            self.macro.foreign_force()[macro.body.interface] = -link
        elif pushed:
            self.meso.interface_force()[meso.body.interface] = macro.force[macro.body.interface]
            meso.force += self.meso.foreign_force()
        elif isinstance(self.macro, ForceReceiver):
            self._channels.forces.send(meso.force)
            work = self.macro.interface_work
            self.macro.take_force()
            self.macro.interface_work = work  # discard the work of the trial window
            return
        macro.force += self.macro.foreign_force()

    def matrix(self) -> np.ndarray:
        """Return the amplification matrix of a window."""
        return np.column_stack([self.apply(unit) for unit in np.eye(self.size)])

    def spectral_radius(self) -> float:
        """Return the largest magnitude of an eigenvalue of the amplification matrix; above 1 the window grows."""
        return float(np.abs(np.linalg.eigvals(self.matrix())).max())
