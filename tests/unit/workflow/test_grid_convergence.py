"""Observed order, limit and grid convergence index of three meshes."""

from math import log

import pytest

from reflowshock.workflow.convergence.grid_convergence import grid_convergence

SIZES = (2.0, 1.5, 1.0)


@pytest.mark.parametrize("order", [0.51, 1.0, 1.7, 2.0, 3.49])
@pytest.mark.parametrize("error", [0.2, -3.0e6])
def test_order_limit_and_index_are_exact_for_a_power_of_the_size(order, error):
    found = grid_convergence(SIZES, [5.0 * error + error * size**order for size in SIZES])
    assert found.order == pytest.approx(order, abs=1e-9)
    assert found.limit == pytest.approx(5.0 * error)
    assert found.index == pytest.approx(1.25 * abs(error))
    assert found.how == f"order {order:.2g}"


def test_order_fulfils_the_equation_of_celik():
    """The equation that is solved there by a fixed point: p = ln|e32/e21| + ln((r21^p - 1)/(r32^p - 1)) over ln r21."""
    values = (1.40, 1.16, 1.0)
    order = grid_convergence(SIZES, values).order
    shift = log((1.5**order - 1.0) / ((2.0 / 1.5) ** order - 1.0))
    assert order == pytest.approx((log(0.24 / 0.16) + shift) / log(1.5))


@pytest.mark.parametrize(
    ("values", "index", "how"),
    [
        ((1.2, 0.9, 1.0), 3.0 * 0.1 / 1.25, "the values oscillate, factor 3"),
        ((1.4, 0.9, 1.0), 3.0 * 0.4 / 3.0, "the values oscillate, factor 3"),
        ((1.15, 1.1, 1.0), 3.0 * 0.1 / 1.25, "no order above 0.5, factor 3"),
        ((1.6, 1.1, 1.0), 3.0 * 0.6 / 3.0, "no order below 3.5, factor 3"),
        ((1.5, 1.0, 1.0), 3.0 * 0.5 / 3.0, "no order below 3.5, factor 3"),
        ((1.0, 1.0, 1.0), 0.0, "the same on all three meshes"),
    ],
)
def test_figures_without_order_have_the_larger_safety_factor(values, index, how):
    found = grid_convergence(SIZES, values)
    assert found.index == pytest.approx(index) and found.how == how and found.order is None


@pytest.mark.parametrize("sizes", [(2.0, 1.0), (1.0, 1.5, 2.0), (2.0, 1.5, 0.0)])
def test_sizes_must_be_three_and_fall(sizes):
    with pytest.raises(ValueError, match="three falling sizes"):
        grid_convergence(sizes, (1.0,) * len(sizes))
