"""Placement of models on MPI ranks: admissible placements and the predicted time of a window."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from reflowshock.fem.errors import RankError
from reflowshock.fem.problem.shock import Ranks

Role = Literal["macro", "meso", "dns", "structure"]


@dataclass(frozen=True, slots=True)
class Placement:
    """Ranks of each model.

    Attributes:
        ranks: Ascending ranks of each model; a rank with several models computes them in this order.
    """

    ranks: dict[Role, tuple[int, ...]]

    @property
    def name(self) -> Literal["shared", "disjoint"]:
        """Name of the placement: shared if all models are on the same ranks, else disjoint."""
        return "shared" if len(set(self.ranks.values())) == 1 else "disjoint"

    @property
    def words(self) -> str:
        """Placement as text for reports."""
        if self.name == "shared":
            return f"shared by {len(next(iter(self.ranks.values())))}"
        return ", ".join(f"{role} on rank {'+'.join(map(str, ranks))}" for role, ranks in self.ranks.items())


@dataclass(frozen=True, slots=True)
class ModelCost:
    """Cost of a window of one model.

    Attributes:
        work: Time divided among the ranks, on one rank of speed one [s].
        calls: Time spent by every rank [s].
        sums: Number of sums over shared nodes, one message each.
    """

    work: float
    calls: float
    sums: int


@dataclass(frozen=True, slots=True)
class WindowCost:
    """Cost of a window of two models.

    Attributes:
        macro: Cost of the macro model.
        meso: Cost of the meso model.
        latency: Time of one message [s].
        overlap: Whether the coupling scheme lets models on disjoint ranks compute at the same time.
    """

    macro: ModelCost
    meso: ModelCost
    latency: float
    overlap: bool = True


@dataclass(frozen=True, slots=True)
class Alternative:
    """Placement with the predicted time of its window [s]."""

    placement: Placement
    seconds: float


def shared(roles: Sequence[Role], size: int) -> Placement:
    """Return the placement of all models on all ranks, which compute them in turn.

    Args:
        roles: Models (``macro``, ``meso`` or ``dns``) in the order in which a rank computes them.
        size: Number of ranks.

    Returns:
        Ranks of each model, all of them in ascending order.
    """
    return Placement(dict.fromkeys(roles, tuple(range(size))))


def disjoint(macro: Sequence[int], size: int) -> Placement:
    """Return the placement with the macro model on some ranks and the meso model on all others.

    Args:
        macro: Ranks of the macro model, from 0.
        size: Number of all ranks.

    Returns:
        Ranks of each model in ascending order.
    """
    others = tuple(rank for rank in range(size) if rank not in macro)
    return Placement({"macro": tuple(sorted(macro)), "meso": others})


def _admissible(ranks: Ranks, speeds: Sequence[float]) -> Iterator[Placement]:
    """Yield the placements of two models that an input allows, the simplest first.

    In disjoint placements the macro model takes the slowest or the fastest ranks, so ranks of a model are alike.

    Args:
        ranks: Requested ranks and placement.
        speeds: Relative speed of each rank.
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
    """Return all admissible placements of two models with the predicted time of a window [s], the fastest first.

    Args:
        ranks: Number of ranks and allowed placements, from the input.
        speeds: Relative speed of each rank, 1 for the reference.
        cost: Predicted cost of a window of both models.
    """
    candidates = [Alternative(item, window_seconds(item, speeds, cost)) for item in _admissible(ranks, speeds)]
    return sorted(candidates, key=lambda item: item.seconds)


def least_seconds(ranks: Ranks, cost: WindowCost) -> float:
    """Return the predicted time of a window (between two exchanges of the models) in the fastest placement [s].

    Args:
        ranks: Number of ranks, all of speed one, and allowed placements.
        cost: Cost of the window for both models.
    """
    size, seconds = ranks.most, []
    if ranks.placement != "disjoint":
        macro, meso = (model_seconds(model, size, size > 1, cost.latency) for model in (cost.macro, cost.meso))
        seconds.append(_together(cost, macro, meso, 2.0 * (size > 1)))
    if ranks.placement != "shared":
        for count in [ranks.macro] if ranks.macro else range(1, size):
            macro = model_seconds(cost.macro, count, count > 1, cost.latency)
            meso = model_seconds(cost.meso, size - count, size - count > 1, cost.latency)
            seconds.append(_together(cost, macro, meso, None))
    return min(seconds)


def window_seconds(placement: Placement, speeds: Sequence[float], cost: WindowCost) -> float:
    """Return the predicted time of a window [s]: work over the speeds of its ranks, plus messages.

    A window is the time between two exchanges of the models. Ranks with both models compute them in turn; ranks with
    one model wait for the slower model.

    Args:
        placement: Ranks of each model.
        speeds: Relative speed of each rank, 1 for the reference.
        cost: Cost of the window for both models.
    """
    power = {role: sum(speeds[rank] for rank in ranks) for role, ranks in placement.ranks.items()}
    several = {role: len(ranks) > 1 for role, ranks in placement.ranks.items()}
    macro = model_seconds(cost.macro, power["macro"], several["macro"], cost.latency)
    meso = model_seconds(cost.meso, power["meso"], several["meso"], cost.latency)
    return _together(cost, macro, meso, 2.0 * several["macro"] if placement.name == "shared" else None)


def _together(cost: WindowCost, macro: float, meso: float, sharing: float | None) -> float:
    """Return the time of both models [s]: in turn with ``sharing`` messages, or on disjoint ranks if that is None."""
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
    """Check that the number of MPI ranks is one that ``ranks.total`` of the input allows.

    Args:
        ranks: Rank settings of the input.
        size: Number of MPI ranks of the run.

    Raises:
        RankError: The input asks for another number, or for ranks of each model and there is only one.
    """
    if not (size == ranks.total or (ranks.total == "auto" and size >= ranks.least)):
        raise RankError(f"the input asks for {ranks.total} ranks (ranks.total), mpirun started {size}")
