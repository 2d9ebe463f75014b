"""What a drop calls for, from dimensionless numbers: thresholds and estimates, for ``plan`` and the run itself."""

import math
from typing import Any, Literal

NEGLIGIBLE_WEIGHT = 1e-3  # of the peak acceleration: weight below it is left out
# A strip between ends that do not approach each other: w deflects it against k w (1 + 3 (w / t)^2), since its tension
# E A / (4 L^2) (pi w)^2 adds N (pi / L)^2 to the bending stiffness (Woinowsky-Krieger, J. Appl. Mech. 17, 1950).
STIFFENING_BOUND = 3.0
# The same of boards held at four holes, whose edges draw in: from runs 0.11 (cases/jedec_board, 5.0 instead of 7.7
# thicknesses), 0.35 (bare board of cases/bga_drop, 4.8 instead of 10.9) and 0.73 (the same at 150 G, 0.95 instead of
# 1.09), so that what it predicts is right within a factor of two.
STIFFENING_OF_BOARD = 0.35
NEGLIGIBLE_STIFFENING = 1e-2  # of the deflection, by the bound
ADDED_MASS_LIMIT = 0.05  # of the mass of the model, by mass scaling
Switch = Literal["auto", "on", "off"]
Effect = dict[str, Any]


def effect(on: bool, why: str, influence: float | None = None) -> Effect:
    """Return an effect as plans and results tell it.

    Args:
        on: Whether it acts.
        why: And the reason.
        influence: How much of the answer it is expected to change, or would; None where nothing predicts it.
    """
    return {"on": bool(on), "why": why} | ({} if influence is None else {"influence": float(influence)})


def weight(switch: Switch, peak: float, gravity: float) -> Effect:
    """Decide whether weight acts beside a shock of a peak acceleration [m/s^2]: everything is linear in their sum."""
    ratio = gravity / peak if peak > 0.0 else math.inf
    reason = f"1 G is {ratio:.3g} of the peak acceleration"
    if switch != "auto":
        return effect(switch == "on", f"shock.gravity = {switch}; {reason}", min(ratio, 1.0))
    on = ratio >= NEGLIGIBLE_WEIGHT
    return effect(on, f"{reason}, {'at least' if on else 'below'} {NEGLIGIBLE_WEIGHT:g}", min(ratio, 1.0))


def stiffened(ratio: float, coefficient: float) -> float:
    """Return by how much of itself a deflection shrinks when stretching is counted.

    The energy that a shock brings bends a linear plate by w0, and one that stiffens by w:
    w0^2 = w^2 + c w^4 / (2 t^2).

    Args:
        ratio: w0 / t, linear deflection over thickness.
        coefficient: c.
    """
    if ratio == 0.0:
        return 0.0
    share = 0.5 * coefficient * ratio**2
    return 1.0 - math.sqrt(2.0 / (1.0 + math.sqrt(1.0 + 4.0 * share)))


def called_for(ratio: float) -> tuple[Literal["small", "finite"], str]:
    """Decide kinematics from a board's deflection over its thickness, and say why."""
    bound = stiffened(ratio, STIFFENING_BOUND)
    finite = bound > NEGLIGIBLE_STIFFENING
    relation = f"{'>' if finite else '<='} {100.0 * NEGLIGIBLE_STIFFENING:g} %"
    return (
        "finite" if finite else "small",
        f"stretching changes deflections by up to {100.0 * bound:.3g} % ({relation})",
    )


def damping(coefficients: tuple[float, float], omega: float, duration: float) -> Effect:
    """Tell what Rayleigh damping takes from the first mode of a board.

    Args:
        coefficients: alpha [1/s], beta [s].
        omega: angular frequency of the mode [rad/s].
        duration: of the shock [s].
    """
    alpha, beta = coefficients
    if not any(coefficients):
        return effect(False, "shock.damping gives none", 0.0)
    ratio = 0.5 * (alpha / omega + beta * omega)
    taken = -math.expm1(-ratio * omega * duration)
    return effect(True, f"{100.0 * ratio:.3g} % of critical damping in the board's first mode", taken)
