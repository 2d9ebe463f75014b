"""Portable states: entries that say what they are, so that any division into ranks can continue from them.

A state is a tree of dictionaries by name whose leaves are entries. ``Rows`` and ``Shares`` belong to input nodes or
cells, ``Sum`` and ``Log`` to the model, ``Same`` to every rank. A rank takes its part of another division from the
states of all its ranks, one after the other: ``blank`` entries of its own, then ``take`` with each of those.
"""

import hashlib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.parallel.local_mesh import positions


class Entry(Protocol):
    """One leaf of a state.

    Attributes:
        value: What the owner of the state keeps.
    """

    value: Any

    @property
    def place(self) -> bytes:
        """Return the numbers that tie the entry to this rank's part of a mesh, as bytes."""

    def blank(self) -> "Entry":
        """Return an entry for the same nodes or cells that has taken nothing yet."""

    def take(self, part: Self, first: bool) -> None:
        """Take what the entry of one rank of another division has; ``first`` on one rank of the model."""


State = Mapping[str, "State | Entry"]


@dataclass(slots=True)
class Rows:
    """Values ``(k, ...)`` at input nodes or cells ``numbers (k,)``; copies on several ranks are equal."""

    numbers: NDArray[np.int64]
    value: NDArray[np.float64]

    @property
    def place(self) -> bytes:
        """Return the numbers."""
        return self.numbers.tobytes()

    def blank(self) -> "Rows":
        """Return rows that are no numbers."""
        return Rows(self.numbers, np.full_like(self.value, np.nan))

    def take(self, part: "Rows", first: bool) -> None:
        """Take the rows that the part has."""
        at = positions(part.numbers, self.numbers)
        self.value[at >= 0] = part.value[at[at >= 0]]


@dataclass(slots=True)
class Shares:
    """Values ``(k, ...)`` at input nodes ``numbers (k,)`` whose sum over ranks counts; ``counted (k,)`` of owners."""

    numbers: NDArray[np.int64]
    value: NDArray[np.float64]
    counted: NDArray[np.bool_]

    @property
    def place(self) -> bytes:
        """Return the numbers."""
        return self.numbers.tobytes()

    def blank(self) -> "Shares":
        """Return zeros."""
        return Shares(self.numbers, np.zeros_like(self.value), self.counted)

    def take(self, part: "Shares", first: bool) -> None:
        """Add the part's shares of nodes that count here."""
        at = positions(part.numbers, self.numbers)
        here = (at >= 0) & self.counted
        self.value[here] += part.value[at[here]]


@dataclass(slots=True)
class Sum:
    """A number or array whose sum over the ranks of the model counts; the first rank gets it all."""

    value: Any
    place: ClassVar[bytes] = b""

    def blank(self) -> "Sum":
        """Return zero."""
        return Sum(0.0 * self.value)

    def take(self, part: "Sum", first: bool) -> None:
        """Add the part."""
        if first:
            self.value = self.value + part.value


@dataclass(slots=True)
class Same:
    """Something that is equal on all ranks of the model."""

    value: Any
    place: ClassVar[bytes] = b""

    def blank(self) -> "Same":
        """Return nothing."""
        return Same(None)

    def take(self, part: "Same", first: bool) -> None:
        """Take any rank's."""
        self.value = part.value


@dataclass(slots=True)
class Log:
    """A table that the first rank keeps, arrays by name whose rows are those of a list; empty on the others."""

    value: dict[str, NDArray]
    place: ClassVar[bytes] = b""

    def blank(self) -> "Log":
        """Return an empty table."""
        return Log({})

    def take(self, part: "Log", first: bool) -> None:
        """Take the table of the rank that has it."""
        if first:
            self.value = self.value or part.value


ENTRIES = (Rows, Shares, Sum, Same, Log)


def leaves(state: "State | Entry") -> Iterator[Entry]:
    """Walk over all entries of a state, in order."""
    if isinstance(state, Mapping):
        for node in state.values():
            yield from leaves(node)
    else:
        yield state


def mapped(state: "State | Entry", change: Callable[[Entry], Any]) -> Any:
    """Return a tree like ``state`` with something else in place of each entry."""
    if isinstance(state, Mapping):
        return {name: mapped(node, change) for name, node in state.items()}
    return change(state)


def values(state: State) -> dict[str, Any]:
    """Return the tree of the entries' values, which ``restore`` takes."""
    return mapped(state, lambda entry: entry.value)


def blank(state: State) -> State:
    """Return the state of the same rank that has taken nothing yet."""
    return mapped(state, lambda entry: entry.blank())


def place(state: State) -> str:
    """Return a digest of the nodes and cells that a state belongs to."""
    digest = hashlib.sha256()
    for entry in leaves(state):
        digest.update(entry.place)
    return digest.hexdigest()


def take(state: State, part: State, first: Collection[str]) -> None:
    """Take what the state of one rank of another division has for this one; what that rank lacks is left out.

    Args:
        state: Of this rank, begun as ``blank``.
        part: Of that rank.
        first: Which names of ``state`` no rank before this one has.
    """
    for name in state.keys() & part.keys():
        merge(state[name], part[name], name in first)


def merge(node: "State | Entry", part: Any, first: bool) -> None:
    """Let each entry take the one at its place in the tree of another rank."""
    if not isinstance(node, Mapping):
        node.take(part, first)
        return
    for name in node.keys() & part.keys():
        merge(node[name], part[name], first)


def is_complete(state: State) -> bool:
    """Return whether no row of a state is left that no other rank had."""
    return not any(isinstance(entry, Rows) and np.isnan(entry.value).any() for entry in leaves(state))
