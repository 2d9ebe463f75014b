"""Mass-proportional damping relative to the table, in every step and once a window: decay, energy, rigid motion."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.implicit import ImplicitMotion
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.loads.damping import RayleighDamping, WindowDrag
from reflowshock.fem.loads.large_mass import LargeMass
from reflowshock.fem.loads.load import BodyAcceleration, Load
from reflowshock.fem.loads.pulse import HalfSine
from tests.support.fem_bodies import STEEL
from tests.verification.test_fem_loads import ALONG, LENGTH, SPEED, bar, total_energy

STEPS = 10  # of a window
FREQUENCY = SPEED / (4 * LENGTH)  # of a bar fixed at one end
PULSE = HalfSine(1e5, 2.0 / FREQUENCY)


RATE, FREE = ("direct", 0.3 * FREQUENCY), ("direct", 0.0)


def damping_of(kind: str, body, rate: float) -> list[Load]:
    """Return mass-proportional damping that acts in every step, or once in ``STEPS`` steps."""
    return WindowDrag.once_a_window([RayleighDamping.build(body, rate, 0.0)], STEPS if kind == "window" else 1)


@pytest.mark.parametrize("kind", ["step", "window"])
@pytest.mark.parametrize("ratio", [0.005, 0.03])
def test_free_vibration_decays_as_the_exact_solution(kind, ratio):
    """The displacement of the first mode decays as exp(-xi w t), and the energy lost is that dissipated."""
    body, critical = dns_body(bar(held=True), STEEL)
    omega = 2 * np.pi * FREQUENCY
    motion = motion_of(body, 0.9 * critical, damping_of(kind, body, 2 * ratio * omega))
    motion.displacement[:, 0] = 1e-6 * np.sin(np.pi * body.local.points[:, 0] / (2 * LENGTH))
    motion.update_force()
    motion.velocity[:] = -0.5 * motion.step * motion.acceleration()
    start = motion.internal_energy().total + motion.kinetic_energy()
    while motion.time < 10 / FREQUENCY:
        motion.take_steps(STEPS)
    left = motion.internal_energy().total + motion.kinetic_energy()
    assert np.log(start / left) / (2 * omega * motion.time) == pytest.approx(ratio, rel=0.01)
    assert motion.damping_energy == pytest.approx(start - left, rel=1e-9)


@pytest.mark.parametrize("kind", ["step", "window"])
@pytest.mark.parametrize("method", ["direct", "large_mass"])
def test_energy_balance_closes(kind, method):
    body, critical = dns_body(bar(held=method == "direct"), STEEL)
    motion = motion_of(body, 0.9 * critical, [*pulse_of(method, body), *damping_of(kind, body, 0.2 * FREQUENCY)])
    error = work = 0.0
    for _ in range(40):
        motion.take_steps(STEPS)
        error, work = max(error, abs(total_energy(motion))), max(work, abs(motion.external_work))
    assert motion.damping_energy > 1e-4 * work
    assert error < (1e-8 if method == "large_mass" else 1e-11) * work


def pulse_of(method: str, body) -> list[Load]:
    """Return the pulse at the lower end of a bar, as body acceleration or by a large mass."""
    base, low = BodyAcceleration(ALONG, PULSE), np.flatnonzero(body.local.points[:, 0] == 0.0)
    if method == "direct":
        return [base]
    return [LargeMass.build(MPI.COMM_SELF, body, body.local.nodes[low], base)]


def shaken(solver: str, method: str, rate: float) -> Motion:
    """Return a bar that has followed the table beyond its pulse, with mass-proportional damping."""
    body, critical = dns_body(bar(held=method == "direct"), STEEL)
    loads = pulse_of(method, body)
    if solver == "implicit":
        loads += [RayleighDamping.build(body, rate, 0.0)]
        motion: ExplicitMotion | ImplicitMotion = ImplicitMotion(MPI.COMM_SELF, body, loads, 0.9 * critical)
    else:
        motion = motion_of(body, 0.9 * critical, [*loads, *damping_of(solver, body, rate)])
    while motion.time < 2 * PULSE.duration:
        motion.take_steps(STEPS)
    return motion


@pytest.mark.parametrize("solver", ["step", "window", "implicit"])
def test_a_board_that_follows_the_table_is_not_decelerated(solver):
    """Overcritical damping stops the bar relative to the table, not the table: the mean velocity is that of the table.

    Damping of the absolute motion would stop the bar within a sixth of the pulse.
    """
    motion = shaken(solver, "large_mass", 12 / PULSE.duration)
    table = motion.base_velocity()
    mean = motion.body.mass @ motion.velocity / motion.body.mass.sum()
    assert abs(table[0]) == pytest.approx(PULSE.integral(PULSE.duration), rel=1e-3)
    assert mean == pytest.approx(table, rel=1e-3, abs=1e-3 * abs(table[0]))


@pytest.mark.parametrize("solver", ["step", "window", "implicit"])
def test_large_mass_and_direct_input_are_damped_alike(solver):
    ends = []
    for method in ("direct", "large_mass"):
        motion = shaken(solver, method, 0.3 * FREQUENCY)
        relative = motion.displacement - motion.base_displacement()
        ends.append(relative[:, 0])
        assert motion.damping_energy > 0.0
    direct, large = ends
    assert np.linalg.norm(large - direct) < 4e-3 * np.linalg.norm(direct)


def test_a_window_of_drag_equals_drag_in_every_step():
    """The window is a quarter of a period; those of a run are ten thousand times shorter."""
    step, window, free = (shaken(*run).displacement for run in (("step", *RATE), ("window", *RATE), ("step", *FREE)))
    assert np.linalg.norm(window - step) < 0.1 * np.linalg.norm(free - step)


def test_a_free_body_launched_with_a_velocity_is_braked_in_second_order():
    """A free body has the displacement v (1 - exp(-alpha t)) / alpha."""
    rate = 0.5 * FREQUENCY
    body, critical = dns_body(bar(held=False), STEEL)

    def error(windows: int) -> float:
        duration = 40 * STEPS * critical / 2
        motion = motion_of(body, duration / (windows * STEPS), damping_of("window", body, rate))
        motion.launch(ALONG)
        for _ in range(windows):
            motion.take_steps(STEPS)
        exact = (1.0 - np.exp(-rate * duration)) / rate
        return abs(float(motion.displacement[0, 0]) - exact) / exact

    assert error(40) < 1e-3
    assert np.log2(error(40) / error(80)) == pytest.approx(2.0, abs=0.2)
