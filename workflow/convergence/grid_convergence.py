"""Observed order, limit and grid convergence index of a figure that three meshes of different size have computed.

With h1 < h2 < h3 and values f1, f2, f3, the order p solves (f3 - f2) / (f2 - f1) = (h3^p - h2^p) / (h2^p - h1^p), which
is the equation of Celik et al., J. Fluids Eng. 130 (2008) 078001, for values that approach their limit from one side.
Grid convergence index and safety factors: Roache, J. Fluids Eng. 116 (1994) 405.
"""

from collections.abc import Sequence
from dataclasses import dataclass

SAFETY, SAFETY_WITHOUT_ORDER = 1.25, 3.0  # Roache 1994: with an observed order, and without
LEAST_ORDER, LARGEST_ORDER = 0.5, 3.5  # observed orders outside are not those of a method of second order
THEORETICAL_ORDER = 2.0  # of elements and time integration, if no order is observed


@dataclass(frozen=True, slots=True)
class GridConvergence:
    """Convergence of a figure under refinement.

    Attributes:
        index: Grid convergence index of the finest value, absolute, in the unit of the figure.
        order: Observed order; None without one in 0.5 to 3.5.
        limit: Value extrapolated to size zero; None without an order.
        how: Origin of the index, for readers.
    """

    index: float
    order: float | None
    limit: float | None
    how: str


def grid_convergence(sizes: Sequence[float], values: Sequence[float]) -> GridConvergence:
    """Return order, limit and grid convergence index of the finest of three values.

    Without an order, each coarser value gives an index with the theoretical order; the larger one counts.

    Args:
        sizes: Element sizes, the coarsest first.
        values: Computed values, one per size.

    Raises:
        ValueError: There are not three sizes that fall, or not one value for each.
    """
    if len(sizes) != 3 or len(values) != 3 or not sizes[0] > sizes[1] > sizes[2] > 0.0:
        raise ValueError(f"three falling sizes with a value each are required, not {sizes} and {values}")
    coarse, fine = values[0] - values[1], values[1] - values[2]
    if coarse == fine == 0.0:
        return GridConvergence(0.0, None, values[2], "the same on all three meshes")
    order = None
    if coarse * fine > 0.0:
        order = observed_order(sizes, coarse / fine, LEAST_ORDER, LARGEST_ORDER)
    if order is None:
        return GridConvergence(_index_without_order(sizes, values), None, None, _reason(coarse, fine))
    excess = fine / ((sizes[1] / sizes[2]) ** order - 1.0)
    return GridConvergence(SAFETY * abs(excess), order, values[2] - excess, f"order {order:.2g}")


def observed_order(sizes: Sequence[float], ratio: float, least: float, largest: float) -> float | None:
    """Return the order of three values within limits; None without one.

    Args:
        sizes: Element sizes, the coarsest first.
        ratio: Difference of the two coarser values over the difference of the two finer ones.
        least: Smallest accepted order.
        largest: Largest accepted order.
    """

    def excess(power: float) -> float:
        return (sizes[0] ** power - sizes[1] ** power) / (sizes[1] ** power - sizes[2] ** power) - ratio

    if excess(least) * excess(largest) > 0.0:
        return None
    from scipy.optimize import brentq  # deferred: plans do not need SciPy

    return float(brentq(excess, least, largest, xtol=1e-13))


def _index_without_order(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the larger grid convergence index of the two pairs of meshes that contain the finest one."""
    errors = (abs(values[k] - values[2]) / ((sizes[k] / sizes[2]) ** THEORETICAL_ORDER - 1.0) for k in range(2))
    return SAFETY_WITHOUT_ORDER * max(errors)


def _reason(coarse: float, fine: float) -> str:
    """Return why differences between three meshes have no order, with the safety factor."""
    if coarse * fine < 0.0:
        why = "the values oscillate"
    elif abs(coarse) > abs(fine):
        why = f"no order below {LARGEST_ORDER:g}"
    else:
        why = f"no order above {LEAST_ORDER:g}"
    return f"{why}, factor {SAFETY_WITHOUT_ORDER:g}"
