"""Exact viscous flows: the start of a flow between plates, vortices that die out."""

from collections.abc import Callable
from math import exp, pi

import numpy as np
from scipy.integrate import cumulative_trapezoid

from reflowshock.arrays import Floats

TERMS = 40
POINTS = 2001  # of rates between the middle of a channel and its plates


def starting_channel(height: Floats, time: float, width: float, viscosity: float, force: float) -> Floats:
    """Return the speed [m/s] between plates after a force has begun to act (Morris et al. 1997, eq 21).

    Args:
        height: `(n,)` above the lower plate [m].
        time: since then [s].
        width: between the plates [m].
        viscosity: kinematic [m^2/s].
        force: acceleration along the plates [m/s^2].
    """
    speed = force / (2.0 * viscosity) * height * (width - height)
    for term in range(TERMS):
        wave = (2 * term + 1) * pi
        factor = 4.0 * force * width**2 / (viscosity * wave**3) * exp(-(wave**2) * viscosity * time / width**2)
        speed = speed - factor * np.sin(wave * height / width)
    return speed


def steady_channel(height: Floats, width: float, rate_at_wall: float, viscosity: Callable[[float], float]) -> Floats:
    """Return the speed [m/s] of steady flow between plates of liquid whose viscosity depends on the rate of shear.

    The stress is linear across the channel, so that the place of each rate is known; speed is the integral of rates.

    Args:
        height: `(n,)` above the lower plate [m].
        width: between the plates [m].
        rate_at_wall: of shear at the plates [1/s].
        viscosity: at a rate of shear [Pa s].
    """
    rates = np.linspace(0.0, rate_at_wall, POINTS)
    stress = np.array([viscosity(rate) * rate for rate in rates])
    place = 0.5 * width * stress / stress[-1]  # from the middle
    below = cumulative_trapezoid(rates, place, initial=0.0)
    return np.interp(np.abs(height - 0.5 * width), place, below[-1] - below)


def taylor_green(x: Floats, y: Floats, side: float) -> tuple[Floats, Floats, Floats]:
    """Return velocities over the largest one U, and pressure over rho U^2, of vortices (Taylor & Green 1937).

    Args:
        x: `(n,)` [m].
        y: `(n,)` [m].
        side: of the box [m].
    """
    wave = 2.0 * pi / side
    u = -np.cos(wave * x) * np.sin(wave * y)
    v = np.sin(wave * x) * np.cos(wave * y)
    return u, v, -0.25 * (np.cos(2.0 * wave * x) + np.cos(2.0 * wave * y))


def taylor_green_decay(side: float, viscosity: float) -> float:
    """Return the rate [1/s] at which their speeds die out, for a kinematic viscosity [m^2/s]."""
    return 8.0 * pi**2 * viscosity / side**2
