"""Communicators of the models: one class that splits, owns and frees them."""

from types import TracebackType
from typing import Self

from mpi4py import MPI

from reflowshock.fem.estimates.placement import Placement, Role
from reflowshock.fem.parallel.whereabouts import HERE


class Communicators:
    """The communicators of the models on this rank, and the one that joins all models.

    Attributes:
        world: All ranks of the run.
        placement: Which ranks carry which model.
        models: The ranks of each model that this rank carries, in the order of the window.
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
        HERE.carry(self.models)

    def __enter__(self) -> Self:
        """Return self."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free all communicators, unless an error may have left other ranks inside a call on them."""
        if error is None:
            for model in self.models.values():
                model.Free()
            self.world.Free()
