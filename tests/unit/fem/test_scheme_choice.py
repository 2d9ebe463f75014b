"""The coupling scheme chosen for a scene, with its reason."""

import pytest

from reflowshock.fem.coupling.one_way import OneWay
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.division.division import choose_scheme


@pytest.mark.parametrize(
    "elastic, buffer_possible, scheme, reason",
    [
        (True, True, "local_steps", "linear elastic"),
        (True, False, "local_steps", "linear elastic"),
        (False, True, "held_velocity", "are path-dependent; layers of board fit"),
        (False, False, "gravouil_combescure", "no two layers of board fit"),
    ],
)
def test_scheme_follows_the_scene(elastic, buffer_possible, scheme, reason):
    choice = choose_scheme(elastic, buffer_possible)
    assert choice.scheme == scheme
    assert reason in choice.why


def test_every_scheme_is_made_in_an_order_of_both_models():
    for name in ("held_velocity", "local_steps", "impulse", "gravouil_combescure"):
        assert sorted(scheme_of(name).order) == ["macro", "meso"]
    assert isinstance(scheme_of("held_velocity", "one_way"), OneWay)
