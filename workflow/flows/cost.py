"""Cost of a flow by delta-SPH on a CPU core and on a GPU: time steps times the wall time of one step.

The wall time of a step is a constant plus a share of each particle. All constants are measured; each names its source.
"""

from dataclasses import dataclass
from typing import Protocol

from reflowshock.particles.flows.flow import FlowScene

# Flow in a plane, one core of an AMD EPYC: cases/dam_break.
SECONDS_PER_STEP, SECONDS_PER_PARTICLE = 1.3e-4, 2.9e-7
# Flow in space with a triangulated surface, one core of an Intel Xeon: drops of ink with 280 to 28 768 particles,
# benchmarks/bench_sph.py.
SECONDS_PER_STEP_IN_SPACE, SECONDS_PER_PARTICLE_IN_SPACE = 1.2e-3, 2.2e-6
# Step with a viscosity that depends on the shear rate, relative to one without: an impact, 24 particles per diameter.
SHEAR_COST = 1.53
# NVIDIA H200, flow in space: benchmarks/bench_sph.py. The surface of a droplet stays on the CPU, here with 16 cores.
SECONDS_PER_GPU_STEP, SECONDS_PER_GPU_PARTICLE, SECONDS_PER_GPU_PARTICLE_WITH_SURFACE = 1.0e-3, 3.1e-9, 2.4e-7
SECONDS_TO_START = 3.0  # loading of libraries and compiled kernels
BYTES_OF_PARTICLE = 900.0  # half of it is the neighbour list; on a GPU 970, measured


class Sized(Protocol):
    """Anything that has a number of particles."""

    @property
    def particles(self) -> int:
        """Number of particles."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Cost of a flow on one device.

    Attributes:
        steps: Number of time steps.
        seconds_per_step: Wall time of a step without its particles [s].
        seconds_of_particles: Wall time that all particles add to a step [s].
        seconds_at_end: Wall time of measurements after the last step [s].
    """

    steps: float
    seconds_per_step: float
    seconds_of_particles: float
    seconds_at_end: float = 0.0

    @property
    def seconds(self) -> float:
        """Wall time [s]."""
        return SECONDS_TO_START + self.steps * (self.seconds_per_step + self.seconds_of_particles) + self.seconds_at_end

    def refined(self, factor: float, dimension: int) -> "Cost":
        """Return the cost with ``factor`` times the particles; the time step shrinks with their spacing."""
        return Cost(
            self.steps * factor ** (1.0 / dimension),
            self.seconds_per_step,
            self.seconds_of_particles * factor,
            self.seconds_at_end * factor,
        )


def plane_costs(scene: FlowScene, steps: int, shear_factor: float) -> dict[str, Cost]:
    """Return the cost of a flow in a plane on the devices of its method: "cpu" (one core) and "cuda".

    Args:
        scene: Scene with its particles.
        steps: Number of time steps.
        shear_factor: `SHEAR_COST` if the viscosity depends on the shear rate, else 1.

    Returns:
        Device -> number of steps and wall times from which its cost follows.
    """
    factor = scene.numerics.relative_cost
    each = SECONDS_PER_PARTICLE * shear_factor * factor
    costs = {
        "cpu": Cost(steps, SECONDS_PER_STEP * factor, each * scene.particles),
        "cuda": Cost(steps, SECONDS_PER_GPU_STEP, SECONDS_PER_GPU_PARTICLE * scene.particles),
    }
    return {device: costs[device] for device in scene.numerics.devices}


def surface_costs(scene: Sized, steps: int, shear_factor: float) -> dict[str, Cost]:
    """Return the cost of a flow in space with a triangulated surface on the devices of its method.

    Args:
        scene: Scene with its particles.
        steps: Number of time steps.
        shear_factor: `SHEAR_COST` if the viscosity depends on the shear rate, else 1.

    Returns:
        Device, "cpu" (one core) or "cuda" -> number of steps and wall times from which its cost follows.
    """
    each = SECONDS_PER_PARTICLE_IN_SPACE * shear_factor
    return {
        "cpu": Cost(steps, SECONDS_PER_STEP_IN_SPACE, each * scene.particles),
        "cuda": Cost(steps, SECONDS_PER_GPU_STEP, SECONDS_PER_GPU_PARTICLE_WITH_SURFACE * scene.particles),
    }
