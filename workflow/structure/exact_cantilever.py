"""A clamped strip under sudden pressure: Euler-Bernoulli theory in plane strain, and what a run has of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.workflow.structure.exact_bar import with_errors

ROOTS = np.array([1.8751040687, 4.6940911330, 7.8547574382])  # of cos x cosh x = -1 (Blevins 1979, table 8-1)
SEARCHED = 0.25  # of the exact frequency: how far from it that of the run is looked for


@dataclass(frozen=True, slots=True)
class Strip:
    """A strip clamped at one end, its sides held.

    Attributes:
        length: [m].
        thickness: [m].
        elasticity: (6, 6) [Pa].
        density: [kg/m^3].
        pressure: [Pa].
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
    """Measure deflection and first frequency in the motion of the tip (s,) [m], which swings about its static place.

    Fits sum_n A_n (1 - cos(omega_n t)) with the ratios omega_n / omega_1 of the theory; the sum of A_n is the static
    deflection.

    Returns:
        tip_deflection [m], swing_frequency [Hz], exact values and errors.
    """
    from scipy.optimize import minimize_scalar

    ratios = (ROOTS / ROOTS[0]) ** 2

    def swings(frequency: float) -> NDArray[np.float64]:
        return 1.0 - np.cos(2.0 * np.pi * frequency * np.outer(time, ratios))

    def misfit(frequency: float) -> float:
        columns = swings(frequency)
        return float(np.linalg.norm(columns @ np.linalg.lstsq(columns, tip, rcond=None)[0] - tip))

    bounds = ((1.0 - SEARCHED) * strip.frequency, (1.0 + SEARCHED) * strip.frequency)
    frequency = float(minimize_scalar(misfit, bounds=bounds, method="bounded").x)
    deflection = abs(float(np.linalg.lstsq(swings(frequency), tip, rcond=None)[0].sum()))
    measured = {"tip_deflection": deflection, "swing_frequency": frequency}
    return with_errors(measured, {"tip_deflection": abs(strip.deflection), "swing_frequency": strip.frequency})
