"""Numerical parameters of delta-SPH, and its largest stable time step."""

from math import pi, sqrt
from typing import Literal

from pydantic import Field

from reflowshock.parameters import Parameters

# Alpha of liquid without viscosity of its own: as in dam breaks of Marrone et al. 2011.
ARTIFICIAL_VISCOSITY = 0.02
# Of the time step: in which sound crosses a smoothing length, velocity diffuses over one (Monaghan 1992), and the
# shortest waves of surface tension pass (Brackbill et al. 1992).
COURANT, DIFFUSIVE, CAPILLARY = 0.25, 0.125, 0.25
# Viscosity along the line of two particles, as where there is a free surface, slows the shortest waves down twice as
# fast as viscosity along their velocities: so many times it bounds the step. Without, stiff drops flew apart.
CENTRAL = 2.0


class MethodNumerics(Parameters):
    """How a flow is computed, whatever its particles stand along.

    The smoothing length is over the spacing of the particles, the speed of sound over the largest speed expected;
    density diffusion is delta, artificial viscosity alpha (by default 0.02 where viscosity does not act, else none).
    The density diffuses along its gradient: "renormalised" by a 3 x 3 matrix, or "reproducing", the slope of the linear
    function next to the neighbours, from a 4 x 4 matrix (Belytschko et al. 1998).
    XSPH lets particles move with a velocity that is smoothed by so much: 0.5 is usual, none is needed with viscosity.
    Particles are on threads of the processor, or on a GPU (cuda); a surface that is tracked stays with the processor.
    """

    device: Literal["cpu", "cuda"] = "cpu"
    kernel: Literal["cubic_spline", "wendland"] = "cubic_spline"
    smoothing_length: float = Field(1.3, ge=1.0, le=2.5)
    sound_speed: float = Field(10.0, ge=5, le=100)
    density_diffusion: float = Field(0.1, ge=0, le=0.2)
    density_gradient: Literal["renormalised", "reproducing"] = "renormalised"
    artificial_viscosity: float | None = Field(None, ge=0, le=0.5)
    xsph: float = Field(0.0, ge=0, le=1)


class SphNumerics(MethodNumerics):
    """How a flow is computed that its particles stand across.

    They stand along the length of the scene: the height of the dam, the width of the channel, the side of the box of
    vortices.
    """

    particles_across: int = Field(40, ge=8, le=1000)


def largest_time_step(length: float, speed: float, density: float, viscosity: float, tension: float = 0.0) -> float:
    """Return the largest stable time step [s].

    Args:
        length: smoothing length [m].
        speed: of sound, and the largest of the liquid added [m/s].
        density: [kg/m^3].
        viscosity: [Pa s], `CENTRAL` times it where there is a free surface; 0 where none acts.
        tension: surface tension [N/m]; 0 where none acts.
    """
    steps = [COURANT * length / speed]
    if viscosity > 0.0:
        steps.append(DIFFUSIVE * length**2 * density / viscosity)
    if tension > 0.0:
        steps.append(CAPILLARY * sqrt(density * length**3 / (2.0 * pi * tension)))
    return min(steps)
