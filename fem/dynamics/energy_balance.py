"""Energy balance and force residuals of a run, checked at every sample.

For a linear model the balance is exact at any step: the kinetic energy is v(t - dt/2) . M v(t + dt/2) / 2, and the work
of a force over a step is the mean of its values at both ends times the displacement. Any imbalance is an error. An
unstable run keeps this balance, too; instability shows where dt^2 f . M^-1 f / 8 exceeds the strain energy, or where
damping dissipates more energy than was put in.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.errors import EnergyError
from reflowshock.fem.mesh.tie import net_load

ENERGIES = ("kinetic", "internal", "plastic", "hourglass", "damping", "external", "interface")
SUMS = len(ENERGIES) + 1 + 16
JUDGED = 1e-6  # fraction of the largest energy below which a step energy is round-off
ROUND_OFF = 1e-10  # fraction of the energy stored at time zero below which nothing moves
OVERDRAWN = 1.01  # dissipated over supplied energy; a stable damped step cannot exceed it
EXPLANATION = "the time step is probably too large for this mesh and material, or a load acts on an unsupported part"

INTERFACE = (
    "the coupling interface accounts for most of the imbalance; try a smaller numerics.step_fraction or finer macro"
    " elements at the interface"
)


def energy_sums(participant: Participant, sign: float) -> NDArray[np.float64]:
    """Return this rank's contribution to the energy balance.

    Args:
        participant: The model on this rank.
        sign: +1 for the macro model, -1 for the meso model, 0 without an interface.

    Returns:
        Array of shape (24,): the energies of ``ENERGIES`` [J], where internal is elastic strain energy and interface
        the work done by the macro model minus the work received by the meso model; the step energy
        (``ExplicitMotion.step_energy``); net force [N], net moment [N m] and both scales of the coupling interface
        (meso minus macro); the same eight values for the tie.
    """
    motion = participant.motion
    with np.errstate(over="ignore", invalid="ignore"):  # EnergyBalance.judge reports values that are not finite
        internal = motion.internal_energy()
        energies = [
            motion.kinetic_energy(),
            internal.strain,
            internal.plastic,
            internal.hourglass,
            motion.damping_energy,
            motion.external_work,
            sign * participant.interface_work,
            motion.step_energy(participant.foreign_force()),
        ]
    body = motion.body
    nodes = body.interface[body.interface >= 0]
    nodes = nodes[body.shared.owned[nodes]]
    points, interface = body.local.points[nodes], participant.interface_force()[nodes]
    interface_load = -sign * net_load(points, interface)
    interface_scale = 0.5 * abs(sign) * _load_scale(points, interface)
    tie_load, tie_scale = _tie_residual(participant)
    return np.concatenate([energies, interface_load, interface_scale, tie_load, tie_scale])


def _load_scale(points: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sums of absolute forces [N] and of absolute moments about the origin [N m], shape (2,)."""
    return np.array([np.abs(force).sum(), np.abs(np.cross(points, force)).sum()])


def _tie_residual(participant: Participant) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the net force and moment lost between slaves and masters, shape (6,), and their scales, shape (2,)."""
    motion = participant.motion
    tie, points = motion.body.tie, motion.body.local.points
    slave_load = points[tie.slave], motion.slave_force
    force = np.zeros_like(motion.force)
    force[tie.slave] = motion.slave_force
    tie.gather(force)
    masters = np.unique(tie.master)
    return net_load(*slave_load) - net_load(points[masters], force[masters]), _load_scale(*slave_load)


@dataclass(slots=True)
class EnergyBalance:
    """Energy balance over all ranks, with its largest error so far.

    Attributes:
        limit: Allowed |balance| as a fraction of the largest energy so far.
        trivial: Energy below which the balance is not checked [J].
        step: Time step dt [s], for messages.
        critical: Estimated critical step [s], for messages.
        largest: Largest energy so far [J].
        balance_error: Largest |balance| over largest energy so far.
        force_residual: Largest relative force or moment residual so far.
        initial: Total energy at time zero [J].
        stored: Element energies at time zero by name [J], subtracted when the largest energy is determined.
        latest: Energies of the previous sample by name [J].
    """

    limit: float
    trivial: float
    step: float = np.nan
    critical: float = np.nan
    largest: float = 0.0
    balance_error: float = 0.0
    force_residual: float = 0.0
    initial: float = 0.0
    stored: dict[str, float] = field(default_factory=dict)
    latest: dict[str, float] = field(default_factory=dict)

    def judge(self, sums: NDArray[np.float64], time: float) -> dict[str, float]:
        """Check the sums of one sample.

        Args:
            sums: Result of ``energy_sums``, added up over all ranks.
            time: Time of the sample [s].

        Returns:
            Energies by the names of ``ENERGIES``, and ``balance``: stored plus dissipated minus initial minus external
            energy [J].

        Raises:
            EnergyError: An energy is not finite, the step is unstable, or the balance exceeds the limit.
        """
        energies = dict(zip(ENERGIES, sums.tolist(), strict=False))
        present = sum(energies[name] for name in ENERGIES[:5]) - energies["external"]
        if not np.isfinite(present) or not np.isfinite(energies["interface"]):
            raise EnergyError(f"energies are not finite {self._when(time)}: {self._cause(energies)}")
        if time == 0.0:
            self.initial, self.stored = present, {name: energies[name] for name in ("internal", "hourglass")}
            self.trivial = max(self.trivial, ROUND_OFF * sum(abs(energy) for energy in self.stored.values()))
        balance = present - self.initial
        self.largest = max(self.largest, *(abs(energies[name] - self.stored.get(name, 0.0)) for name in ENERGIES[:6]))
        self._judge_step(energies, float(sums[len(ENERGIES)]), time)
        if self.largest > self.trivial:
            self.balance_error = max(self.balance_error, abs(balance) / self.largest)
        if self.balance_error > self.limit:
            raise EnergyError(
                f"energy balance {balance:.3e} J {self._when(time)} is {100.0 * self.balance_error:.3g} % of the"
                f" largest energy {self.largest:.3e} J; allowed: {100.0 * self.limit:.3g} %"
                f" (numerics.energy_balance_limit): {self._cause(energies)}"
            )
        self._judge_forces(sums[len(ENERGIES) + 1 :])
        self.latest = energies
        return energies | {"balance": balance}

    def _judge_step(self, energies: dict[str, float], step_energy: float, time: float) -> None:
        """Raise ``EnergyError`` if dissipated or step energy shows that the time step is unstable."""
        strain = energies["internal"] + energies["hourglass"]
        if self.largest <= self.trivial:
            return
        supplied = energies["external"] + self.initial
        if energies["damping"] > OVERDRAWN * max(supplied, 0.0) + JUDGED * self.largest:
            raise EnergyError(
                f"the time step is not stable {self._when(time)}: damping has dissipated {energies['damping']:.3e} J,"
                f" more than the supplied {supplied:.3e} J; {self._cause(energies)}"
            )
        if step_energy > strain and step_energy > JUDGED * self.largest:
            ratio = np.sqrt(step_energy / strain) if strain > 0.0 else np.inf
            raise EnergyError(
                f"the time step is not stable {self._when(time)}: the excited modes need a step {ratio:.3g} times"
                f" smaller; {self._cause(energies)}"
            )

    def _judge_forces(self, loads: NDArray[np.float64]) -> None:
        """Update the force residual from net loads (6,) and scales (2,) of the interface and of the tie."""
        for load in (loads[:8], loads[8:]):
            scale = np.repeat(load[6:8], 3)
            ratio = np.divide(np.abs(load[:6]), scale, out=np.zeros(6), where=scale > 0.0)
            self.force_residual = max(self.force_residual, float(ratio.max()))

    def _lost_at_interface(self, energies: dict[str, float]) -> bool:
        """Return whether the difference of both models' interface works explains most of the imbalance."""
        present = sum(energies[name] for name in ENERGIES[:5]) - energies["external"]
        return abs(present - self.initial + energies["interface"]) < 0.5 * abs(energies["interface"])

    def _when(self, time: float) -> str:
        """Return time and step of a sample as text."""
        return f"at time {time:.6e} s (step {time / self.step:.0f})" if self.step > 0.0 else f"at time {time:.6e} s"

    def _cause(self, energies: dict[str, float]) -> str:
        """Return a sentence with the fastest-growing energy, the steps and the probable cause."""
        growth = {name: abs(energies[name] - self.latest.get(name, 0.0)) for name in ENERGIES[:6]}
        fastest = max(growth, key=lambda name: np.nan_to_num(growth[name], nan=np.inf))
        steps = f"; step {self.step:.3e} s, estimated critical step {self.critical:.3e} s" if self.step > 0.0 else ""
        explanation = INTERFACE if self._lost_at_interface(energies) else EXPLANATION
        change = f"{self.latest.get(fastest, 0.0):.3e} J to {energies[fastest]:.3e} J since the previous sample"
        return f"the {fastest} energy went from {change}{steps}; {explanation}"
