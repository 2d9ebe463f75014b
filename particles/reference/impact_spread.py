"""Correlations for the maximum spread of a drop impact, relative to the diameter of the drop.

Three correlations were fitted to measured drops, whose contact angle is dynamic: a spreading drop shows 110 to 130
degrees where the static angle is 90, because the liquid bends between molecular lengths, where the angle is static, and
the lengths that a camera or particles resolve (Voinov 1976, Cox 1986). Correlations without an angle include the angle
of their measured drops. The fourth was fitted to computed axisymmetric drops with a constant angle.
"""

from math import cos, sqrt

from scipy.optimize import brentq

# Range of validity: smallest Weber and Reynolds number, and largest Re / We^(5/2). Above it Roisman's spread,
# 0.87 Re^(1/5) - 0.40 Re^(2/5) / sqrt(We), falls with falling viscosity.
LEAST_WEBER, LEAST_REYNOLDS = 25.0, 100.0
MOST_REYNOLDS = (0.87 / (2.0 * 0.40)) ** 5
# Factor of the loss in the boundary layer (Wildeman et al. 2016).
LAYER_LOSS = 0.7


def pasandideh_fard(weber: float, reynolds: float, angle: float) -> float:
    """Return the maximum spread over the diameter by an energy balance (Pasandideh-Fard et al. 1996).

    The dissipation is that in a boundary layer of thickness 2 D / sqrt(Re).

    Args:
        weber: Weber number rho U^2 D / gamma.
        reynolds: Reynolds number rho U D / mu.
        angle: Measured advancing contact angle [rad].
    """
    return sqrt((weber + 12.0) / (3.0 * (1.0 - cos(angle)) + 4.0 * weber / sqrt(reynolds)))


def roisman(weber: float, reynolds: float) -> float:
    """Return the maximum spread over the diameter: viscous film minus a correction for the rim (Roisman 2009).

    Args:
        weber: Weber number rho U^2 D / gamma.
        reynolds: Reynolds number rho U D / mu.
    """
    return 0.87 * reynolds**0.2 - 0.40 * reynolds**0.4 / sqrt(weber)


def laan(weber: float, reynolds: float) -> float:
    """Return the maximum spread over the diameter, interpolated between capillary and viscous limit (Laan et al. 2014).

    Args:
        weber: Weber number rho U^2 D / gamma.
        reynolds: Reynolds number rho U D / mu.
    """
    impact = sqrt(weber * reynolds**-0.4)
    return reynolds**0.2 * impact / (1.24 + impact)


def wildeman(weber: float, reynolds: float, angle: float) -> float:
    """Return the maximum spread b over the diameter, fitted to volume-of-fluid computations (Wildeman et al. 2016).

    Energy balance with dissipation in the boundary layer and loss of half of the kinetic energy:
    3 (1 - cos(theta)) / We b^2 + 0.7 / sqrt(Re) b^2 sqrt(b - 1) = 12 / We + 1/2.

    Args:
        weber: Weber number rho U^2 D / gamma.
        reynolds: Reynolds number rho U D / mu.
        angle: Constant contact angle theta of the computation [rad].
    """

    def excess(width: float) -> float:
        surface = 3.0 * (1.0 - cos(angle)) / weber * width**2
        return surface + LAYER_LOSS / sqrt(reynolds) * width**2 * sqrt(width - 1.0) - 12.0 / weber - 0.5

    widest = 1.0 + ((12.0 / weber + 0.5) * sqrt(reynolds) / LAYER_LOSS) ** 0.4  # upper bound, without surface energy
    return float(brentq(excess, 1.0, widest))


def of_measured(weber: float, reynolds: float, angle: float) -> tuple[float, float] | None:
    """Return the range of maximum spread over the diameter that the correlations of measured impacts predict.

    Args:
        weber: Weber number rho U^2 D / gamma.
        reynolds: Reynolds number rho U D / mu.
        angle: Measured advancing contact angle [rad].

    Returns:
        Smallest and largest spread; None where the correlations are not valid.
    """
    if weber < LEAST_WEBER or not LEAST_REYNOLDS <= reynolds <= MOST_REYNOLDS * weber**2.5:
        return None
    spreads = pasandideh_fard(weber, reynolds, angle), roisman(weber, reynolds), laan(weber, reynolds)
    return min(spreads), max(spreads)
