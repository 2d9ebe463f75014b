"""Exact solutions of viscous flows: start-up and steady channel flow, decaying Taylor-Green vortices."""

from collections.abc import Callable
from math import exp, pi

import numpy as np

from reflowshock.arrays import Floats

TERMS = 40
POINTS = 2001  # samples of the shear rate between centre line and plate


def starting_channel(height: Floats, time: float, width: float, viscosity: float, force: float) -> Floats:
    """Return the start-up velocity profile between plates under a constant force, shape (n,) [m/s].

    The series solution of plane Poiseuille flow from rest (Morris et al. 1997, eq 21).

    Args:
        height: Heights above the lower plate, shape (n,) [m].
        time: Time since the force was applied [s].
        width: Distance between the plates [m].
        viscosity: Kinematic viscosity [m^2/s].
        force: Force per unit mass along the plates [m/s^2].
    """
    speed = force / (2.0 * viscosity) * height * (width - height)
    for term in range(TERMS):
        wave = (2 * term + 1) * pi
        factor = 4.0 * force * width**2 / (viscosity * wave**3) * exp(-(wave**2) * viscosity * time / width**2)
        speed = speed - factor * np.sin(wave * height / width)
    return speed


def steady_channel(height: Floats, width: float, rate_at_wall: float, viscosity: Callable[[float], float]) -> Floats:
    """Return the steady velocity profile between plates for shear-rate dependent viscosity, shape (n,) [m/s].

    The stress is linear across the channel, which gives the position of each shear rate; the speed is the integral of
    the shear rate.

    Args:
        height: Heights above the lower plate, shape (n,) [m].
        width: Distance between the plates [m].
        rate_at_wall: Shear rate at the plates [1/s].
        viscosity: Function from shear rate [1/s] to viscosity [Pa s].
    """
    from scipy.integrate import cumulative_trapezoid  # imported late to keep the start-up of plans fast

    rates = np.linspace(0.0, rate_at_wall, POINTS)
    stress = np.array([viscosity(rate) * rate for rate in rates])
    offset = 0.5 * width * stress / stress[-1]  # from the centre line
    below = cumulative_trapezoid(rates, offset, initial=0.0)
    return np.interp(np.abs(height - 0.5 * width), offset, below[-1] - below)


def taylor_green(x: Floats, y: Floats, side: float) -> tuple[Floats, Floats, Floats]:
    """Return the exact initial flow of vortices (Taylor & Green 1937).

    Args:
        x: First coordinates, shape (n,) [m].
        y: Second coordinates, shape (n,) [m].
        side: Side of the periodic box [m].

    Returns:
        Velocities along both axes over their maximum U, and pressure over rho U^2, shape (n,) each.
    """
    wave = 2.0 * pi / side
    u = -np.cos(wave * x) * np.sin(wave * y)
    v = np.sin(wave * x) * np.cos(wave * y)
    return u, v, -0.25 * (np.cos(2.0 * wave * x) + np.cos(2.0 * wave * y))


def taylor_green_decay(side: float, viscosity: float) -> float:
    """Return the decay rate of the vortex speeds [1/s], for a box side [m] and a kinematic viscosity [m^2/s]."""
    return 8.0 * pi**2 * viscosity / side**2
