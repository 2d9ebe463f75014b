"""The critical step: stability over 1e5 steps just below it, a stop with its reason just above it."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.energy_balance import EnergyBalance, energy_sums
from reflowshock.fem.dynamics.participant import SingleModel, explicit_motion
from reflowshock.fem.errors import EnergyError
from reflowshock.fem.estimates.estimate import WindowPlan, damped_critical_step
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.load import BodyAcceleration, Load
from reflowshock.fem.loads.pulse import HalfSine
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.power_iteration import highest_frequency
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import Materials

SOFT = Isotropic(density=1200.0, young_modulus=1e9, poisson_ratio=0.45)
PUSH = np.array([0.6, 0.0, 0.8])


def sandwich() -> MeshData:
    """Return thin copper (aspect ratio 25) between layers of FR4, clamped at one end."""
    points, cells = grid([0.0, 0.5e-3, 1e-3], [0.0, 0.5e-3], [0.0, 0.25e-3, 0.27e-3, 0.52e-3])
    copper = np.abs(points[cells][:, :, 2].mean(axis=1) - 0.26e-3) < 1e-6
    return mesh_of(points, cells, np.where(copper, "copper", "board"), {"mounting_holes": on(0, 0.0)})


def blocks() -> MeshData:
    """Return a free body with a stiffness jump of 100: copper on a soft block."""
    ticks = np.linspace(0.0, 1e-3, 3)
    points, cells = grid(ticks, ticks[:2], ticks)
    upper = points[cells][:, :, 2].mean(axis=1) > 0.5e-3
    return mesh_of(points, cells, np.where(upper, "copper", "substrate"), {})


MESHES = {"sandwich": sandwich(), "blocks": blocks()}


def estimates(name: str) -> tuple[Body, dict[str, float]]:
    """Return a body, and its critical step [s] by elements and by power iteration."""
    body, element = dns_body(MESHES[name], materials=Materials(substrate=SOFT))
    estimate = highest_frequency(MPI.COMM_SELF, body, body.terms, body.mass)
    return body, {"element": element, "power_iteration": estimate.critical_step}


def random_start(motion: ExplicitMotion) -> None:
    """Excite all modes equally."""
    noise = np.random.default_rng(3).normal(size=motion.velocity.shape)
    motion.velocity[:] = np.where(motion.mobility > 0.0, noise * np.sqrt(motion.mobility), 0.0)


def energy_of(motion: ExplicitMotion) -> float:
    """Return kinetic and internal energy of a motion [J]."""
    return motion.kinetic_energy() + motion.internal_energy().total


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("estimate", [pytest.param("element", marks=pytest.mark.long), "power_iteration"])
def test_energy_stays_for_1e5_steps_at_99_percent(name, estimate):
    """The element estimate is the smaller step."""
    body, steps = estimates(name)
    assert steps["element"] <= steps["power_iteration"]
    motion = explicit_motion(body, [], 0.99 * steps[estimate])
    random_start(motion)
    before, seen = energy_of(motion), []
    for _ in range(100):
        for _ in range(1000):
            motion.advance()
            motion.update_force()
        seen.append(energy_of(motion))
    assert np.abs(np.array(seen) / before - 1.0).max() < 1e-3
    assert motion.step_energy(np.zeros(3)) < motion.internal_energy().total


def steps_until_stopped(body: Body, step: float, loads: list[Load], critical: float) -> tuple[int, str]:
    """Step as a run does, with regular energy checks; return the step at which it was stopped, and the reason."""
    participant = SingleModel(explicit_motion(body, loads, step), WindowPlan(50 * step, 50, 20, 1))
    balance = EnergyBalance(limit=0.02, trivial=0.0, step=step, critical=critical)
    balance.judge(energy_sums(participant, 0.0), 0.0)
    for window in range(1, 21):
        participant.begin_window()
        try:
            balance.judge(energy_sums(participant, 0.0), participant.motion.time)
        except EnergyError as error:
            return 50 * window, str(error)
    return 10**9, ""


@pytest.mark.parametrize("name", MESHES)
def test_step_5_percent_too_large_is_stopped_with_its_reason(name):
    body, steps = estimates(name)
    critical = steps["power_iteration"]
    push: list[Load] = [BodyAcceleration(PUSH, HalfSine(1.5e4, 300 * critical))]
    stopped, reason = steps_until_stopped(body, 1.05 * critical, push, critical)
    assert stopped <= 1000
    assert "the time step is not stable at time" in reason
    assert f"step {1.05 * critical:.3e} s, estimated critical step {critical:.3e} s" in reason
    assert steps_until_stopped(body, 0.99 * critical, push, critical)[0] > 1000


def test_damping_lowers_the_critical_step_as_predicted():
    body, steps = estimates("sandwich")
    critical = steps["power_iteration"]
    stiffness = 0.3 * critical
    damped = damped_critical_step(critical, stiffness)
    assert damped < 0.75 * critical

    def run(fraction: float) -> tuple[int, str]:
        loads = [BodyAcceleration(PUSH, HalfSine(1.5e4, 300 * critical)), RayleighDamping(0.0, stiffness, body.terms)]
        return steps_until_stopped(body, fraction * damped, loads, damped)

    assert run(0.99)[0] > 1000
    stopped, reason = run(1.05)
    assert stopped <= 1000
    assert "the time step is not stable" in reason
