"""Energies and force residuals at a sample: what the ranks of all models add up, and what must hold."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem.errors import EnergyError
from fem.participant import Participant
from fem.tie import net_load

ENERGIES = ("kinetic", "internal", "external", "interface", "balance")


def ledger_sums(participant: Participant, sign: float) -> NDArray[np.float64]:
    """Return this rank's part of the ledger: ``(20,)``.

    Kinetic, internal, external energy, interface work (put in by the macro model minus received by the meso model) [J];
    net force and moment of the cut, meso minus macro, and their scales; the same of the tie.

    Args:
        participant: The model on this rank.
        sign: +1 for the macro model, -1 for the meso model, 0 without a cut.
    """
    motion = participant.motion
    energies = [
        motion.kinetic_energy(),
        motion.strain_energy(participant.foreign_force()),
        motion.external_work,
        sign * participant.interface_work,
    ]
    points, owned = motion.body.local.points, motion.body.shared.owned
    cut = participant.cut_force()[owned]
    cut_load = -sign * net_load(points[owned], cut)
    cut_scale = 0.5 * abs(sign) * load_scale(points[owned], cut)
    tie_load, tie_scale = tie_residual(participant)
    return np.concatenate([energies, cut_load, cut_scale, tie_load, tie_scale])


def load_scale(points: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sums of the magnitudes of forces [N] and of moments about the origin [N m]: ``(2,)``."""
    return np.array([np.abs(force).sum(), np.abs(np.cross(points, force)).sum()])


def tie_residual(participant: Participant) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return net force and moment ``(6,)`` of the slaves minus those that arrive at their masters, and the scales."""
    body, motion = participant.motion.body, participant.motion
    force = np.zeros_like(motion.force)
    for term in body.terms:
        term.add(motion.displacement, force)
    slaves = np.zeros_like(force)
    slaves[body.tie.slave] = force[body.tie.slave]
    before, scale = net_load(body.local.points, slaves), load_scale(body.local.points, slaves)
    body.tie.gather(slaves)
    return before - net_load(body.local.points, slaves), scale


@dataclass(slots=True)
class Ledger:
    """Judges the sums of all ranks at each sample.

    Attributes:
        limit: Allowed |balance| as a fraction of the largest energy so far.
        trivial: Energy [J] below which a balance has no meaning.
        largest: Largest energy so far [J].
        balance_error: Largest |balance| / largest energy seen.
        force_residual: Largest relative force or moment residual seen.
    """

    limit: float
    trivial: float
    largest: float = 0.0
    balance_error: float = 0.0
    force_residual: float = 0.0

    def judge(self, sums: NDArray[np.float64], time: float) -> dict[str, float]:
        """Check a sample of ``ledger_sums`` added up over all ranks.

        Raises:
            EnergyError: An energy is not a number, or the balance exceeds the limit.
        """
        kinetic, internal, external, interface = (float(value) for value in sums[:4])
        balance = kinetic + internal - external
        largest = max(kinetic, internal, abs(external))
        if not np.isfinite(balance) or not np.isfinite(interface):
            raise EnergyError(f"energies are not numbers at time {time:.6e} s: the time step is not stable")
        self.largest = max(self.largest, largest)
        if self.largest > self.trivial:
            self.balance_error = max(self.balance_error, abs(balance) / self.largest)
        if self.balance_error > self.limit:
            raise EnergyError(
                f"energy balance {balance:.3e} J at time {time:.6e} s is {self.balance_error:.2%} of the largest energy"
                f" {self.largest:.3e} J, allowed are {self.limit:.2%} (shock.numerics.energy_balance_limit)"
            )
        for load in (sums[4:12], sums[12:20]):
            scale = np.repeat(load[6:8], 3)
            ratio = np.divide(np.abs(load[:6]), scale, out=np.zeros(6), where=scale > 0.0)
            self.force_residual = max(self.force_residual, float(ratio.max()))
        return dict(zip(ENERGIES, (kinetic, internal, external, interface, balance), strict=True))
