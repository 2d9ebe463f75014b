"""Largest width of a drop that strikes a wall, over its diameter: correlations of measured drops, one of computed ones.

Three were fitted to measured drops. What is measured has a dynamic contact angle: while a drop spreads it is well above
the static one (110 to 130 degrees where that is 90), as Cox 1986 and Voinov 1976 derive: liquid bends between molecular
lengths, where the angle is the static one, and those that a camera, or particles, resolve. Correlations without an
angle hold those of their drops. The fourth was fitted to computed axisymmetric drops with a constant angle.
"""

from math import cos, sqrt

from scipy.optimize import brentq

# Weber and Reynolds number from which on all four are meant to hold; and up to which Reynolds number, over We^(5/2):
# beyond it Roisman's width, 0.87 Re^(1/5) - 0.40 Re^(2/5) / sqrt(We), falls as viscosity falls.
LEAST_WEBER, LEAST_REYNOLDS = 25.0, 100.0
MOST_REYNOLDS = (0.87 / (2.0 * 0.40)) ** 5
# Factor of the loss in the boundary layer (Wildeman et al. 2016).
LAYER_LOSS = 0.7


def pasandideh_fard(weber: float, reynolds: float, angle: float) -> float:
    """Energy of a disc after the loss in a layer of 2 D / sqrt(Re) (Pasandideh-Fard et al. 1996).

    Args:
        weber: rho U^2 D / gamma.
        reynolds: rho U D / mu.
        angle: advancing contact angle as measured [rad].
    """
    return sqrt((weber + 12.0) / (3.0 * (1.0 - cos(angle)) + 4.0 * weber / sqrt(reynolds)))


def roisman(weber: float, reynolds: float) -> float:
    """Film that viscosity stops, less what the rim takes (Roisman 2009)."""
    return 0.87 * reynolds**0.2 - 0.40 * reynolds**0.4 / sqrt(weber)


def laan(weber: float, reynolds: float) -> float:
    """Between what capillarity and what viscosity alone would stop (Laan et al. 2014)."""
    impact = sqrt(weber * reynolds**-0.4)
    return reynolds**0.2 * impact / (1.24 + impact)


def wildeman(weber: float, reynolds: float, angle: float) -> float:
    """Energy of a disc after a boundary layer, and half of the kinetic energy lost anyway (Wildeman et al. 2016).

    3 (1 - cos(theta)) / We b^2 + 0.7 / sqrt(Re) b^2 sqrt(b - 1) = 12 / We + 1/2, of volume-of-fluid computations.

    Args: as `pasandideh_fard`; the angle is that of the computation.
    """

    def excess(width: float) -> float:
        surface = 3.0 * (1.0 - cos(angle)) / weber * width**2
        return surface + LAYER_LOSS / sqrt(reynolds) * width**2 * sqrt(width - 1.0) - 12.0 / weber - 0.5

    widest = 1.0 + ((12.0 / weber + 0.5) * sqrt(reynolds) / LAYER_LOSS) ** 0.4  # the layer alone would stop it before
    return float(brentq(excess, 1.0, widest))


def of_measured(weber: float, reynolds: float, angle: float) -> tuple[float, float] | None:
    """Return the least and the largest width of the correlations of measured drops; None where they are not meant.

    Args: as `pasandideh_fard`.
    """
    if weber < LEAST_WEBER or not LEAST_REYNOLDS <= reynolds <= MOST_REYNOLDS * weber**2.5:
        return None
    found = pasandideh_fard(weber, reynolds, angle), roisman(weber, reynolds), laan(weber, reynolds)
    return min(found), max(found)
