"""Scripted participants and recorded messages in place of coupled models."""

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.pairs import SCHEMES, Pair
from reflowshock.fem.coupling.gravouil_combescure import GravouilCombescure
from reflowshock.fem.coupling.held_velocity import HeldVelocity, local_interface
from reflowshock.fem.coupling.one_way import OneWay
from reflowshock.fem.dynamics.participant import explicit_motion
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.parallel.exchange import InterfaceChannels
from tests.support.recording import RecordingError, record, replay, save_recording
from tests.support.scripted import ScriptedDriver, ScriptedMacro, ScriptedMeso, scripted_interface

WINDOWS = 20


@pytest.fixture(scope="module")
def bodies():
    """Return both models of a free pair and their steps."""
    models = Pair(free=True).divided(SCHEMES["held_velocity"])
    return models.bodies(), models.division.plan


def run(*parts) -> None:
    """Advance participants by ``WINDOWS`` windows."""
    for _ in range(WINDOWS):
        for part in parts:
            part.begin_window()
        for part in parts:
            part.finish_window()


def rigid(time: float, points: np.ndarray) -> np.ndarray:
    """Return the velocities of a rigid-body motion at points, shape (n, 3) [m/s]."""
    return np.array([1.0, -2.0, 0.5]) + np.cross([300.0, -100.0, 200.0], points)


def stretched(time: float, points: np.ndarray) -> np.ndarray:
    """Return the velocities of a uniform expansion at points, shape (n, 3) [m/s]."""
    return 300.0 * points


def driven(bodies, scheme, script, partner):
    """Return the meso model and its largest internal force after some scripted windows."""
    made, plan = bodies
    body = made["meso"]
    channels = InterfaceChannels.open(
        MPI.COMM_SELF, scripted_interface(len(body.interface)), body.interface, receiver_waits=False
    )
    meso = scheme.meso(body, [], plan, channels)
    meso.motion.velocity[:] = script(0.0, body.local.points)
    meso.motion.velocity[body.tie.slave] = 0.0
    macro = partner(body.local.points[body.interface], script, plan, channels)
    run(macro, meso)
    assert macro.time == pytest.approx(WINDOWS * plan.window)
    return meso, macro


@pytest.mark.parametrize("scheme, partner", [(HeldVelocity(), ScriptedMacro), (OneWay(), ScriptedDriver)])
def test_meso_model_in_rigid_motion_stays_stress_free(bodies, scheme, partner):
    meso, _ = driven(bodies, scheme, rigid, partner)
    loaded, _ = driven(bodies, scheme, stretched, partner)
    moved = WINDOWS * meso.plan.window * rigid(0.0, meso.motion.body.local.points)
    assert np.abs(meso.motion.displacement - moved).max() <= 1e-12 * np.abs(moved).max()
    assert np.abs(meso.motion.force).max() <= 1e-10 * np.abs(loaded.motion.force).max()
    assert abs(meso.motion.internal_energy().total) <= 1e-12 * loaded.motion.internal_energy().total


def test_scripted_macro_gets_mass_and_force(bodies):
    meso, macro = driven(bodies, HeldVelocity(), stretched, ScriptedMacro)
    interface = meso.motion.body.interface
    assert np.array_equal(macro.mass[:, 0], meso.motion.body.mass[interface])
    assert np.array_equal(macro.force, meso.motion.force[interface])
    assert np.abs(macro.force).max() > 0.0


def answered(bodies, mass: np.ndarray, script):
    """Return the macro model and the scripted meso model after some windows of a drop."""
    made, plan = bodies
    body = made["macro"]
    channels = InterfaceChannels.open(
        MPI.COMM_SELF, body.interface, scripted_interface(len(body.interface)), receiver_waits=False
    )
    meso = ScriptedMeso(mass, script, plan, channels)
    macro = HeldVelocity().macro(body, [half_sine_drop(1e6, 1e-5)], plan, channels)
    run(macro, meso)
    return macro, meso


def test_macro_model_on_springs_stores_their_energy(bodies):
    """With springs of k N/m at the interface, the transferred work is exactly k u^2 / 2 at any step."""
    stiffness, count = 1e4, len(bodies[0]["macro"].interface)
    macro, meso = answered(bodies, np.full(count, 1e-9), lambda time, u, v: -stiffness * u)
    assert np.array_equal(meso.force, macro.interface_force()[macro.motion.body.interface])
    stored = 0.5 * stiffness * float(np.sum(macro.motion.displacement[macro.motion.body.interface] ** 2))
    assert stored > 0.0
    assert macro.interface_work == pytest.approx(stored, rel=1e-10)


def test_macro_model_with_nothing_at_its_cut_is_alone(bodies):
    made, plan = bodies
    body = made["macro"]
    macro, _ = answered(bodies, np.zeros(len(body.interface)), lambda time, u, v: np.zeros_like(u))
    alone = explicit_motion(body, [half_sine_drop(1e6, 1e-5)], plan.window)
    for _ in range(WINDOWS):
        alone.advance()
        alone.update_force()
    assert np.array_equal(macro.motion.displacement, alone.displacement)


@pytest.mark.parametrize(
    "name, scheme", [("held_velocity", HeldVelocity()), ("gravouil_combescure", GravouilCombescure())]
)
def test_replay_of_one_side_is_the_same_to_the_last_bit(tmp_path, name, scheme):
    models = Pair(free=True).divided(SCHEMES[name])
    plan, made, loads = models.division.plan, models.bodies(), [half_sine_drop(1e6, 1e-5)]
    interface = {role: local_interface(body) for role, body in made.items()}
    channels = InterfaceChannels.open(
        MPI.COMM_SELF, made["macro"].interface, made["meso"].interface, receiver_waits=False
    )
    recorded = {role: record(channels, interface[role]) for role in made}
    make = {"macro": scheme.macro, "meso": scheme.meso}
    parts = {role: make[role](made[role], loads, plan, recorded[role]) for role in scheme.order}
    run(parts["macro"], parts["meso"])
    for role in made:
        save_recording(recorded[role], tmp_path / f"{role}.npz")
        replayed = replay(tmp_path / f"{role}.npz", interface[role])
        again = make[role](models.bodies()[role], loads, plan, replayed)
        run(again)
        assert np.abs(again.motion.displacement).max() > 0.0
        assert np.array_equal(again.motion.displacement, parts[role].motion.displacement)
        assert again.interface_work == parts[role].interface_work
        assert replayed.velocities.deviation == replayed.forces.deviation == 0.0
        with pytest.raises(RecordingError, match="the participant asks for another one"):
            run(again)
    with pytest.raises(RecordingError, match="nodes, this one has 1"):
        replay(tmp_path / "meso.npz", scripted_interface(1))
