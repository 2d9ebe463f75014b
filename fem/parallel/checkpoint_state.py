"""State of a checkpoint as typed entries, from which a run can restart on any partition.

A state is a tree of dictionaries whose leaves are entries: ``Rows`` and ``Shares`` belong to input nodes or cells,
``Sum`` and ``Log`` to the model, ``Same`` to every rank. To restart on another partition, a rank creates ``blank``
entries and merges the states of all old ranks into them one by one with ``take``.
"""

import hashlib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.parallel.local_mesh import positions


class Entry(Protocol):
    """Interface of one leaf of a state.

    Attributes:
        value: Stored value.
    """

    value: Any

    @property
    def layout(self) -> bytes:
        """Node or cell numbers of the entry on this rank, as bytes."""

    def blank(self) -> "Entry":
        """Return an empty entry for the same nodes or cells."""

    def take(self, part: Self, first: bool) -> None:
        """Merge the entry of one rank of another partition; ``first`` is True on one rank of the model."""


State = Mapping[str, "State | Entry"]


@dataclass(slots=True)
class Rows:
    """Values, shape (k, ...), at input nodes or cells, shape (k,), with equal copies on several ranks."""

    numbers: NDArray[np.int64]
    value: NDArray[np.float64]

    @property
    def layout(self) -> bytes:
        """Node or cell numbers as bytes."""
        return self.numbers.tobytes()

    def blank(self) -> "Rows":
        """Return rows filled with NaN."""
        return Rows(self.numbers, np.full_like(self.value, np.nan))

    def take(self, part: "Rows", first: bool) -> None:
        """Copy the rows of nodes or cells that the part has."""
        at = positions(part.numbers, self.numbers)
        self.value[at >= 0] = part.value[at[at >= 0]]


@dataclass(slots=True)
class Shares:
    """Values, shape (k, ...), at input nodes, shape (k,), to be summed over ranks; ``counted`` marks owned nodes."""

    numbers: NDArray[np.int64]
    value: NDArray[np.float64]
    counted: NDArray[np.bool_]

    @property
    def layout(self) -> bytes:
        """Node or cell numbers as bytes."""
        return self.numbers.tobytes()

    def blank(self) -> "Shares":
        """Return zeros at the same nodes."""
        return Shares(self.numbers, np.zeros_like(self.value), self.counted)

    def take(self, part: "Shares", first: bool) -> None:
        """Add the shares of the part at nodes owned here."""
        at = positions(part.numbers, self.numbers)
        is_merged = (at >= 0) & self.counted
        self.value[is_merged] += part.value[at[is_merged]]


@dataclass(slots=True)
class Sum:
    """Number or array to be summed over the ranks of the model; after a restart, the first rank has the total."""

    value: Any
    layout: ClassVar[bytes] = b""

    def blank(self) -> "Sum":
        """Return zero."""
        return Sum(0.0 * self.value)

    def take(self, part: "Sum", first: bool) -> None:
        """Add the part on the first rank."""
        if first:
            self.value = self.value + part.value


@dataclass(slots=True)
class Same:
    """Value that is equal on all ranks of the model."""

    value: Any
    layout: ClassVar[bytes] = b""

    def blank(self) -> "Same":
        """Return an entry without a value."""
        return Same(None)

    def take(self, part: "Same", first: bool) -> None:
        """Copy the value of any rank."""
        self.value = part.value


@dataclass(slots=True)
class Log:
    """Table of named arrays with equal lengths on the first rank, empty on the others."""

    value: dict[str, NDArray]
    layout: ClassVar[bytes] = b""

    def blank(self) -> "Log":
        """Return an empty table."""
        return Log({})

    def take(self, part: "Log", first: bool) -> None:
        """Copy the table from the rank that has it."""
        if first:
            self.value = self.value or part.value


ENTRIES = (Rows, Shares, Sum, Same, Log)


def _leaves(state: "State | Entry") -> Iterator[Entry]:
    """Yield all entries of a state in order."""
    if isinstance(state, Mapping):
        for node in state.values():
            yield from _leaves(node)
    else:
        yield state


def _map_state(state: "State | Entry", change: Callable[[Entry], Any]) -> Any:
    """Return the tree of a state with each entry replaced by ``change(entry)``."""
    if isinstance(state, Mapping):
        return {name: _map_state(node, change) for name, node in state.items()}
    return change(state)


def values(state: State) -> dict[str, Any]:
    """Return a state with each entry of its nested dictionaries replaced by a plain value, the argument of ``restore``.

    Args:
        state: State of this rank; its entries are values at nodes or cells, sums over ranks, or common values.
    """
    return _map_state(state, lambda entry: entry.value)


def blank(state: State) -> State:
    """Return a state (nested dictionaries of entries) with empty entries for the same nodes and cells.

    Args:
        state: State of this rank, unchanged; ``take`` fills the result from the states of other partitions.
    """
    return _map_state(state, lambda entry: entry.blank())


def layout(state: State) -> str:
    """Return a hexadecimal digest of the node and cell numbers of a state, equal only for equal partitions.

    Args:
        state: State of this rank, nested dictionaries of entries.
    """
    digest = hashlib.sha256()
    for entry in _leaves(state):
        digest.update(entry.layout)
    return digest.hexdigest()


def take(state: State, part: State, first: Collection[str]) -> None:
    """Merge the state of one rank of another partition into the state of this rank.

    A checkpoint can thus be continued on another number of ranks: each rank takes the states of all former ranks in
    turn, values at nodes and cells by their numbers, sums over ranks by addition.

    Args:
        state: State of this rank, nested dictionaries of entries created by ``blank``; changed in place.
        part: State of the other rank; missing names are skipped.
        first: Names in ``state`` that no lower rank has, so that this rank takes the sums.
    """
    for name in state.keys() & part.keys():
        _merge(state[name], part[name], name in first)


def _merge(node: "State | Entry", part: Any, first: bool) -> None:
    """Merge the entries of another rank into the entries at the same positions in the tree."""
    if not isinstance(node, Mapping):
        node.take(part, first)
        return
    for name in node.keys() & part.keys():
        _merge(node[name], part[name], first)


def is_complete(state: State) -> bool:
    """Return whether all rows of a state have been filled, i.e. none is NaN.

    Args:
        state: State of this rank, created by ``blank`` and filled by ``take``.
    """
    return not any(isinstance(entry, Rows) and np.isnan(entry.value).any() for entry in _leaves(state))
