"""Gravouil-Combescure coupling: continuity of the interface, energy dissipation and momentum change."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.coupled import Coupled, models_of
from reflowshock.cases.hard.trials.pairs import FRACTION, SIZE, Pair
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.mesh.tie import net_load
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.library import SAC405
from reflowshock.materials.roles import Materials

KICK = np.array([0.3, 0.1, 1.0])  # [m/s]
LINK = Coupling(scheme="gravouil_combescure")


def kicked(pair: Pair) -> Coupled:
    """Return a coupled pair whose lower board layers have a velocity: a jump in space, the least smooth motion."""
    coupled = pair.coupled(LINK)
    motion = coupled.macro.motion
    motion.launch(KICK)
    motion.velocity[motion.body.local.points[:, 2] > -0.6 * SIZE] = 0.0
    return coupled


def gap(coupled: Coupled) -> np.ndarray:
    """Return the gap at the interface, shape (nc, 3) [m]: displacements plus (step / 2)^2 times its acceleration."""
    moved = []
    for part in coupled.parts:
        motion, interface = part.motion, part.motion.body.interface
        moved.append(motion.displacement[interface] + 0.25 * motion.step**2 * motion.acceleration(interface))
    return moved[0] - moved[1]


def link_momentum(coupled: Coupled) -> np.ndarray:
    """Return the momentum that corresponds to the gap at the interface, shape (6,)."""
    body = coupled.macro.motion.body
    impulse = 2.0 * body.mass[body.interface, None] / coupled.plan.window * gap(coupled)
    return net_load(body.local.points[body.interface], impulse)


@pytest.mark.parametrize("pair", [Pair(5, 10.0, 2, free=True), Pair(40, 0.1, 8, free=True)], ids=["stiff", "soft"])
def test_interface_dissipates_exactly_the_missing_energy(pair):
    coupled = kicked(pair)
    totals, taken = [], []
    for _ in range(400):
        energies = coupled.energies()
        totals.append(energies["kinetic"] + energies["internal"] + energies["interface"])
        taken.append(energies["interface"])
        coupled.run()
    assert np.ptp(totals) < 1e-9 * totals[0]
    assert min(taken) > -5e-3 * totals[0]  # only the energy of the accelerations is guaranteed not to grow
    assert taken[-1] < 0.6 * totals[0]  # for a motion of single elements; smooth motions are tested below


def test_smooth_motion_is_damped_little():
    """Modes with at least twenty windows per period have a damping ratio of at most 1e-2."""
    factor = np.linalg.eigvals(Pair(4, 3.0, 2).coupled(LINK).matrix())
    factor = factor[(np.abs(factor.imag) > 1e-6) & (np.abs(factor) > 0.5)]
    angle = np.abs(np.angle(factor))
    slow = angle < 0.3
    ratio = -np.log(np.abs(factor[slow])) / angle[slow]
    assert slow.sum() >= 10
    assert 1e-6 < ratio.max() < 1e-2


def test_momentum_changes_by_the_momentum_of_the_gap():
    coupled = kicked(Pair(5, 3.0, 2, free=True))
    start, link = coupled.momentum(), link_momentum(coupled)
    scale = np.abs(start).max() * np.array([1.0] * 3 + [SIZE] * 3)
    errors = []
    for _ in range(400):
        coupled.run()
        assert np.all(np.abs(coupled.momentum() - link_momentum(coupled) - start + link) < 1e-10 * scale)
        errors.append(np.abs((coupled.momentum() - start) / scale).max())
    assert 1e-8 < max(errors) < 1e-2  # momentum alone is not conserved, as the module docstring says


def test_free_flight_stays_free_of_forces():
    coupled = Pair(5, 3.0, 8, free=True).coupled(LINK)
    for part in coupled.parts:
        part.motion.launch(KICK)
    start = coupled.momentum()
    for _ in range(200):
        coupled.run()
    assert np.abs(coupled.momentum() - start).max() < 1e-12 * np.abs(start).max()
    assert coupled.energies()["internal"] < 1e-12 * np.abs(start).max()


def test_solder_that_yields_is_linked_stably():
    """The energy around a path-dependent block does not exceed the initial energy."""
    models = models_of(Pair(ratio=2).mesh(), Materials(solder=SAC405), LINK, FRACTION)
    coupled = Coupled(models.bodies(), models.division.plan, scheme_of("gravouil_combescure"))
    assert coupled.plan.substeps > 1
    for part in coupled.parts:
        part.motion.launch(np.array([0.0, 0.0, 20.0]))
    initial = coupled.energies()["kinetic"]
    for _ in range(300):
        coupled.run()
    energies = coupled.energies()
    assert energies["plastic"] > 1e-3 * initial
    held = sum(energies[name] for name in ("kinetic", "internal", "plastic", "hourglass", "interface"))
    assert held == pytest.approx(initial, rel=5e-3)
    assert energies["interface"] > -1e-3 * initial


def test_one_way_is_refused():
    with pytest.raises(ValueError, match="gravouil_combescure does not support direction = one_way"):
        scheme_of("gravouil_combescure", "one_way")
