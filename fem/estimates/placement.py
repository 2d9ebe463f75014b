"""Which ranks carry which model, and how long a window takes then: plain NumPy, from costs and speeds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from reflowshock.fem.errors import RankError
from reflowshock.fem.problem.shock import Ranks

Role = Literal["macro", "meso", "dns", "structure"]


@dataclass(frozen=True, slots=True)
class Placement:
    """Which ranks carry which model.

    Attributes:
        ranks: Ranks of each model, ascending; a rank that carries several takes turns in this order.
    """

    ranks: dict[Role, tuple[int, ...]]

    @property
    def name(self) -> Literal["shared", "disjoint"]:
        """Return whether all models are on the same ranks."""
        return "shared" if len(set(self.ranks.values())) == 1 else "disjoint"

    @property
    def words(self) -> str:
        """Return which ranks carry which model, for people."""
        if self.name == "shared":
            return f"shared by {len(next(iter(self.ranks.values())))}"
        return ", ".join(f"{role} on rank {'+'.join(map(str, ranks))}" for role, ranks in self.ranks.items())


@dataclass(frozen=True, slots=True)
class ModelCost:
    """What a window of one model costs.

    Attributes:
        work: Seconds that ranks share, on one of speed one.
        calls: Seconds that each of them spends, however many they are.
        sums: Sums over the nodes that they share, each a message.
    """

    work: float
    calls: float
    sums: int


@dataclass(frozen=True, slots=True)
class WindowCost:
    """What a window of two models costs.

    Attributes:
        macro: The macro model.
        meso: The meso model.
        latency: Seconds of a message.
        overlap: Whether models with ranks of their own work at the same time, as the scheme allows.
    """

    macro: ModelCost
    meso: ModelCost
    latency: float
    overlap: bool = True


@dataclass(frozen=True, slots=True)
class Alternative:
    """A placement and the predicted seconds of its window."""

    placement: Placement
    seconds: float


def shared(roles: Sequence[Role], size: int) -> Placement:
    """Return the placement of all models on all of ``size`` ranks."""
    return Placement(dict.fromkeys(roles, tuple(range(size))))


def disjoint(macro: Sequence[int], size: int) -> Placement:
    """Return the placement of the macro model on some of ``size`` ranks, of the meso model on all others."""
    others = tuple(rank for rank in range(size) if rank not in macro)
    return Placement({"macro": tuple(sorted(macro)), "meso": others})


def admissible(ranks: Ranks, speeds: Sequence[float]) -> Iterator[Placement]:
    """Yield the placements of two models that an input allows: with equal costs, the first is the simplest.

    A model's ranks are alike: the macro model takes the slowest or the fastest.

    Args:
        ranks: What the input asks for.
        speeds: Of each rank.
    """
    size = len(speeds)
    if ranks.placement != "disjoint":
        yield shared(("macro", "meso"), size)
    if ranks.placement == "shared":
        return
    order = np.argsort(speeds, kind="stable").tolist()
    for count in [ranks.macro] if ranks.macro else range(1, size):
        candidates = [disjoint(order[:count], size), disjoint(order[size - count :], size)]
        yield from candidates[: 2 if np.ptp(speeds) > 0.0 else 1]


def alternatives(ranks: Ranks, speeds: Sequence[float], cost: WindowCost) -> list[Alternative]:
    """Return all admissible placements of two models with their predicted windows, the fastest first."""
    found = [Alternative(item, window_seconds(item, speeds, cost)) for item in admissible(ranks, speeds)]
    return sorted(found, key=lambda item: item.seconds)


def least_seconds(ranks: Ranks, cost: WindowCost) -> float:
    """Return the predicted seconds of the fastest placement on ranks of speed one, however many these are."""
    size, found = ranks.total, []
    if ranks.placement != "disjoint":
        macro, meso = (model_seconds(model, size, size > 1, cost.latency) for model in (cost.macro, cost.meso))
        found.append(_together(cost, macro, meso, 2.0 * (size > 1)))
    if ranks.placement != "shared":
        for count in [ranks.macro] if ranks.macro else range(1, size):
            macro = model_seconds(cost.macro, count, count > 1, cost.latency)
            meso = model_seconds(cost.meso, size - count, size - count > 1, cost.latency)
            found.append(_together(cost, macro, meso, None))
    return min(found)


def window_seconds(placement: Placement, speeds: Sequence[float], cost: WindowCost) -> float:
    """Return the predicted seconds of a window: work over the speeds of those who do it, and messages.

    Ranks that carry both models do them one after the other, ranks that carry one wait for the slower model.
    """
    power = {role: sum(speeds[rank] for rank in ranks) for role, ranks in placement.ranks.items()}
    several = {role: len(ranks) > 1 for role, ranks in placement.ranks.items()}
    macro = model_seconds(cost.macro, power["macro"], several["macro"], cost.latency)
    meso = model_seconds(cost.meso, power["meso"], several["meso"], cost.latency)
    return _together(cost, macro, meso, 2.0 * several["macro"] if placement.name == "shared" else None)


def _together(cost: WindowCost, macro: float, meso: float, sharing: float | None) -> float:
    """Return the seconds of both models: in turn where ranks carry both, which exchange ``sharing`` messages."""
    if sharing is not None:
        return macro + meso + sharing * cost.latency
    return (max if cost.overlap else sum)((macro, meso)) + 2.0 * cost.latency


def model_seconds(cost: ModelCost, speed: float, several: bool, latency: float) -> float:
    """Return the predicted time of one window of one model [s].

    Args:
        cost: Cost of the window.
        speed: Sum of the speeds of the ranks.
        several: Whether the model is on more than one rank.
        latency: Time of one message [s].
    """
    return cost.work / speed + cost.calls + several * cost.sums * latency


def check_size(ranks: Ranks, size: int) -> None:
    """Check that the number of MPI ranks is that of the input.

    Raises:
        RankError: The numbers differ.
    """
    if size != ranks.total:
        raise RankError(f"the input asks for {ranks.total} ranks (ranks.total), mpirun started {size}")
