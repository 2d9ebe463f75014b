"""Particle count and cost of a reflow before it runs. Loads neither numba nor PETSc."""

from reflowshock.particles.core.geometry import JointGeometry, joint_counts
from reflowshock.particles.parameters.solder import Solder

# Measured by benchmarks/bench_reflow_scale.py on one core of a 2-core x86-64 machine.
SECONDS_PER_STEP = 0.02
SECONDS_PER_STEP_AND_PARTICLE = 1e-5
TYPICAL_STEPS = 8
TYPICAL_STEPS_OF_DROP = 80
# Steps with inertia factor a matrix of all particles; measured with 55 to 923 particles.
SECONDS_PER_INERTIAL_STEP = 0.006
SECONDS_PER_INERTIAL_STEP_OF_THOUSAND = 0.15
INERTIAL_COST_EXPONENT = 1.5

# Steps of the scheme ispg; measured by benchmarks/bench_ispg.py with 141 to 1385 particles on a slow machine.
SECONDS_PER_ISPG_STEP = 0.005
SECONDS_PER_ISPG_STEP_AND_PARTICLE = 4e-5
# Steps of the scheme ispg until a joint is at rest: 26 to 318, most for fine particles and tilted plates.
ISPG_STEPS_OF_JOINT = 250
# Steps of a section, whose pressures have dense matrices; measured with 121 to 1681 particles.
SECONDS_PER_SECTION_STEP, SECONDS_PER_SECTION_STEP_AND_PARTICLE = 0.008, 3e-5
SECONDS_PER_SECTION_STEP_AND_PAIR = 2.3e-8


def particle_count(solder: Solder, geometry: JointGeometry) -> int:
    """Return the number of particles of a joint: layers of concentric rings of 6 j particles.

    Args:
        solder: Volume, and spacing of the particles.
        geometry: Gap and radii of the joint.
    """
    rings, layers = joint_counts(geometry, solder.volume, solder.numerics.spacing)
    return layers * (1 + 3 * rings * (rings + 1))


def reflow_seconds(solder: Solder, geometry: JointGeometry) -> float:
    """Estimate the wall time of the reflow of one joint on one core [s], from the measured cost of a step.

    Args:
        solder: Volume, fluid, and spacing of the particles.
        geometry: Gap and radii of the joint.
    """
    particles = particle_count(solder, geometry)
    if solder.numerics.scheme == "ispg":
        return ispg_seconds(particles, ISPG_STEPS_OF_JOINT)
    return TYPICAL_STEPS * _seconds_per_step(particles)


def drop_seconds(particles: int) -> float:
    """Estimate the wall time to bring a drop of ``particles`` particles to rest on one core [s]."""
    return TYPICAL_STEPS_OF_DROP * _seconds_per_step(particles)


def inertial_seconds(particles: int, steps: int) -> float:
    """Estimate the wall time of ``steps`` time steps with inertia or viscosity on one core [s]."""
    growing = SECONDS_PER_INERTIAL_STEP_OF_THOUSAND * (particles / 1000.0) ** INERTIAL_COST_EXPONENT
    return steps * (SECONDS_PER_INERTIAL_STEP + growing)


def ispg_seconds(particles: int, steps: int) -> float:
    """Estimate the wall time of ``steps`` time steps of the scheme ispg on one core [s]."""
    return steps * (SECONDS_PER_ISPG_STEP + SECONDS_PER_ISPG_STEP_AND_PARTICLE * particles)


def section_seconds(particles: int, steps: int) -> float:
    """Estimate the wall time of ``steps`` time steps of a two-dimensional drop in section on one core [s]."""
    of_matrices = SECONDS_PER_SECTION_STEP_AND_PAIR * particles**2
    return steps * (SECONDS_PER_SECTION_STEP + SECONDS_PER_SECTION_STEP_AND_PARTICLE * particles + of_matrices)


def _seconds_per_step(particles: int) -> float:
    return SECONDS_PER_STEP + SECONDS_PER_STEP_AND_PARTICLE * particles
