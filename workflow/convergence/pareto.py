"""The Pareto front: runs that no other beats in both error and cost."""

from collections.abc import Sequence


def front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Return which runs are on the front, the cheapest first.

    Args:
        costs: of each run.
        errors: of each run, equally many.
    """
    best, chosen = float("inf"), []
    for place in sorted(range(len(costs)), key=lambda k: (costs[k], errors[k])):
        if errors[place] < best:
            best = errors[place]
            chosen.append(place)
    return chosen
