"""Clamped strip under a sudden pressure: Euler-Bernoulli theory in plane strain, and its values in a run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.structure.exact_bar import with_errors

ROOTS = np.array([1.8751040687, 4.6940911330, 7.8547574382])  # of cos x cosh x = -1 (Blevins 1979, table 8-1)
FREQUENCY_MARGIN = 0.25  # half width of the search, over the exact frequency


@dataclass(frozen=True, slots=True)
class Strip:
    """Strip in plane strain, clamped at one end.

    Attributes:
        length: Length L [m].
        thickness: Thickness t [m].
        elasticity: Elasticity matrix C, shape (6, 6) [Pa].
        density: Density [kg/m^3].
        pressure: Pressure p [Pa].
    """

    length: float
    thickness: float
    elasticity: NDArray[np.float64]
    density: float
    pressure: float

    @property
    def stiffness(self) -> float:
        """Bending stiffness of a unit width, (C_11 - C_13^2 / C_33) t^3 / 12 [N m]; isotropic: E / (1 - nu^2)."""
        stiff = self.elasticity
        return float((stiff[0, 0] - stiff[0, 2] ** 2 / stiff[2, 2]) * self.thickness**3 / 12.0)

    @property
    def deflection(self) -> float:
        """Static deflection of the tip, p L^4 / (8 D) [m]."""
        return self.pressure * self.length**4 / (8.0 * self.stiffness)

    @property
    def frequency(self) -> float:
        """First natural frequency [Hz]."""
        return float(
            ROOTS[0] ** 2 / (2.0 * np.pi * self.length**2) * np.sqrt(self.stiffness / (self.density * self.thickness))
        )


def measure(strip: Strip, time: NDArray[np.float64], tip: NDArray[np.float64]) -> dict[str, float]:
    """Measure static deflection and first frequency from the motion of the tip.

    Fits sum_n A_n (1 - cos(omega_n t)) with the ratios omega_n / omega_1 of the theory. The sum of A_n is the static
    deflection.

    Args:
        strip: Strip with its exact solution.
        time: Times, shape (n,) [s].
        tip: Deflection of the tip, shape (n,) [m].

    Returns:
        ``tip_deflection`` [m] and ``swing_frequency`` [Hz], each with ``_exact`` and ``_error``.
    """
    from scipy.optimize import minimize_scalar

    ratios = (ROOTS / ROOTS[0]) ** 2

    def swings(frequency: float) -> NDArray[np.float64]:
        return 1.0 - np.cos(2.0 * np.pi * frequency * np.outer(time, ratios))

    def misfit(frequency: float) -> float:
        columns = swings(frequency)
        return float(np.linalg.norm(columns @ np.linalg.lstsq(columns, tip, rcond=None)[0] - tip))

    bounds = ((1.0 - FREQUENCY_MARGIN) * strip.frequency, (1.0 + FREQUENCY_MARGIN) * strip.frequency)
    frequency = float(minimize_scalar(misfit, bounds=bounds, method="bounded").x)
    deflection = abs(float(np.linalg.lstsq(swings(frequency), tip, rcond=None)[0].sum()))
    measured = {"tip_deflection": deflection, "swing_frequency": frequency}
    return with_errors(measured, {"tip_deflection": abs(strip.deflection), "swing_frequency": strip.frequency})
