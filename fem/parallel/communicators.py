"""Communicators of the models of a run, split, owned and freed by one class."""

from types import TracebackType
from typing import Self

from mpi4py import MPI

from reflowshock.fem.estimates.placement import Placement, Role
from reflowshock.fem.parallel.rank_activity import ACTIVITY


class Communicators:
    """Communicators of the models on this rank, and of all models together.

    Attributes:
        world: Communicator of all ranks of the run.
        placement: Assignment of models to ranks.
        models: Communicator of each model on this rank, in the order of the window.
        first: Lowest rank of ``world`` that carries each model.
    """

    def __init__(self, world: MPI.Comm, placement: Placement) -> None:
        """Split ``world``; collective."""
        self.world, self.placement = world.Dup(), placement
        self.first = {role: ranks[0] for role, ranks in placement.ranks.items()}
        split = {
            role: self.world.Split(0 if world.rank in ranks else MPI.UNDEFINED, world.rank)
            for role, ranks in placement.ranks.items()
        }
        self.models: dict[Role, MPI.Comm] = {role: comm for role, comm in split.items() if comm != MPI.COMM_NULL}
        ACTIVITY.carry(self.models)

    def __enter__(self) -> Self:
        """Return self."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free all communicators, unless an error may have left other ranks inside a call to one of them."""
        if error is None:
            for model in self.models.values():
                model.Free()
            self.world.Free()
