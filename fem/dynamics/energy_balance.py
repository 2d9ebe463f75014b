"""Energies and force residuals at a sample: what the ranks of all models add up, and what must hold.

For a linear model the balance is exact at any step: the kinetic energy is v(t - dt/2) . M v(t + dt/2) / 2, and the work
of a force over a step is the mean of its values at both ends times the displacement. Any imbalance is an error. An
unstable run keeps this balance, too; it shows where dt^2 f . M^-1 f / 8 exceeds the strain energy, or where damping
takes more than was given.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.participant import Participant
from reflowshock.fem.errors import EnergyError
from reflowshock.fem.mesh.tie import net_load

ENERGIES = ("kinetic", "internal", "plastic", "hourglass", "damping", "external", "interface")
SUMS = len(ENERGIES) + 1 + 16
JUDGED = 1e-6  # of the largest energy: a step energy below it is round-off
ROUND_OFF = 1e-10  # of the energy stored at time zero: less than that is no motion
OVERDRAWN = 1.01  # energy taken by damping over energy given: more is possible only above the damped critical step
EXPLANATION = "most likely the time step is too large for this mesh and material, or a load acts on what nothing holds"

INTERFACE = (
    "the coupling of both models holds most of what is missing: a smaller numerics.step_fraction or finer macro"
    " elements resolve what crosses the interface"
)


def energy_sums(participant: Participant, sign: float) -> NDArray[np.float64]:
    """Return this rank's part of the energy balance: ``(24,)``.

    The energies of ``ENERGIES`` [J], where internal is elastic strain energy and interface the work put in by the macro
    model minus that received by the meso model; the step energy (``ExplicitMotion.step_energy``); net force and moment
    of the coupling interface, meso minus macro, and their scales; the same of the tie.

    Args:
        participant: The model on this rank.
        sign: +1 for the macro model, -1 for the meso model, 0 without an interface.
    """
    motion = participant.motion
    with np.errstate(over="ignore", invalid="ignore"):  # the judge reports what is not finite
        held = motion.internal_energy()
        energies = [
            motion.kinetic_energy(),
            held.strain,
            held.plastic,
            held.hourglass,
            motion.damping_energy,
            motion.external_work,
            sign * participant.interface_work,
            motion.step_energy(participant.foreign_force()),
        ]
    body = motion.body
    here = body.interface[body.interface >= 0]
    here = here[body.shared.owned[here]]
    points, interface = body.local.points[here], participant.interface_force()[here]
    interface_load = -sign * net_load(points, interface)
    interface_scale = 0.5 * abs(sign) * load_scale(points, interface)
    tie_load, tie_scale = tie_residual(participant)
    return np.concatenate([energies, interface_load, interface_scale, tie_load, tie_scale])


def load_scale(points: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sums of the magnitudes of forces [N] and of moments about the origin [N m]: ``(2,)``."""
    return np.array([np.abs(force).sum(), np.abs(np.cross(points, force)).sum()])


def tie_residual(participant: Participant) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return net force and moment ``(6,)`` of the slaves minus those that arrive at their masters, and the scales."""
    motion = participant.motion
    tie, points = motion.body.tie, motion.body.local.points
    given = points[tie.slave], motion.slave_force
    force = np.zeros_like(motion.force)
    force[tie.slave] = motion.slave_force
    tie.gather(force)
    masters = np.unique(tie.master)
    return net_load(*given) - net_load(points[masters], force[masters]), load_scale(*given)


@dataclass(slots=True)
class EnergyBalance:
    """Judges the sums of all ranks at each sample.

    Attributes:
        limit: Allowed |balance| as a fraction of the largest energy so far.
        trivial: Energy [J] below which a balance has no meaning.
        step: dt [s], and ``critical`` the estimated critical step [s], for messages.
        largest: Largest energy so far [J].
        balance_error: Largest |balance| / largest energy seen.
        force_residual: Largest relative force or moment residual seen.
        initial: Energy at time zero [J].
        stored: Energies of the elements at time zero [J], from which those of the motion count.
        latest: Energies of the sample before.
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
        """Check a sample of ``energy_sums`` added up over all ranks.

        Returns:
            ``ENERGIES`` and the balance [J]: all energy that is there or was taken, minus the initial and the external.

        Raises:
            EnergyError: An energy is no number, the step is above the critical one, or the balance exceeds the limit.
        """
        found = dict(zip(ENERGIES, sums.tolist(), strict=False))
        present = sum(found[name] for name in ENERGIES[:5]) - found["external"]
        if not np.isfinite(present) or not np.isfinite(found["interface"]):
            raise EnergyError(f"energies are not numbers {self._when(time)}: {self._cause(found)}")
        if time == 0.0:
            self.initial, self.stored = present, {name: found[name] for name in ("internal", "hourglass")}
            self.trivial = max(self.trivial, ROUND_OFF * sum(abs(energy) for energy in self.stored.values()))
        balance = present - self.initial
        self.largest = max(self.largest, *(abs(found[name] - self.stored.get(name, 0.0)) for name in ENERGIES[:6]))
        self._judge_step(found, float(sums[len(ENERGIES)]), time)
        if self.largest > self.trivial:
            self.balance_error = max(self.balance_error, abs(balance) / self.largest)
        if self.balance_error > self.limit:
            raise EnergyError(
                f"energy balance {balance:.3e} J {self._when(time)} is {100.0 * self.balance_error:.3g} % of the"
                f" largest energy {self.largest:.3e} J, allowed are {100.0 * self.limit:.3g} %"
                f" (numerics.energy_balance_limit): {self._cause(found)}"
            )
        self._judge_forces(sums[len(ENERGIES) + 1 :])
        self.latest = found
        return found | {"balance": balance}

    def _judge_step(self, found: dict[str, float], step_energy: float, time: float) -> None:
        """Refuse a motion whose step energy shows that the step is above the critical one of modes that move."""
        strain = found["internal"] + found["hourglass"]
        if self.largest <= self.trivial:
            return
        given = found["external"] + self.initial
        if found["damping"] > OVERDRAWN * max(given, 0.0) + JUDGED * self.largest:
            raise EnergyError(
                f"the time step is not stable {self._when(time)}: damping has taken {found['damping']:.3e} J, more than"
                f" was given, {given:.3e} J; {self._cause(found)}"
            )
        if step_energy > strain and step_energy > JUDGED * self.largest:
            raise EnergyError(
                f"the time step is not stable {self._when(time)}: modes that move need a step"
                f" {np.sqrt(step_energy / strain) if strain > 0.0 else np.inf:.3g} times smaller; {self._cause(found)}"
            )

    def _judge_forces(self, loads: NDArray[np.float64]) -> None:
        """Note the residuals of interface and tie: two times net force, moment ``(6,)`` and scales ``(2,)``."""
        for load in (loads[:8], loads[8:]):
            scale = np.repeat(load[6:8], 3)
            ratio = np.divide(np.abs(load[:6]), scale, out=np.zeros(6), where=scale > 0.0)
            self.force_residual = max(self.force_residual, float(ratio.max()))

    def _taken_by_interface(self, found: dict[str, float]) -> bool:
        """Return whether most of what is missing is the difference of both models' works across the interface."""
        present = sum(found[name] for name in ENERGIES[:5]) - found["external"]
        return abs(present - self.initial + found["interface"]) < 0.5 * abs(found["interface"])

    def _when(self, time: float) -> str:
        """Return time and step of a sample in words."""
        return f"at time {time:.6e} s (step {time / self.step:.0f})" if self.step > 0.0 else f"at time {time:.6e} s"

    def _cause(self, found: dict[str, float]) -> str:
        """Return in words what grew since the sample before, the steps, and what that hints at."""
        growth = {name: abs(found[name] - self.latest.get(name, 0.0)) for name in ENERGIES[:6]}
        fastest = max(growth, key=lambda name: np.nan_to_num(growth[name], nan=np.inf))
        steps = f"; step {self.step:.3e} s, estimated critical step {self.critical:.3e} s" if self.step > 0.0 else ""
        explanation = INTERFACE if self._taken_by_interface(found) else EXPLANATION
        now = f"{self.latest.get(fastest, 0.0):.3e} J to {found[fastest]:.3e} J since the sample before"
        return f"the {fastest} energy went from {now}{steps}; {explanation}"
