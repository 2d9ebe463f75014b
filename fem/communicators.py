"""Communicators of the models: one class that splits, owns and frees them."""

from types import TracebackType
from typing import Literal, Self

from mpi4py import MPI

from fem.errors import RankError
from fem.parameters import Ranks

Role = Literal["macro", "meso", "dns"]


class Communicators:
    """The communicator of this rank's model, and the one that joins all models.

    Placement ``split``: the first ``ranks.macro`` ranks carry the macro model, the others the meso model. A placement
    that gives both models to every rank would hand out two duplicates of ``world`` here and nowhere else.

    Attributes:
        world: All ranks of the run.
        model: The ranks of this rank's model.
        role: The model that this rank carries.
    """

    def __init__(self, world: MPI.Comm, mode: Literal["two_scale", "dns"], ranks: Ranks) -> None:
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
        self.role: Role = "dns" if mode == "dns" else "macro" if world.rank < ranks.macro else "meso"
        self.model = self.world.Split(["dns", "macro", "meso"].index(self.role), self.world.rank)

    def __enter__(self) -> Self:
        """Return self."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free both communicators, unless an error may have left other ranks inside a call on them."""
        if error is None:
            self.model.Free()
            self.world.Free()
