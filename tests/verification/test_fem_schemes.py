"""Requirements on each coupling scheme: DNS at equal steps, energy balance, order and restart."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.coupled import Coupled
from reflowshock.cases.hard.trials.pairs import SCHEMES, Pair
from reflowshock.fem.dynamics.energy_balance import EnergyBalance
from reflowshock.fem.errors import EnergyError
from reflowshock.fem.parallel.checkpoint_state import values

PUSH = np.array([0.3, 0.1, 1.0])  # [m/s]
WITH_LEVELS = "held_velocity, levels auto"
OF_TWO_STEPS = [name for name, coupling in SCHEMES.items() if coupling.scheme != "local_steps"]


def pushed(scheme: str, pair: Pair, fraction: float = 0.9) -> Coupled:
    """Return a pair of models coupled by a scheme, after a push."""
    coupled = pair.coupled(SCHEMES[scheme], fraction)
    coupled.swing(PUSH)
    return coupled


def twins(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the number of the node in ``others`` nearest to each point, shape (n,)."""
    return np.array([np.argmin(np.linalg.norm(others - point, axis=1)) for point in points])


def parallel_dns(coupled: Coupled, pair: Pair):
    """Return a DNS at the small step of the coupled models from their state, and the macro nodes in it."""
    body, _ = dns_body(pair.mesh(), materials=pair.materials())
    dns = motion_of(body, coupled.plan.step)
    for part in coupled.parts:
        motion = part.motion
        moving = motion.mobility.any(axis=1)
        twin = twins(motion.body.local.points[moving], body.local.points)
        dns.velocity[twin] = motion.velocity[moving]
    return dns, twins(coupled.macro.motion.body.local.points, body.local.points)


@pytest.mark.parametrize("scheme", OF_TWO_STEPS)
def test_one_substep_a_window_is_the_dns(scheme):
    pair = Pair(substeps=1, ratio=2)
    coupled = pushed(scheme, pair)
    assert coupled.plan.substeps == 1
    dns, twin = parallel_dns(coupled, pair)
    for _ in range(300):
        coupled.run()
        dns.advance()
        dns.update_force()
    macro = coupled.macro.motion.displacement
    assert np.abs(macro - dns.displacement[twin]).max() < 1e-11 * np.abs(macro).max()


@pytest.mark.parametrize("scheme", OF_TWO_STEPS)
def test_displacements_are_of_second_order_in_the_window(scheme):
    errors = []
    for fraction in (0.8, 0.4):
        pair = Pair(4, 2.0, 2)
        coupled = pushed(scheme, pair, fraction)
        dns, twin = parallel_dns(coupled, pair)
        error, size = 0.0, 0.0
        for _ in range(round(80 / fraction)):
            coupled.run()
            for _ in range(coupled.plan.substeps):
                dns.advance()
                dns.update_force()
            error += float(np.sum((coupled.macro.motion.displacement - dns.displacement[twin]) ** 2))
            size += float(np.sum(dns.displacement[twin] ** 2))
        errors.append(np.sqrt(error / size))
    assert errors[0] < 0.06  # three elements across the wave
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.6)


def change_of_the_sum(coupled: Coupled) -> float:
    """Return the relative change of model energy plus interface energy over 200 windows."""
    sums = []
    for _ in range(200):
        sums.append(coupled.held() + coupled.energies()["interface"])
        coupled.run()
    return np.ptp(sums) / sums[0]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_model_and_interface_energy_are_conserved(scheme):
    coupled = pushed(scheme, Pair(3 if scheme == WITH_LEVELS else 5, 3.0, 2, free=True))
    assert len(coupled.meso.motion.body.schedule) == 1
    assert change_of_the_sum(coupled) < 1e-11


def test_energy_between_path_levels_is_small():
    coupled = pushed(WITH_LEVELS, Pair(5, 3.0, 2, free=True))
    assert len(coupled.meso.motion.body.schedule) == 2
    assert change_of_the_sum(coupled) < 1e-3


@pytest.mark.parametrize("scheme", SCHEMES)
def test_run_continues_from_its_state_bitwise(scheme):
    pair = Pair(3, 3.0, 2, layers=3)
    first, second = pushed(scheme, pair), pair.coupled(SCHEMES[scheme])
    for _ in range(20):
        first.run()
    for ours, others in zip(second.parts, first.parts, strict=True):
        ours.restore(values(others.state()))
    for _ in range(20):
        first.run()
        second.run()
    for ours, others in zip(second.parts, first.parts, strict=True):
        assert np.array_equal(ours.motion.displacement, others.motion.displacement)
        assert ours.interface_work == others.interface_work


def test_interface_energy_is_reported_separately():
    coupled = pushed("held_velocity", Pair(4, 3.0, 2, layers=3))
    balance = EnergyBalance(limit=1e-4, trivial=0.0)
    balance.judge(coupled.sums(), 0.0)
    with pytest.raises(EnergyError, match="the coupling interface accounts for most of the imbalance"):
        for window in range(1, 200):
            coupled.run()
            balance.judge(coupled.sums(), window * coupled.plan.window)
