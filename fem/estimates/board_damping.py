"""Damping of a board in a drop: given by the case, else estimated from the first natural frequency."""

import math

from reflowshock.effect import Decision, decision
from reflowshock.fem.estimates.drop_effect import Drop, DropEffect, DropRun
from reflowshock.fem.problem.shock import BoardDamping

# Transmissibility Q of circuit boards in vibration, Q = sqrt(f1 in Hz): Steinberg, Vibration Analysis for Electronic
# Equipment, 3rd edition, 2000, eq. 9.52. Q from sqrt(f1) to 2 sqrt(f1) is in use, and Q falls with the level.
SOURCE = "Steinberg 2000, eq. 9.52"


def estimated_ratio(frequency: float) -> float:
    """Estimate the ratio of critical damping 1 / (2 Q) of a board's first mode, Q = sqrt(f1 / Hz) the quality factor.

    Intended for circuit boards that respond in one bending mode; limited to less than one, which it reaches at 1/4 Hz.

    Args:
        frequency: Natural frequency f1 of the first mode [Hz].
    """
    return min(0.5 / math.sqrt(frequency), 1.0 - 1e-6)


def with_estimate(damping: BoardDamping, frequency: float) -> BoardDamping:
    """Return the damping of a board, estimated from its first natural frequency unless the case gives damping.

    Args:
        damping: Damping of the case; it is returned unchanged if it has coefficients or ratios or switches the estimate
            off.
        frequency: First natural frequency of the board [Hz].

    Returns:
        Damping proportional to the mass, with the ratio of ``estimated_ratio`` at this frequency.
    """
    if damping.estimate == "off" or damping.is_given:
        return damping
    return BoardDamping(mass_ratio=estimated_ratio(frequency), frequency=frequency)


class BoardDampingEffect(DropEffect):
    """Rayleigh damping, as the case gives it or as estimated for circuit boards."""

    name = "damping"
    adds = "f = -(alpha M + beta K) v, v relative to the table"
    number = "xi = 1 / (2 sqrt(f1 / Hz)), alpha = 2 xi omega1; given: xi = (alpha / omega1 + beta omega1) / 2"
    influence = "1 - exp(-xi omega1 T) of the first mode"
    implementation = "reflowshock.fem.loads.damping.RayleighDamping"
    switch = "shock.damping.estimate = auto, on, off; shock.damping.* of a case"
    source = SOURCE

    def decide(self, drop: Drop) -> Decision:
        """Decide by the case, with the damping of the first mode of the board as influence."""
        setting, frequency = drop.shock.damping, drop.frequency
        damping, omega = with_estimate(setting, frequency), math.tau * frequency
        alpha, beta = damping.coefficients
        if not (alpha or beta):
            return decision(False, f"shock.damping.estimate = {setting.estimate}, and no damping is given", 0.0, 0.0)
        ratio = 0.5 * (alpha / omega + beta * omega)
        share = f"{100.0 * ratio:.3g} % of critical damping in the board's first mode, {frequency:.4g} Hz"
        if setting.is_given:
            why = f"given by shock.damping: {share}"
        else:
            why = f"shock.damping.estimate = {setting.estimate}: {_estimate(damping)}"
        return decision(True, why, -math.expm1(-ratio * omega * drop.duration), ratio)

    def report(self, run: DropRun) -> Decision:
        """Return the estimate, or the coefficients of the case."""
        damping = run.shock.damping
        alpha, beta = damping.coefficients
        given = f"Rayleigh damping, alpha = {alpha:.4g} 1/s, beta = {beta:.4g} s"
        is_estimate = damping.frequency is not None and damping.mass_ratio == estimated_ratio(damping.frequency)
        return decision(bool(alpha or beta), _estimate(damping) if is_estimate else given)


def _estimate(damping: BoardDamping) -> str:
    """Return the estimate in words, with its source and the scatter of published values."""
    ratio, quality = damping.mass_ratio, 0.5 / damping.mass_ratio
    return (
        f"estimate without data, Q = sqrt(f1 / Hz) = {quality:.3g} at about {damping.frequency:.3g} Hz ({SOURCE}):"
        f" {100.0 * ratio:.3g} % of critical damping in the board's first mode, less in higher ones; published Q up to"
        f" 2 sqrt(f1) give {50.0 * ratio:.3g} %"
    )
