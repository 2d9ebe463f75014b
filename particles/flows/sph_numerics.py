"""Numerical parameters of delta-SPH and its largest stable time step."""

from collections.abc import Mapping
from math import pi, sqrt
from typing import ClassVar, Literal

from pydantic import Field

from reflowshock.particles.flows.flow_method import FlowNumerics, FlowScale

# Default alpha of an inviscid liquid, as in the dam breaks of Marrone et al. 2011.
ARTIFICIAL_VISCOSITY = 0.02
# Safety factors of the time step limits: acoustic and viscous (Monaghan 1992), capillary (Brackbill et al. 1992).
COURANT, DIFFUSIVE, CAPILLARY = 0.25, 0.125, 0.25
# The central viscous force, used with a free surface, damps the shortest waves twice as fast as the shear form, so the
# viscous limit is halved; without this factor stiff drops are unstable.
CENTRAL = 2.0


class MethodNumerics(FlowNumerics):
    """Numerical parameters of delta-SPH, apart from the resolution.

    The smoothing length is relative to the particle spacing, the speed of sound to the largest expected speed. The
    density diffusion is delta; the artificial viscosity is alpha (default 0.02 if viscosity is off, otherwise 0).
    The density gradient of the diffusion is "renormalised" by a 3 x 3 matrix, or "reproducing" linear functions by a
    4 x 4 matrix (Belytschko et al. 1998). The XSPH factor smooths the velocity that moves the particles; 0.5 is usual,
    and viscous flows need none. The particles are computed on processor threads (cpu) or on a GPU (cuda); a tracked
    surface is always computed on the processor.
    """

    devices = ("cpu", "cuda")
    study_values: ClassVar[Mapping[str, tuple[float, ...]]] = {"smoothing_length": (1.2, 1.5, 2.0)}

    method: Literal["sph"] = "sph"
    device: Literal["cpu", "cuda"] = "cpu"
    kernel: Literal["cubic_spline", "wendland"] = "cubic_spline"
    smoothing_length: float = Field(1.3, ge=1.0, le=2.5)
    sound_speed: float = Field(10.0, ge=5, le=100)
    density_diffusion: float = Field(0.1, ge=0, le=0.2)
    density_gradient: Literal["renormalised", "reproducing"] = "renormalised"
    artificial_viscosity: float | None = Field(None, ge=0, le=0.5)
    xsph: float = Field(0.0, ge=0, le=1)

    def sound(self, fastest: float) -> float:
        """Return the speed of sound [m/s] for a largest expected speed [m/s]."""
        return self.sound_speed * fastest

    def time_step(self, scale: FlowScale, is_viscous: bool) -> float:
        """Return the expected time step [s], with or without viscosity."""
        length, viscosity = self.smoothing_length * scale.spacing, 0.0
        if is_viscous:
            viscosity = scale.largest_viscosity * (CENTRAL if scale.has_free_surface else 1.0)
        speed = self.sound(scale.fastest) + scale.fastest
        return largest_time_step(length, speed, scale.density, viscosity, scale.tension)


class SphNumerics(MethodNumerics):
    """Numerical parameters of a plane flow, resolved by a number of particles across its characteristic length.

    The length is the height of the dam, the width of the channel, or the side of the box of vortices.
    """

    particles_across: int = Field(40, ge=8, le=1000)


def largest_time_step(length: float, speed: float, density: float, viscosity: float, tension: float = 0.0) -> float:
    """Return the largest stable time step [s].

    Args:
        length: Smoothing length [m].
        speed: Speed of sound plus the largest speed of the liquid [m/s].
        density: Density [kg/m^3].
        viscosity: Viscosity [Pa s], multiplied by ``CENTRAL`` with a free surface; 0 without viscosity.
        tension: Surface tension [N/m]; 0 without surface tension.
    """
    steps = [COURANT * length / speed]
    if viscosity > 0.0:
        steps.append(DIFFUSIVE * length**2 * density / viscosity)
    if tension > 0.0:
        steps.append(CAPILLARY * sqrt(density * length**3 / (2.0 * pi * tension)))
    return min(steps)
