"""Trial of a free block under a pulse of acceleration that may last few steps, or no time between two of them."""

import numpy as np

from reflowshock.fem.division.checks import check_pulses
from reflowshock.fem.loads.load import BodyAcceleration
from reflowshock.fem.loads.pulse import Constant, HalfSine, Haversine, Pulse, Tabulated
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.trials.bodies import dns_body, motion_of
from reflowshock.fem.trials.grids import grid, mesh_of
from reflowshock.fem.trials.parameters import PulseTrial

FRACTION = 0.9  # of the critical step, the program's default
DIRECTION = np.array([0.6, 0.0, 0.8])
AFTER = 5  # steps after the pulse


def pulse(given: PulseTrial) -> dict[str, float]:
    """Return the error of speed and way after the pulse, and what the strains hold of what it gave.

    Raises:
        PulseError: The pulse is over before the step is.
    """
    body, critical = dns_body(block())
    step = FRACTION * critical
    duration = given.steps * step
    check_pulses([duration], step, FRACTION)
    course = course_of(given, duration)
    motion = motion_of(body, step, [BodyAcceleration(DIRECTION, course)])
    for _ in range(int(np.ceil(given.steps)) + AFTER):
        motion.advance()
        motion.update_force()
    speed, way = motion.present_velocity() @ DIRECTION, motion.displacement @ DIRECTION
    exact = np.array([course.integral(motion.time), course.double_integral(motion.time)])
    scale = np.where(exact > 0.0, exact, 1.0)
    errors = [np.abs(found - value).max() for found, value in zip((speed, way), exact, strict=True)] / scale
    given_energy = max(float(motion.external_work), float(np.finfo(float).tiny))
    return {
        "velocity_error": float(errors[0]),
        "displacement_error": float(errors[1]),
        "strain_energy": motion.internal_energy().total / given_energy,
        "energy_error": motion.kinetic_energy() / given_energy - 1.0 if given.peak else 0.0,
    }


def block() -> MeshData:
    """Return a block of board that nothing holds."""
    line = np.linspace(0.0, 1e-3, 3)
    return mesh_of(*grid(line, line, line), "board", {})


def course_of(given: PulseTrial, duration: float) -> Pulse:
    """Return the pulse of a duration [s]."""
    if given.pulse == "triangle":
        return Tabulated(np.array([0.0, 0.5, 1.0]) * duration, np.array([0.0, given.peak, 0.0]))
    if given.pulse == "constant":
        return Constant(given.peak, duration)
    return (HalfSine if given.pulse == "half_sine" else Haversine)(given.peak, duration)
