"""A random trial: tables of parameters drawn by hypothesis for one trial, and the bounds that all of them keep."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st


@dataclass(frozen=True, slots=True)
class RandomTrial:
    """What is drawn, tried and judged.

    Attributes:
        name: as a file of a hard case would be called: family and what is random.
        title: what is tried.
        why: which invariants hold for all, and why.
        trial: name of the trial.
        tables: draws tables ``[parameters]`` as a file has them, quantities as text with units.
        bounds: as a file has them.
        share: how many of these for one of another random trial of the family.
        most_refused: largest share of cases that may be refused in words instead of tried.
    """

    name: str
    title: str
    why: str
    trial: str
    tables: st.SearchStrategy[dict[str, Any]]
    bounds: Mapping[str, Any]
    share: int = 1
    most_refused: float = 0.2


def quantities(low: float, high: float, unit: str) -> st.SearchStrategy[str]:
    """Draw quantities as a file has them, to four digits."""
    return st.floats(low, high).map(lambda value: f"{value:.4g} {unit}".strip())


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw plain numbers, to four digits."""
    return st.floats(low, high).map(lambda value: float(f"{value:.4g}"))
