"""A shock has settled when half a board period after the peak of the joints has no higher peak."""

import numpy as np
import pytest

from reflowshock.fem.output.settled import HISTORIES, half_oscillation, is_settled, latest_swings, needed_end

PERIOD = 4e-3


def history(end: float, stress, deflection=None) -> dict[str, np.ndarray]:
    """Return a synthetic history until an end time [s], from functions of time."""
    time = np.linspace(0.0, end, 401)
    swing = np.sin(2.0 * np.pi * time / PERIOD) if deflection is None else deflection(time)
    side = np.outer(stress(time), [1.0, 0.5])
    centre = np.outer(swing, [0.0, 0.0, 1e-3])
    stresses = dict(zip(HISTORIES[:4], (side, 0.4 * side, side, side), strict=True))
    return {"time": time, "board_centre": centre, **stresses}


def swinging(time):
    """Return peaks at a quarter and three quarters of the period, the second one lower."""
    return 1e7 * np.abs(np.sin(2.0 * np.pi * time / PERIOD)) * np.exp(-100.0 * time)


def test_half_a_swing_is_the_time_of_the_first_return():
    time = np.linspace(0.0, PERIOD, 401)
    assert half_oscillation(time, np.sin(2.0 * np.pi * time / PERIOD)) == pytest.approx(0.5 * PERIOD, rel=0.01)
    assert half_oscillation(time, time) is None


def test_a_trembling_before_the_swing_is_no_return():
    time = np.linspace(0.0, PERIOD, 401)
    swing = np.sin(2.0 * np.pi * time / PERIOD)
    swing[1:5] *= -1.0
    assert half_oscillation(time, swing) == pytest.approx(0.5 * PERIOD, rel=0.01)


@pytest.mark.parametrize(("share", "over"), [(0.4, False), (0.7, False), (0.76, True), (1.0, True)])
def test_it_is_over_half_a_swing_after_the_peak(share, over):
    assert is_settled(history(share * PERIOD, swinging)) is over


def test_a_higher_second_peak_makes_it_longer():
    def growing(time):
        return swinging(time) * np.exp(300.0 * time)

    assert not is_settled(history(1.0 * PERIOD, growing))


def test_a_peak_that_is_only_reached_again_is_not_higher():
    def creeping(time):
        return 1e7 * np.abs(np.sin(2.0 * np.pi * time / PERIOD)) * (1.0 + 0.5 * time)

    assert is_settled(history(0.9 * PERIOD, creeping))


def test_the_von_mises_stress_of_solder_that_hardens_need_not_settle():
    hard = history(PERIOD, swinging)
    hard["von_mises_board"] = np.outer(hard["time"], [1e11, 0.0])
    assert not is_settled(hard)
    assert is_settled(hard | {f"plastic_work_{end}": hard["von_mises_board"] for end in ("board", "package")})


def test_every_stress_has_to_settle():
    late = history(PERIOD, swinging)
    late["peel_package"] = np.outer(late["time"], [1e11, 0.0])
    assert not is_settled(late)


def test_without_joints_or_a_return_it_goes_on():
    bare = history(PERIOD, swinging)
    bare |= {name: bare[name][:, :0] for name in HISTORIES[:4]}
    assert not is_settled(bare)
    assert not is_settled(history(PERIOD, swinging, deflection=lambda time: time))


@pytest.mark.parametrize(("rate", "periods", "over"), [(200.0, 1.2, False), (200.0, 1.4, True), (30.0, 1.4, False)])
def test_a_damped_board_is_over_when_two_swings_have_decayed(rate, periods, over):
    """Stress peaks twice a period; two swings later it must be at most 0.9 of the largest."""

    def decaying(time):
        return 1e7 * np.abs(np.sin(2.0 * np.pi * time / PERIOD)) * np.exp(-rate * time)

    shock = history(periods * PERIOD, decaying)
    assert is_settled(shock, damped=True) is over
    assert is_settled(shock)
    assert needed_end(shock) == pytest.approx(0.75 * PERIOD, rel=0.1)


def test_a_later_larger_swing_postpones_the_end():
    def beating(time):
        return 1e7 * np.abs(np.sin(2.0 * np.pi * time / PERIOD)) * (1.0 + 0.3 * (time > 0.5 * PERIOD))

    shock = history(1.4 * PERIOD, beating)
    assert not is_settled(shock, damped=True) and latest_swings(shock) == 1.0
    assert needed_end(shock) == pytest.approx(1.25 * PERIOD, rel=0.05)
