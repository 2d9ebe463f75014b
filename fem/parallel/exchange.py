"""Messages between ranks: sums over shared nodes, and channels across the coupling interface.

Sums are taken in rank order, so the copies of a shared node stay bit-identical. Results on different numbers of ranks
differ only by round-off.
"""

import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from reflowshock.fem.kernels.motion import pack, sum_in_rank_order, unpack
from reflowshock.fem.parallel.rank_activity import ACTIVITY
from reflowshock.fem.parallel.waiting import wait_for

SHARED_TAG, CHANNEL_TAG = 11, 12


@dataclass(slots=True)
class MessageClock:
    """Time that a rank spends on messages: packing and unpacking [s], waiting for them [s]."""

    packing: float = 0.0
    waiting: float = 0.0

    def count(self, begin: float, packed: float, arrived: float) -> None:
        """Add a message from its start, packing and arrival times [s]; it is unpacked now."""
        self.packing += packed - begin + time.perf_counter() - arrived
        self.waiting += arrived - packed


def _holders(comm: MPI.Comm, nodes: NDArray[np.integer]) -> list[NDArray[np.int64]]:
    """Determine the nodes that this rank shares with each other rank; collective.

    Each node number has a home rank (number modulo size) that collects its holders, so no rank ever sees all nodes.

    Args:
        comm: Communicator of the model.
        nodes: Unique node numbers of this rank, shape (n,).

    Returns:
        Shared node numbers in ascending order for each rank; empty for this rank itself.
    """
    nodes = np.sort(np.asarray(nodes, np.int64))
    arrived = comm.alltoall([nodes[nodes % comm.size == home] for home in range(comm.size)])
    number = np.concatenate(arrived)
    rank = np.repeat(np.arange(comm.size), [len(part) for part in arrived])
    order = np.lexsort((rank, number))
    number, rank = number[order], rank[order]
    pairs = [np.empty((0, 3), np.int64)]
    for distance in range(1, min(comm.size, len(number))):  # holders of a node are neighbours in the sorted table
        same = np.flatnonzero(number[distance:] == number[:-distance])
        pairs.append(np.column_stack([number[same], rank[same], rank[same + distance]]))
        pairs.append(np.column_stack([number[same], rank[same + distance], rank[same]]))
    table = np.concatenate(pairs)
    shared = np.concatenate(comm.alltoall([table[table[:, 1] == holder][:, [0, 2]] for holder in range(comm.size)]))
    return [np.sort(shared[shared[:, 1] == other, 0]) for other in range(comm.size)]


class SharedNodes:
    """Sums over the copies of shared nodes, with one persistent message per neighbouring rank.

    Attributes:
        owned: Whether this rank is the lowest that has the node, shape (n,).
        clock: Time spent on messages.
    """

    def __init__(self, comm: MPI.Comm, nodes: NDArray[np.integer], clock: MessageClock | None = None) -> None:
        """Determine the copies of this rank's nodes, shape (n,), and prepare the messages; collective."""
        self.clock = clock or MessageClock()
        shared = _holders(comm, nodes)
        order = np.argsort(nodes)
        local = [order[np.searchsorted(nodes, numbers, sorter=order)].astype(np.int32) for numbers in shared]
        self.owned = np.ones(len(nodes), dtype=bool)
        for other in range(comm.rank):
            self.owned[local[other]] = False
        self._rows = np.concatenate(local)
        self._sent, self._received = np.empty((len(self._rows), 3)), np.empty((len(self._rows), 3))
        self._requests = []
        start = 0
        for other, rows in enumerate(local):
            part = slice(start, start + len(rows))
            start += len(rows)
            if len(rows):
                self._requests.append(comm.Recv_init(self._received[part], other, SHARED_TAG))
                self._requests.append(comm.Send_init(self._sent[part], other, SHARED_TAG))
        neighbours = [other for other, rows in enumerate(local) if len(rows)]
        self._mark = f"the sum over shared nodes with {ACTIVITY.names(comm, neighbours)}"
        ranks = np.repeat(np.arange(comm.size), [len(rows) for rows in local])
        self._nodes, self._pointer, self._source = rank_order(self._rows, ranks, comm.rank)

    def add(self, values: NDArray[np.float64]) -> None:
        """Replace the rows of shared nodes, of shape (n, 3) values, by their sums over ranks; collective."""
        if self._requests:
            begin = time.perf_counter()
            pack(values, self._rows, self._sent)
            packed = time.perf_counter()
            ACTIVITY.wait_for(self._mark)
            MPI.Prequest.Startall(self._requests)
            wait_for(self._requests)
            ACTIVITY.go_on()
            arrived = time.perf_counter()
            sum_in_rank_order(self._nodes, self._pointer, self._source, self._received, values)
            self.clock.count(begin, packed, arrived)

    @property
    def exchanged(self) -> bool:
        """Whether another rank has any of the nodes."""
        return bool(self._requests)

    def free(self) -> None:
        """Free the persistent requests."""
        for request in self._requests:
            request.Free()
        self._requests = []


def rank_order(
    rows: NDArray[np.int32], ranks: NDArray[np.int64], own_rank: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Return the order in which the contributions to each shared node are summed, by rank.

    Args:
        rows: Local node of each received row, shape (k,).
        ranks: Sending rank of each received row, shape (k,).
        own_rank: This rank.

    Returns:
        Shared nodes in ascending order, shape (m,); pointers, shape (m + 1,), to the range of sources of each node; and
        sources: index of a received row or -1 for this rank's own value, by ascending rank, shape (k + m,). They are
        arguments of ``kernels.motion.sum_in_rank_order``.
    """
    nodes = np.unique(rows)
    node = np.concatenate([rows, nodes])
    rank = np.concatenate([ranks, np.full(len(nodes), own_rank)])
    source = np.concatenate([np.arange(len(rows)), np.full(len(nodes), -1)])
    order = np.lexsort((rank, node))
    pointer = np.concatenate([[0], np.cumsum(np.bincount(np.searchsorted(nodes, node), minlength=len(nodes)))])
    return nodes.astype(np.int32), pointer.astype(np.int32), source[order].astype(np.int32)


class Messages(Protocol):
    """Interface of a channel for interface values."""

    @property
    def clock(self) -> MessageClock:
        """Time spent on messages."""

    def send(self, values: NDArray[np.float64]) -> None:
        """Send the interface rows of values, shape (n, 3)."""

    def receive(self, values: NDArray[np.float64]) -> None:
        """Receive the interface rows of values, shape (n, 3)."""

    def free(self) -> None:
        """Free the resources of the channel."""


class Channel:
    """Messages of interface values from the ranks of one model to the ranks of another.

    A rank with both models copies its values without a message. Otherwise the lowest rank that has an interface node of
    the source sends it to every rank that has this node of the target.

    Attributes:
        clock: Time spent on messages.
    """

    def __init__(
        self, comm: MPI.Comm, source: NDArray[np.int32], target: NDArray[np.int32], receiver_waits: bool
    ) -> None:
        """Determine senders and receivers; collective over all models.

        Args:
            comm: Communicator of all models.
            source: Local node of each interface node in the sending model, -1 on other ranks, shape (nc,).
            target: Local node of each interface node in the receiving model, -1 on other ranks, shape (nc,).
            receiver_waits: Whether receivers already wait when this rank sends, because ranks carry a single model.
        """
        self.clock = MessageClock()
        self._receiver_waits = receiver_waits
        sources = np.array(comm.allgather(source >= 0)).reshape(comm.size, -1)
        targets = np.array(comm.allgather(target >= 0)).reshape(comm.size, -1)
        sender = np.where(sources, np.arange(comm.size)[:, None], np.argmax(sources, axis=0))
        out = [np.flatnonzero(targets[other] & (sender[other] == comm.rank)) for other in range(comm.size)]
        into = [np.flatnonzero(targets[comm.rank] & (sender[comm.rank] == other)) for other in range(comm.size)]
        self._out_rows, self._in_rows = source[np.concatenate(out)], target[np.concatenate(into)]
        self._sent, self._received = np.empty((len(self._out_rows), 3)), np.empty((len(self._in_rows), 3))
        sent, received = _split_rows(self._sent, out), _split_rows(self._received, into)
        self._copied = sent[comm.rank], received[comm.rank]
        others = [other for other in range(comm.size) if other != comm.rank]
        self._sends = [comm.Send_init(sent[k], k, CHANNEL_TAG) for k in others if len(sent[k])]
        self._receives = [comm.Recv_init(received[k], k, CHANNEL_TAG) for k in others if len(received[k])]
        receivers, senders = ([k for k in others if len(rows[k])] for rows in (sent, received))
        self._sending = f"the receipt of interface values by {ACTIVITY.names(comm, receivers)}"
        self._receiving = f"interface values from {ACTIVITY.names(comm, senders)}"

    def send(self, values: NDArray[np.float64]) -> None:
        """Send the interface rows of values, shape (n, 3).

        A large message makes no progress while its sender computes, so the sender waits for the receipt if receivers
        are already waiting. Ranks with both models receive later in the window; waiting for them would deadlock.
        """
        begin = time.perf_counter()
        pack(values, self._out_rows, self._sent)
        packed = time.perf_counter()
        MPI.Prequest.Startall(self._sends)
        if self._receiver_waits:
            ACTIVITY.wait_for(self._sending)
            wait_for(self._sends)
            ACTIVITY.go_on()
        self.clock.count(begin, packed, time.perf_counter())

    def receive(self, values: NDArray[np.float64]) -> None:
        """Receive the interface rows of values, shape (n, 3)."""
        begin = time.perf_counter()
        MPI.Prequest.Startall(self._receives)
        self._copied[1][:] = self._copied[0]
        packed = time.perf_counter()
        ACTIVITY.wait_for(self._receiving)
        wait_for([*self._receives, *self._sends])
        ACTIVITY.go_on()
        arrived = time.perf_counter()
        unpack(self._received, self._in_rows, values)
        self.clock.count(begin, packed, arrived)

    def free(self) -> None:
        """Free the persistent requests."""
        for request in self._sends + self._receives:
            request.Free()
        self._sends, self._receives = [], []


def _split_rows(buffer: NDArray[np.float64], parts: list[NDArray[np.int64]]) -> list[NDArray[np.float64]]:
    """Split a buffer into views of consecutive rows, one for each part."""
    ends = np.cumsum([len(part) for part in parts])
    return [buffer[end - len(part) : end] for part, end in zip(parts, ends, strict=True)]


@dataclass(frozen=True, slots=True)
class InterfaceChannels:
    """The two channels of the interface: velocities to the meso model, forces to the macro model."""

    velocities: Messages
    forces: Messages

    @classmethod
    def open(
        cls, comm: MPI.Comm, macro: NDArray[np.int32], meso: NDArray[np.int32], receiver_waits: bool
    ) -> "InterfaceChannels":
        """Open both channels; collective over all models.

        Args:
            comm: Communicator of all models.
            macro: Local node of each interface node in this rank's macro model, -1 on other ranks, shape (nc,).
            meso: Local node of each interface node in this rank's meso model, -1 on other ranks, shape (nc,).
            receiver_waits: See ``Channel``.
        """
        return cls(Channel(comm, macro, meso, receiver_waits), Channel(comm, meso, macro, receiver_waits))

    @property
    def clocks(self) -> list[MessageClock]:
        """Clocks of both channels."""
        return [self.velocities.clock, self.forces.clock]

    def free(self) -> None:
        """Free both channels."""
        self.velocities.free()
        self.forces.free()
