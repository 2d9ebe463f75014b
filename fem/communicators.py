"""Communicators of the models: one class that splits, owns and frees them."""

from types import TracebackType
from typing import Literal, Self

from mpi4py import MPI

from fem.errors import RankError
from fem.parameters import Ranks

Role = Literal["macro", "meso", "dns", "structure"]


class Communicators:
    """The communicators of the models on this rank, and the one that joins all models.

    Placement ``split``: the first ``ranks.macro`` ranks carry the macro model, the others the meso model. Placement
    ``shared``: every rank carries both.

    Attributes:
        world: All ranks of the run.
        models: The ranks of each model that this rank carries, in the order of the window.
        first: Lowest rank of ``world`` that carries each model.
    """

    def __init__(self, world: MPI.Comm, mode: Literal["two_scale", "dns", "structure"], ranks: Ranks) -> None:
        """Split ``world``.

        Raises:
            RankError: ``world`` has not the number of ranks that the input asks for.
        """
        expected = ranks.macro + ranks.meso
        if mode == "two_scale" and world.size != expected:
            raise RankError(
                f"the input asks for {ranks.macro} macro + {ranks.meso} meso ranks, mpirun started {world.size}"
            )
        self.world = world.Dup()
        roles: tuple[Role, ...] = ("macro", "meso") if mode == "two_scale" else (mode,)
        split = mode == "two_scale" and ranks.placement == "split"
        self.first = {role: ranks.macro if split and role == "meso" else 0 for role in roles}
        if split:
            role = roles[world.rank >= ranks.macro]
            self.models = {role: self.world.Split(roles.index(role), self.world.rank)}
        else:
            self.models = {role: self.world.Dup() for role in roles}

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
