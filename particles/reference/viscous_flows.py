"""Exact viscous flows: the start of a flow between plates, vortices that die out."""

from math import exp, pi

import numpy as np

from reflowshock.arrays import Floats

TERMS = 40


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
